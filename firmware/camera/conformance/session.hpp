// One life of a camera under test: opened, started, watched, and stopped without waiting for ever.
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

#include "camera/conformance/checks.hpp"

namespace lightwell::conformance {

/// What is left of a frame once it is given back.
struct ReceivedFrame {
  FrameInfo info;
  ProbeTime at;  ///< When push() was called.
  std::thread::id thread;
};

/// Notes every frame and, where asked to, keeps it.
class Watcher final : public FrameSink {
 public:
  void push(Frame frame) override;

  /// Called inside push(), before anything else is done with the frame. Set before start().
  std::function<void(Frame&)> on_frame;
  /// Frames are kept up to this number and given back beyond it.
  void keep(std::size_t frames);
  /// What is kept until now; from now on nothing is.
  [[nodiscard]] std::vector<Frame> take_kept();

  /// Of the backend under test. Set before start().
  std::chrono::milliseconds timeout{0};
  /// Until `frames` have come in all; false when that takes too long or `camera` ends first.
  [[nodiscard]] bool wait_for(std::size_t frames, const CameraBackend& camera) const;
  /// Until none has come for `time`; false when more than `most` came in all, or it takes too long.
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

/// Makes and opens a camera, and writes down in `violations` what goes wrong on the way.
class Session {
 public:
  Session(const BackendUnderTest& camera, Violations& violations);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  [[nodiscard]] bool good() const { return state_->backend != nullptr; }
  /// Starts with a watcher of its own, the session's watcher() from now on.
  [[nodiscard]] bool start();
  /// The same with what the caller has prepared.
  [[nodiscard]] bool start(std::shared_ptr<Watcher> watcher);
  /// False, and the session is over, where stop() does not return.
  bool stop();
  /// start() and until `frames` have come.
  [[nodiscard]] bool collect(std::size_t frames = kFramesWanted);

  /// False where that takes too long.
  [[nodiscard]] bool wait_for_state(CameraBackend::State wanted);
  [[nodiscard]] CameraBackend& camera() { return *state_->backend; }
  [[nodiscard]] Watcher& watcher() { return *state_->watchers.back(); }
  [[nodiscard]] const CameraInfo& info() const { return info_; }
  [[nodiscard]] int bracket() const { return static_cast<int>(info_.exposure_s.size()); }
  /// So many frames must be lent at once, and no camera has reason to lend four times as many.
  [[nodiscard]] std::size_t min_lent_frames() const;
  /// Between two frames; a guess where frames come as they are taken.
  [[nodiscard]] std::chrono::milliseconds interval() const;

 private:
  /// What a stop() that hangs still uses. Watchers outlive the camera: a broken one pushes until it
  /// dies.
  struct State {
    std::vector<std::shared_ptr<Watcher>> watchers;
    std::unique_ptr<CameraBackend> backend;
  };
  /// Calls what must return. Where it does not, a thread is left in there, with what it uses.
  [[nodiscard]] bool returns(const std::function<void(State&)>& call) const;

  std::shared_ptr<State> state_ = std::make_shared<State>();
  Violations& violations_;
  std::chrono::milliseconds timeout_;
  CameraInfo info_;
};

/// Of all that a frame's views show; reads every byte that the view promises.
[[nodiscard]] std::uint32_t checksum(const Frame& frame);
[[nodiscard]] std::vector<std::uint32_t> checksums(const std::vector<Frame>& frames);

}  // namespace lightwell::conformance
