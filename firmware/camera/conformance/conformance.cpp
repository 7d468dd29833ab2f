#include "camera/conformance/conformance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <future>
#include <ostream>
#include <set>
#include <utility>

#include "camera/conformance/session.hpp"

namespace lightwell::conformance {
namespace {

std::string frame_name(const FrameInfo& info) { return "frame " + std::to_string(info.sequence); }

bool positive(double v) { return v > 0 && std::isfinite(v); }

/// Reports invalid sizes, rows that overlap, short data, unaligned values: an estimator would read invalid memory.
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

using State = CameraBackend::State;

/// In the order of the enumerators.
std::string name_of(State state) {
  constexpr std::array kNames = {"idle", "streaming", "finished", "lost"};
  return kNames.at(static_cast<std::size_t>(state));
}

void expect_state(Session& session, State wanted, const std::string& when, Violations& violations) {
  const State state = session.camera().state();
  if (state != wanted) violations.push_back("the state " + when + " is " + name_of(state) + ", not " + name_of(wanted));
}

/// Waits long enough for a thread that was not stopped to push again.
void linger(const Session& session) {
  std::this_thread::sleep_for(std::max(5 * session.interval(), std::chrono::milliseconds(100)));
}

void expect_no_frames(Session& session, const std::string& after, Violations& violations) {
  const std::size_t before = session.sink().count();
  linger(session);
  if (session.sink().count() != before)
    violations.push_back(std::to_string(session.sink().count() - before) + " frames were pushed after " + after);
}

void check_no_push_after_stop(Session& session, Violations& violations) {
  if (!session.collect() || !session.stop()) return;
  expect_no_frames(session, "stop() had returned", violations);
}

void check_restart(Session& session, Violations& violations) {
  ProbeTime last;
  for (int run = 0; run < 3; ++run) {
    // Also stop immediately after start: a thread that has only just begun must be able to end.
    if (!session.start() || !session.stop()) return;
    if (!session.collect() || !session.stop()) return;
    const ReceivedFrame first = session.sink().seen().front();
    if (run > 0 && first.info.mid_exposure <= last)
      violations.emplace_back("the first frame after a restart is older than the last one before");
    last = session.sink().seen().back().info.mid_exposure;
  }
}

void check_states(Session& session, Violations& violations) {
  expect_state(session, State::idle, "after open()", violations);
  if (!session.collect(1)) return;
  if (session.tested().frames == 0) expect_state(session, State::streaming, "while frames come", violations);
  if (!session.stop()) return;
  expect_state(session, State::idle, "after stop()", violations);
}

Violations check_lifecycle_without_frames(const BackendUnderTest& camera) {
  Violations violations;
  {
    Result<std::unique_ptr<CameraBackend>> never_opened = camera.make();
    if (!never_opened) violations.push_back("make: " + never_opened.status().message());
    // Destroyed here without a timeout; the sessions below detect a destructor that hangs.
  }
  { const Session never_started(camera, violations); }
  {
    Session stopped_twice(camera, violations);
    if (!stopped_twice.stop()) return violations;
    if (!stopped_twice.collect(1) || !stopped_twice.stop()) return violations;
    (void)stopped_twice.stop();
  }
  return violations;
}

void check_end(Session& session, Violations& violations) {
  for (int run = 0; run < 2; ++run) {
    if (!session.start()) return;
    if (!session.wait_for_state(State::finished)) {
      violations.push_back("the state is " + name_of(session.camera().state()) +
                           " when all frames have come, not finished");
      return;
    }
    expect_no_frames(session, "the end", violations);
    const std::size_t count = session.sink().count();
    const bool all_must_come = session.tested().pace == BackendUnderTest::Pace::on_demand;
    if (count > session.tested().frames || (all_must_come && count < session.tested().frames))
      violations.push_back(std::to_string(count) + " frames came, there are " +
                           std::to_string(session.tested().frames));
    if (!session.stop()) return;
    expect_state(session, State::idle, "after stop()", violations);
  }
}

void check_loss(Session& session, Violations& violations) {
  if (!session.collect(2)) return;
  session.tested().disconnect();
  if (!session.wait_for_state(State::lost))
    violations.push_back("the device is gone and the state is " + name_of(session.camera().state()) + ", not lost");
  if (!session.stop()) return;
  expect_no_frames(session, "the loss and stop()", violations);
}

void expect_unchanged(const std::vector<Frame>& frames, const std::vector<std::uint32_t>& sums, const std::string& when,
                      Violations& violations) {
  const std::vector<std::uint32_t> now = checksums(frames);
  for (std::size_t i = 0; i < now.size(); ++i)
    if (now[i] != sums[i])
      violations.push_back("frame " + std::to_string(frames[i].info.sequence) + ", which is held, was written to " +
                           when);
}

bool is_over(Session& session) {
  const CameraBackend::State state = session.camera().state();
  return state == CameraBackend::State::finished || state == CameraBackend::State::lost;
}

void check_held_across_stop(Session& session, Violations& violations) {
  // One buffer stays free, so that frames come after the restart.
  const std::size_t held = session.min_lent_frames() - 1;
  auto sink = std::make_shared<RecordingSink>();
  sink->keep(held);
  if (!session.start(sink)) return;
  if (!sink->wait_for(held, session.camera())) {
    violations.push_back("only " + std::to_string(sink->count()) + " of " + std::to_string(held) + " frames came");
    return;
  }
  const std::vector<Frame> frames = sink->take_kept();
  const std::vector<std::uint32_t> sums = checksums(frames);
  if (!session.stop()) return;
  expect_unchanged(frames, sums, "by stop()", violations);
  if (!session.collect()) return;
  expect_unchanged(frames, sums, "after the next start()", violations);
  (void)session.stop();
  expect_unchanged(frames, sums, "by the second stop()", violations);
}

void check_retaining_sink(Session& session, Violations& violations) {
  auto sink = std::make_shared<RecordingSink>();
  // More than any camera needs to lend; a shorter recording may lend all its frames.
  const std::size_t too_many = 4 * session.min_lent_frames() + 32;
  sink->keep(too_many);
  // Computed inside push(): a faulty camera may overwrite the memory soon afterwards.
  auto sums = std::make_shared<std::vector<std::uint32_t>>();
  sink->on_frame = [sums](const Frame& frame) { sums->push_back(checksum(frame)); };
  if (!session.start(sink)) return;
  // Longer than a busy machine delays a thread.
  const auto quiet = std::max(8 * session.interval(), std::chrono::milliseconds(500));
  if (!sink->wait_until_idle(quiet, too_many)) {
    violations.emplace_back("the number of frames lent at the same time is not limited");
    (void)session.stop();
    return;
  }
  std::vector<Frame> frames = sink->take_kept();
  if (frames.size() < session.min_lent_frames() && !is_over(session))
    violations.push_back("only " + std::to_string(frames.size()) + " frames are lent at once, not " +
                         std::to_string(session.min_lent_frames()));
  expect_unchanged(frames, *sums, "while all were held", violations);

  const bool over = is_over(session) || frames.empty();
  const std::uint64_t last = frames.empty() ? 0 : frames.back().info.sequence;
  const std::size_t before = sink->count();
  frames.clear();
  if (!over) {
    if (!sink->wait_for(before + 1, session.camera()))
      violations.emplace_back("no frame comes after all were released");
    else if (session.tested().pace == BackendUnderTest::Pace::own && sink->seen()[before].info.sequence == last + 1)
      violations.emplace_back("frames were lost and the sequence shows no gap");
    else if (session.tested().pace == BackendUnderTest::Pace::on_demand &&
             sink->seen()[before].info.sequence != last + 1)
      violations.emplace_back("an on-demand camera lost frames");
  }
  (void)session.stop();
}

void check_release_on_other_thread(Session& session, Violations& violations) {
  auto releases = std::make_shared<std::vector<std::future<void>>>();
  auto sink = std::make_shared<RecordingSink>();
  sink->on_frame = [releases](Frame& frame) {
    // A thread that has ended keeps its stack until its future is destroyed.
    if (releases->size() >= 32) releases->clear();
    releases->push_back(std::async(std::launch::async, [taken = std::move(frame)]() mutable { taken = Frame(); }));
  };
  if (!session.start(sink)) return;
  const std::size_t enough = session.tested().frames > 0 ? kFramesWanted : 2 * session.min_lent_frames();
  if (!sink->wait_for(enough, session.camera()))
    violations.emplace_back("frames released on another thread are not reused");
  // Destroys the futures, which waits for the releases.
  if (session.stop()) releases->clear();
}

void slow_sink_once(Session& session, Violations& violations) {
  // The frame that was queued, the one that is due, and one more for scheduling delays.
  constexpr int kMaxPerInterval = 3;
  constexpr int kIntervalsSlept = 12;
  if (!(session.info().frame_rate > 0)) return;
  const std::chrono::milliseconds interval = session.interval();
  auto sink = std::make_shared<RecordingSink>();
  sink->on_frame = [n = 0, sleep = kIntervalsSlept * interval](const Frame&) mutable {
    if (++n == 3) std::this_thread::sleep_for(sleep);
  };
  if (!session.start(sink)) return;
  (void)sink->wait_for(3 + 8, session.camera());
  if (!session.stop()) return;
  const std::vector<ReceivedFrame> seen = sink->seen();
  if (seen.size() < 4) {
    violations.emplace_back("no frame comes after the sink blocked once");
    return;
  }
  const ProbeTime end = seen[3].at + Duration{std::chrono::nanoseconds(interval).count()};
  const auto burst = std::count_if(seen.begin() + 3, seen.end(), [end](const ReceivedFrame& s) { return s.at < end; });
  if (burst > kMaxPerInterval)
    violations.push_back(std::to_string(burst) + " frames came within one frame interval after the sink blocked once");
}

Violations check_slow_sink(const BackendUnderTest& camera) {
  // A delayed thread can cause a burst, too; a camera that makes up for lost frames does it every time.
  constexpr int kTries = 3;
  Violations violations;
  for (int i = 0; i < kTries; ++i)
    if (violations = in_session<slow_sink_once>(camera); violations.empty()) break;
  return violations;
}

}  // namespace

std::vector<Check> all_checks() {
  return {
      {"sequence", "SequenceRepeatsOrGoesBack", in_session<check_sequence>},
      {"times", "TimesGoBackOrAreOfAnotherClock", in_session<check_times>},
      {"views", "PicturesAreNotWhatWasDeclared", in_session<check_views>},
      {"exposures", "ExposuresAreOutsideTheDeclaredCycle", in_session<check_exposures>},
      {"one_thread", "SeveralThreadsPush", in_session<check_one_thread>},
      {"no_push_after_stop", "FramesComeAfterStop", in_session<check_no_push_after_stop>},
      {"restart", "StartsOnlyOnce", in_session<check_restart>},
      {"states", "StateIsWrong", in_session<check_states>},
      {"lifecycle_without_frames", "HangsWhereNothingWasStarted", check_lifecycle_without_frames},
      {"end", "EndIsNotSeen", in_session<check_end>, [](const BackendUnderTest& camera) { return camera.frames > 0; }},
      {"loss", "LossIsNotSeen", in_session<check_loss>,
       [](const BackendUnderTest& camera) { return camera.disconnect != nullptr; }},
      {"held_across_stop", "HeldFramesChangeAcrossStop", in_session<check_held_across_stop>},
      {"retaining_sink", "LentMemoryIsWrittenToOrLossesAreHidden", in_session<check_retaining_sink>},
      {"release_on_other_thread", "ReleaseOnAnotherThreadIsLost", in_session<check_release_on_other_thread>},
      {"slow_sink", "SlowSinkIsFollowedByABurst", check_slow_sink,
       [](const BackendUnderTest& camera) { return camera.pace == BackendUnderTest::Pace::own; }},
  };
}

::testing::internal::ParamGenerator<CheckOfBackend> cameras(const std::vector<BackendUnderTest>& all) {
  std::vector<CheckOfBackend> tests;
  for (const BackendUnderTest& camera : all)
    for (const Check& check : all_checks()) tests.push_back({camera, check});
  return ::testing::ValuesIn(tests);
}

std::string name_of(const ::testing::TestParamInfo<CheckOfBackend>& info) {
  return info.param.camera.name + "_" + info.param.check.fault;
}

void PrintTo(const CheckOfBackend& tested, std::ostream* out) {
  *out << tested.camera.name << ", check " << tested.check.name;
}

// Tests may link this library without instantiating the suite.
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(CameraConformance);

TEST_P(CameraConformance, Check) {
  const auto& [camera, check] = GetParam();
  if (check.applies != nullptr && !check.applies(camera)) GTEST_SKIP() << "does not apply to this camera";
  const Violations violations = check.run(camera);
  // A fault often repeats in every frame: the first violations suffice.
  constexpr std::size_t kShown = 8;
  for (std::size_t i = 0; i < violations.size() && i < kShown; ++i) ADD_FAILURE() << violations[i];
  if (violations.size() > kShown) ADD_FAILURE() << "and " << violations.size() - kShown << " more like these";
}

}  // namespace lightwell::conformance
