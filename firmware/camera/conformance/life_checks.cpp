// Checks of the life cycle: start, stop, restart, end, loss of the device.
#include <algorithm>
#include <string>

#include "camera/conformance/session.hpp"

namespace lightwell::conformance {
namespace {

using State = CameraBackend::State;

std::string name_of(State state) {
  switch (state) {
    case State::idle:
      return "idle";
    case State::streaming:
      return "streaming";
    case State::finished:
      return "finished";
    case State::lost:
      return "lost";
  }
  return "invalid";
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

}  // namespace

Violations check_no_push_after_stop(const BackendUnderTest& camera) {
  Violations violations;
  Session session(camera, violations);
  if (!session.collect() || !session.stop()) return violations;
  expect_no_frames(session, "stop() had returned", violations);
  return violations;
}

Violations check_restart(const BackendUnderTest& camera) {
  Violations violations;
  Session session(camera, violations);
  ProbeTime last;
  for (int run = 0; run < 3; ++run) {
    // Also stop immediately after start: a thread that has only just begun must be able to end.
    if (!session.start() || !session.stop()) return violations;
    if (!session.collect() || !session.stop()) return violations;
    const ReceivedFrame first = session.sink().seen().front();
    if (run > 0 && first.info.mid_exposure <= last)
      violations.emplace_back("the first frame after a restart is older than the last one before");
    last = session.sink().seen().back().info.mid_exposure;
  }
  return violations;
}

Violations check_states(const BackendUnderTest& camera) {
  Violations violations;
  Session session(camera, violations);
  if (!session.good()) return violations;
  expect_state(session, State::idle, "after open()", violations);
  if (!session.collect(1)) return violations;
  if (camera.frames == 0) expect_state(session, State::streaming, "while frames come", violations);
  if (!session.stop()) return violations;
  expect_state(session, State::idle, "after stop()", violations);
  return violations;
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

Violations check_end(const BackendUnderTest& camera) {
  Violations violations;
  if (camera.frames == 0) return violations;
  Session session(camera, violations);
  for (int run = 0; run < 2; ++run) {
    if (!session.start()) return violations;
    if (!session.wait_for_state(State::finished)) {
      violations.push_back("the state is " + name_of(session.camera().state()) +
                           " when all frames have come, not finished");
      return violations;
    }
    expect_no_frames(session, "the end", violations);
    const std::size_t count = session.sink().count();
    const bool all_must_come = camera.pace == BackendUnderTest::Pace::on_demand;
    if (count > camera.frames || (all_must_come && count < camera.frames))
      violations.push_back(std::to_string(count) + " frames came, there are " + std::to_string(camera.frames));
    if (!session.stop()) return violations;
    expect_state(session, State::idle, "after stop()", violations);
  }
  return violations;
}

Violations check_loss(const BackendUnderTest& camera) {
  Violations violations;
  if (!camera.disconnect) return violations;
  Session session(camera, violations);
  if (!session.collect(2)) return violations;
  camera.disconnect();
  if (!session.wait_for_state(State::lost))
    violations.push_back("the device is gone and the state is " + name_of(session.camera().state()) + ", not lost");
  if (!session.stop()) return violations;
  expect_no_frames(session, "the loss and stop()", violations);
  return violations;
}

}  // namespace lightwell::conformance
