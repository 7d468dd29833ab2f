// Checks of the frames themselves: sequence, times, views, exposures, thread.
#include <cmath>
#include <cstdint>
#include <set>

#include "camera/conformance/session.hpp"

namespace lightwell::conformance {
namespace {

std::string frame_name(const FrameInfo& info) { return "frame " + std::to_string(info.sequence); }

bool positive(double v) { return v > 0 && std::isfinite(v); }

/// Reports sizes that the format cannot have, rows that overlap, data that are too short, and values that are not
/// aligned: an estimator would read invalid memory.
void check_layout(const View& view, const std::string& name, Violations& violations) {
  if (const Status s = check_view(view); !s.ok()) violations.push_back(name + ": " + s.message());
  const std::size_t alignment = pixel_layout(view.format).sample_bytes;
  if (view.stride % alignment != 0 || reinterpret_cast<std::uintptr_t>(view.data.data()) % alignment != 0)
    violations.push_back(name + ": rows are not aligned for the pixel type");
}

void check_frame_views(const Frame& frame, const CameraInfo& info, Violations& violations) {
  if (frame.views().size() != static_cast<std::size_t>(info.lenses))
    violations.push_back(frame_name(frame.info) + " has " + std::to_string(frame.views().size()) +
                         " views, declared are " + std::to_string(info.lenses));
  std::set<int> lenses;
  for (const View& view : frame.views()) {
    const std::string name = frame_name(frame.info) + " lens " + std::to_string(view.lens);
    if (view.lens < 0 || view.lens >= info.lenses || !lenses.insert(view.lens).second)
      violations.push_back(name + ": invalid or repeated lens index");
    if (!lenses.empty() && *lenses.rbegin() > view.lens)
      violations.push_back(name + ": not in the order of the lenses");
    if (view.width != info.width || view.height != info.height)
      violations.push_back(name + ": not of the declared size");
    if (view.format != info.format) violations.push_back(name + ": not of the declared format");
    check_layout(view, name, violations);
  }
  (void)checksum(frame);  // Reads all bytes, so that a sanitizer detects invalid memory.
}

void check_declared(const CameraInfo& info, Violations& violations) {
  if (info.name.empty()) violations.push_back("the camera has no name");
  if (info.width < 1 || info.height < 1) violations.push_back("the declared size is not positive");
  if (info.lenses < 1 || info.lenses > kMaxLenses) violations.push_back("the declared number of lenses is impossible");
  if (!(info.frame_rate >= 0) || !std::isfinite(info.frame_rate))
    violations.push_back("the declared frame rate is impossible");
  if (!info.calibration) return;
  if (const Status s = info.calibration->validate(); !s.ok())
    violations.push_back("the camera's own calibration: " + s.message());
  if (info.calibration->lenses.size() != static_cast<std::size_t>(info.lenses))
    violations.push_back("the camera's own calibration has another number of lenses");
}

void check_sequence(Session& session, Violations& violations) {
  if (!session.collect() || !session.stop()) return;
  const std::vector<ReceivedFrame> seen = session.sink().seen();
  for (std::size_t i = 1; i < seen.size(); ++i)
    if (seen[i].info.sequence <= seen[i - 1].info.sequence)
      violations.push_back("sequence " + std::to_string(seen[i].info.sequence) + " comes after " +
                           std::to_string(seen[i - 1].info.sequence));
}

void check_times(Session& session, Violations& violations) {
  // An older mid-exposure time is of another clock.
  constexpr Duration kMaxAge = Duration::from_seconds(5);
  if (!session.collect() || !session.stop()) return;
  const std::vector<ReceivedFrame> seen = session.sink().seen();
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const FrameInfo& info = seen[i].info;
    const std::string name = frame_name(info);
    if (info.delivered < info.mid_exposure)
      violations.push_back(name + ": delivered before the middle of its exposure");
    if (info.delivered > seen[i].at) violations.push_back(name + ": delivered in the future");
    if (seen[i].at - info.mid_exposure > kMaxAge)
      violations.push_back(name + ": its mid-exposure is " +
                           std::to_string((seen[i].at - info.mid_exposure).seconds()) + " s ago; not CLOCK_MONOTONIC?");
    if (info.row_readout.ns < 0) violations.push_back(name + ": row_readout is negative");
    if (i == 0) continue;
    if (info.mid_exposure <= seen[i - 1].info.mid_exposure)
      violations.push_back(name + ": its mid-exposure is not after that of the frame before");
    if (info.delivered < seen[i - 1].info.delivered) violations.push_back(name + ": delivered before the frame before");
  }
}

void check_views(Session& session, Violations& violations) {
  check_declared(session.info(), violations);
  // Shared, because a stop() that hangs leaks the sink.
  auto in_frames = std::make_shared<Violations>();
  auto sink = std::make_shared<RecordingSink>();
  sink->on_frame = [in_frames, info = session.info()](const Frame& frame) {
    check_frame_views(frame, info, *in_frames);
  };
  if (!session.start(sink)) return;
  if (!sink->wait_for(kFramesWanted, session.camera())) violations.emplace_back("too few frames came");
  if (!session.stop()) return;
  violations.insert(violations.end(), in_frames->begin(), in_frames->end());
}

void check_exposures(Session& session, Violations& violations) {
  // Cameras round exposures to whole rows of their sensor.
  constexpr double kTolerance = 0.05;
  const std::vector<double>& cycle = session.info().exposure_s;
  if (cycle.empty() || cycle.size() > static_cast<std::size_t>(kMaxBracket)) {
    violations.push_back("the declared cycle has " + std::to_string(cycle.size()) + " exposures");
    return;
  }
  if (!session.collect(std::max<std::size_t>(kFramesWanted, 2 * cycle.size() + 1)) || !session.stop()) return;
  const FrameInfo* before = nullptr;
  const std::vector<ReceivedFrame> seen = session.sink().seen();
  for (const ReceivedFrame& one : seen) {
    const FrameInfo& info = one.info;
    const std::string name = frame_name(info);
    if (!positive(info.exposure_s)) violations.push_back(name + ": exposure is not positive");
    if (!positive(info.gain)) violations.push_back(name + ": gain is not positive");
    if (info.bracket_size != static_cast<int>(cycle.size()) || info.bracket_index < 0 ||
        info.bracket_index >= info.bracket_size) {
      violations.push_back(name + ": bracket_index is outside the declared cycle");
      continue;
    }
    const double declared = cycle[static_cast<std::size_t>(info.bracket_index)];
    if (!(std::abs(info.exposure_s - declared) <= kTolerance * declared))
      violations.push_back(name + ": exposure " + std::to_string(info.exposure_s) + " s, declared is " +
                           std::to_string(declared) + " s");
    if (before != nullptr && info.sequence == before->sequence + 1 &&
        info.bracket_index != (before->bracket_index + 1) % info.bracket_size)
      violations.push_back(name + ": bracket_index does not continue the cycle");
    before = &info;
  }
}

void check_one_thread(Session& session, Violations& violations) {
  if (!session.collect() || !session.stop()) return;
  std::set<std::thread::id> threads;
  for (const ReceivedFrame& seen : session.sink().seen()) threads.insert(seen.thread);
  if (threads.size() != 1) violations.push_back("push() came from " + std::to_string(threads.size()) + " threads");
  if (threads.contains(std::this_thread::get_id()))
    violations.emplace_back("push() came from the thread that called start()");
  if (session.sink().overlapped()) violations.emplace_back("push() was called before the push() before had returned");
}

}  // namespace

std::vector<Check> frame_checks() {
  return {
      {"sequence", "SequenceRepeatsOrGoesBack", in_session<check_sequence>},
      {"times", "TimesGoBackOrAreOfAnotherClock", in_session<check_times>},
      {"views", "PicturesAreNotWhatWasDeclared", in_session<check_views>},
      {"exposures", "ExposuresAreOutsideTheDeclaredCycle", in_session<check_exposures>},
      {"one_thread", "SeveralThreadsPush", in_session<check_one_thread>},
  };
}

}  // namespace lightwell::conformance
