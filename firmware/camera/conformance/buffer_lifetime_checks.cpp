// Checks of the lifetime of lent buffers, and of slow sinks.
#include <algorithm>
#include <future>
#include <string>
#include <utility>

#include "camera/conformance/session.hpp"

namespace lightwell::conformance {
namespace {

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
    if (!sink->wait_for(before + 1, session.camera())) {
      violations.emplace_back("no frame comes after all were released");
    } else if (session.tested().pace == BackendUnderTest::Pace::own && sink->seen()[before].info.sequence == last + 1) {
      violations.emplace_back("frames were lost and the sequence shows no gap");
    } else if (session.tested().pace == BackendUnderTest::Pace::on_demand &&
               sink->seen()[before].info.sequence != last + 1) {
      violations.emplace_back("an on-demand camera lost frames");
    }
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
  // On a busy machine a delayed thread can cause a burst, too; a camera that makes up for lost frames does it every
  // time.
  constexpr int kTries = 3;
  Violations violations;
  for (int i = 0; i < kTries; ++i)
    if (violations = in_session<slow_sink_once>(camera); violations.empty()) break;
  return violations;
}

}  // namespace

std::vector<Check> buffer_lifetime_checks() {
  return {
      {"held_across_stop", "HeldFramesChangeAcrossStop", in_session<check_held_across_stop>},
      {"retaining_sink", "LentMemoryIsWrittenToOrLossesAreHidden", in_session<check_retaining_sink>},
      {"release_on_other_thread", "ReleaseOnAnotherThreadIsLost", in_session<check_release_on_other_thread>},
      {"slow_sink", "SlowSinkIsFollowedByABurst", check_slow_sink,
       [](const BackendUnderTest& camera) { return camera.pace == BackendUnderTest::Pace::own; }},
  };
}

}  // namespace lightwell::conformance
