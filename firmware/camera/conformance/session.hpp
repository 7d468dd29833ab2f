// A session with a camera under test: open, start, record frames, stop; all waits have a timeout.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "camera/conformance/conformance.hpp"

namespace lightwell::conformance {

/// Record of a frame that has been released.
struct ReceivedFrame {
  FrameInfo info;
  ProbeTime at;  ///< When push() was called.
  std::thread::id thread;
};

/// Records the metadata of every frame and optionally holds frames.
class RecordingSink final : public FrameSink {
 public:
  void push(Frame frame) override;

  /// Called at the beginning of push(). Set before start().
  std::function<void(Frame&)> on_frame;
  /// Holds up to `frames` frames; further ones are released at once.
  void keep(std::size_t frames);
  /// Returns the held frames and stops holding new ones.
  [[nodiscard]] std::vector<Frame> take_kept();

  /// Timeout of the wait functions, from BackendUnderTest. Set before start().
  std::chrono::milliseconds timeout{0};
  /// Waits until `frames` frames in total have come; false on timeout or if `camera` ends first.
  [[nodiscard]] bool wait_for(std::size_t frames, const CameraBackend& camera) const;
  /// Waits until no frame has come for `time`; false if more than `most` came in total, or on timeout.
  [[nodiscard]] bool wait_until_idle(std::chrono::milliseconds time, std::size_t most) const;
  [[nodiscard]] std::vector<ReceivedFrame> seen() const;
  [[nodiscard]] std::size_t count() const;
  [[nodiscard]] bool overlapped() const { return overlapped_; }

 private:
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::vector<ReceivedFrame> seen_;
  std::vector<Frame> kept_;
  std::size_t keep_ = 0;
  std::atomic<int> inside_{0};
  std::atomic<bool> overlapped_{false};
};

/// Makes and opens a camera. Appends failures to `violations`. Both arguments outlive the session.
class Session {
 public:
  Session(const BackendUnderTest& camera, Violations& violations);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  [[nodiscard]] bool good() const { return state_->backend != nullptr; }
  [[nodiscard]] const BackendUnderTest& tested() const { return tested_; }
  /// Starts with a new sink, which sink() returns from now on.
  [[nodiscard]] bool start();
  /// Starts with the given sink.
  [[nodiscard]] bool start(std::shared_ptr<RecordingSink> sink);
  /// False, and the session is over, if the camera's stop() does not return.
  bool stop();
  /// start(), then waits until `frames` frames have come.
  [[nodiscard]] bool collect(std::size_t frames = kFramesWanted);

  /// False on timeout.
  [[nodiscard]] bool wait_for_state(CameraBackend::State wanted);
  [[nodiscard]] CameraBackend& camera() { return *state_->backend; }
  [[nodiscard]] RecordingSink& sink() { return *state_->sinks.back(); }
  [[nodiscard]] const CameraInfo& info() const { return info_; }
  [[nodiscard]] int bracket() const { return static_cast<int>(info_.exposure_s.size()); }
  /// Number of frames that the camera must be able to lend at the same time: required_buffer_count().
  [[nodiscard]] std::size_t min_lent_frames() const;
  /// Frame interval; an assumed one if the camera has no frame rate.
  [[nodiscard]] std::chrono::milliseconds interval() const;

 private:
  /// Shared with a stop() that hangs. Sinks outlive the camera, because a broken camera pushes until it is destroyed.
  struct State {
    std::vector<std::shared_ptr<RecordingSink>> sinks;
    std::unique_ptr<CameraBackend> backend;
  };
  /// Runs `call` on a thread; false on timeout. Then the thread and the state it uses are leaked.
  [[nodiscard]] bool returns(const std::function<void(State&)>& call) const;

  std::shared_ptr<State> state_ = std::make_shared<State>();
  Violations& violations_;
  const BackendUnderTest& tested_;
  CameraInfo info_;
};

/// Runs a check in a session of its own, if the camera opens.
template <void (*check)(Session&, Violations&)>
[[nodiscard]] Violations in_session(const BackendUnderTest& camera) {
  Violations violations;
  {
    Session session(camera, violations);
    if (session.good()) check(session, violations);
  }
  return violations;
}

/// Checksum of all views of a frame; reads every byte of the declared size.
[[nodiscard]] std::uint32_t checksum(const Frame& frame);
[[nodiscard]] std::vector<std::uint32_t> checksums(const std::vector<Frame>& frames);

}  // namespace lightwell::conformance
