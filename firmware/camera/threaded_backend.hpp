// Base of the backends of this folder: the thread that pushes the frames, and the life cycle around it.
#pragma once

#include <atomic>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>

#include "camera/backend.hpp"

namespace lightwell {

/// One thread pushes frames from start() to stop(). The destructor of a derived class calls stop().
class ThreadedBackend : public CameraBackend {
 public:
  /// failed_precondition unless the camera is open and stopped; errors of before_run().
  [[nodiscard]] Status start(FrameSink& sink) final {
    if (!is_open()) return {StatusCode::failed_precondition, scheme_ + ": open() comes before start()"};
    if (thread_.joinable())
      return {StatusCode::failed_precondition, scheme_ + ": stop() comes before the next start()"};
    if (Status s = before_run(); !s.ok()) return s;
    state_ = State::streaming;
    thread_ = std::jthread([this, &sink](const std::stop_token& stop) { run(sink, stop); });
    return {};
  }
  void stop() final {
    if (!thread_.joinable()) return;
    thread_.request_stop();
    thread_.join();
    after_run();
    state_ = State::idle;
  }
  [[nodiscard]] State state() const final { return state_; }

 protected:
  explicit ThreadedBackend(std::string scheme) : scheme_(std::move(scheme)) {}

  [[nodiscard]] virtual bool is_open() const = 0;
  [[nodiscard]] virtual Status before_run() { return {}; }
  /// The thread: pushes frames until `stop` is requested, or to the end. Sets state_ at the end and while the device is
  /// lost.
  virtual void run(FrameSink& sink, const std::stop_token& stop) = 0;
  virtual void after_run() {}

  std::atomic<State> state_{State::idle};

 private:
  const std::string scheme_;
  std::jthread thread_;
};

}  // namespace lightwell
