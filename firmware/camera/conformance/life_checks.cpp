// Checks of the life cycle: start, stop, restart, end, loss of the device.
#include <algorithm>
#include <array>
#include <string>

#include "camera/conformance/session.hpp"

namespace lightwell::conformance {
namespace {

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

}  // namespace

std::vector<Check> life_checks() {
  return {
      {"no_push_after_stop", "FramesComeAfterStop", in_session<check_no_push_after_stop>},
      {"restart", "StartsOnlyOnce", in_session<check_restart>},
      {"states", "StateIsWrong", in_session<check_states>},
      {"lifecycle_without_frames", "HangsWhereNothingWasStarted", check_lifecycle_without_frames},
      {"end", "EndIsNotSeen", in_session<check_end>, [](const BackendUnderTest& camera) { return camera.frames > 0; }},
      {"loss", "LossIsNotSeen", in_session<check_loss>,
       [](const BackendUnderTest& camera) { return camera.disconnect != nullptr; }},
  };
}

}  // namespace lightwell::conformance
