#include "camera/conformance/session.hpp"

#include <algorithm>
#include <future>
#include <utility>

#include <lightwell/bytes.hpp>

namespace lightwell::conformance {

using Clock = std::chrono::steady_clock;

void RecordingSink::push(Frame frame) {
  if (inside_.fetch_add(1) != 0) overlapped_ = true;
  const ReceivedFrame seen{frame.info, {monotonic_now_ns()}, std::this_thread::get_id()};
  if (on_frame) on_frame(frame);
  {
    const std::lock_guard lock(mutex_);
    seen_.push_back(seen);
    if (kept_.size() < keep_) kept_.push_back(std::move(frame));
    changed_.notify_all();
  }
  inside_.fetch_sub(1);
}

void RecordingSink::keep(std::size_t frames) {
  const std::lock_guard lock(mutex_);
  keep_ = frames;
}

std::vector<Frame> RecordingSink::take_kept() {
  const std::lock_guard lock(mutex_);
  keep_ = 0;
  return std::exchange(kept_, {});
}

bool RecordingSink::wait_for(std::size_t frames, const CameraBackend& camera) const {
  const Clock::time_point limit = Clock::now() + timeout;
  std::unique_lock lock(mutex_);
  while (seen_.size() < frames) {
    const CameraBackend::State state = camera.state();
    const bool over = state == CameraBackend::State::finished || state == CameraBackend::State::lost;
    // The last frames may have come between the two queries.
    if (over || Clock::now() > limit) return seen_.size() >= frames;
    changed_.wait_for(lock, std::chrono::milliseconds(20));
  }
  return true;
}

bool RecordingSink::wait_until_idle(std::chrono::milliseconds time, std::size_t most) const {
  const Clock::time_point limit = Clock::now() + timeout;
  std::unique_lock lock(mutex_);
  while (Clock::now() < limit && seen_.size() <= most) {
    const std::size_t before = seen_.size();
    if (!changed_.wait_for(lock, time, [&] { return seen_.size() != before; })) return true;
  }
  return false;
}

std::vector<ReceivedFrame> RecordingSink::seen() const {
  const std::lock_guard lock(mutex_);
  return seen_;
}

std::size_t RecordingSink::count() const {
  const std::lock_guard lock(mutex_);
  return seen_.size();
}

bool Session::returns(const std::function<void(State&)>& call) const {
  auto done = std::make_shared<std::promise<void>>();
  const std::future<void> future = done->get_future();
  std::thread thread([call, done, state = state_] {
    call(*state);
    done->set_value();
  });
  if (future.wait_for(tested_.timeout) == std::future_status::ready) {
    thread.join();
    return true;
  }
  thread.detach();
  return false;
}

Session::Session(const BackendUnderTest& camera, Violations& violations) : violations_(violations), tested_(camera) {
  Result<std::unique_ptr<CameraBackend>> made = camera.make();
  if (!made) {
    violations.push_back("make: " + made.status().message());
    return;
  }
  state_->backend = std::move(*made);
  Result<CameraInfo> info = state_->backend->open();
  if (!info) {
    violations.push_back("open(): " + info.status().message());
    state_->backend.reset();
    return;
  }
  info_ = std::move(*info);
}

Session::~Session() {
  if (!good()) return;
  (void)stop();
  // Release all frames before the camera is destroyed.
  for (const auto& sink : state_->sinks) (void)sink->take_kept();
  if (!returns([](State& state) { state.backend.reset(); })) violations_.push_back("the destructor does not return");
}

bool Session::start() { return start(std::make_shared<RecordingSink>()); }

bool Session::start(std::shared_ptr<RecordingSink> sink) {
  if (!good()) return false;
  sink->timeout = tested_.timeout;
  state_->sinks.push_back(std::move(sink));
  const Status started = camera().start(*state_->sinks.back());
  if (!started.ok()) violations_.push_back("start(): " + started.message());
  return started.ok();
}

bool Session::stop() {
  if (!good()) return false;
  if (returns([](State& state) { state.backend->stop(); })) return true;
  violations_.push_back("stop() does not return");
  // The hanging thread keeps the old state.
  state_ = std::make_shared<State>();
  return false;
}

bool Session::wait_for_state(CameraBackend::State wanted) {
  const Clock::time_point limit = Clock::now() + tested_.timeout;
  while (camera().state() != wanted) {
    if (Clock::now() > limit) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

bool Session::collect(std::size_t frames) {
  if (!start()) return false;
  if (sink().wait_for(frames, camera())) return true;
  violations_.push_back("only " + std::to_string(sink().count()) + " of " + std::to_string(frames) + " frames came");
  return false;
}

std::size_t Session::min_lent_frames() const {
  return static_cast<std::size_t>(required_buffer_count(std::max(1, bracket())));
}

std::chrono::milliseconds Session::interval() const {
  const double rate = info_.frame_rate > 0 ? info_.frame_rate : 50;
  return std::chrono::milliseconds(std::max(1, static_cast<int>(1000 / rate)));
}

std::uint32_t checksum(const Frame& frame) {
  std::uint32_t sum = 0;
  for (const View& view : frame.views()) sum = crc32c(view.data, sum);
  return sum;
}

std::vector<std::uint32_t> checksums(const std::vector<Frame>& frames) {
  std::vector<std::uint32_t> sums;
  for (const Frame& frame : frames) sums.push_back(checksum(frame));
  return sums;
}

}  // namespace lightwell::conformance
