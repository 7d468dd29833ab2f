// The camera interface, which the conformance suite (conformance/) tests, and the base of the backends of this folder.
#pragma once

#include <atomic>
#include <optional>
#include <pthread.h>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/config.hpp>
#include <lightwell/pixel.hpp>
#include <lightwell/result.hpp>

#include "imaging/frame.hpp"

namespace lightwell {

/// Properties of the frames that a camera delivers after start().
struct CameraInfo {
  std::string name;           ///< Display name: "sim:city", "UVC Camera (046d:0825)".
  int width = 0, height = 0;  ///< Pixels, of each view.
  PixelFormat format = PixelFormat::rgb8;
  int lenses = 1;
  double frame_rate = 0;                     ///< Nominal, 1/s; 0: no fixed rate, frames are delivered on demand.
  std::vector<double> exposure_s;            ///< The exposure cycle in force, s; one entry if the exposure is constant.
  std::optional<RigParameters> calibration;  ///< Calibration supplied by the camera itself, if any.
  std::vector<std::string> notes;            ///< Deviations from the requested settings, for the log.
};

/// Life cycle: open -> (start -> stop)* -> destruction. One owner calls it; only state() is thread-safe.
///   - open() acquires the device and fixes format, size and rate. They may differ from the request; notes say so.
///   - start() makes one thread of the backend call sink.push() for each frame.
///   - stop() returns after the last push() has returned. Frames that are still held stay valid until the backend is
///     destroyed.
///   - The backend never writes to the memory of a frame that is held. If all buffers are held, it drops frames, and
///     the sequence numbers show the gap.
class CameraBackend {
 public:
  virtual ~CameraBackend() = default;

  [[nodiscard]] virtual Result<CameraInfo> open() = 0;
  [[nodiscard]] virtual Status start(FrameSink& sink) = 0;
  virtual void stop() = 0;

  enum class State : std::uint8_t {
    idle,       ///< Not started, or stopped.
    streaming,  ///< Frames are delivered.
    finished,   ///< The end of a recording was reached.
    lost,       ///< The device was disconnected. The state is streaming again once the backend has reconnected.
  };
  /// Thread-safe.
  [[nodiscard]] virtual State state() const = 0;
};

/// Number of frames that a backend must be able to lend at the same time, for brackets of `bracket_size` exposures: one
/// bracket in the estimator, one queued, one being filled, and one frame being captured.
[[nodiscard]] constexpr int required_buffer_count(int bracket_size) { return 3 * bracket_size + 1; }

/// Base with the life cycle of one thread, which pushes frames from start() to stop(). The destructor of a derived
/// class calls stop().
class ThreadedBackend : public CameraBackend {
 public:
  /// The thread's name, which top -H shows.
  static constexpr const char* kThreadName = "camera";

  /// failed_precondition unless the camera is open and stopped; errors of before_run().
  [[nodiscard]] Status start(FrameSink& sink) final {
    if (!is_open()) return {StatusCode::failed_precondition, scheme_ + ": open() comes before start()"};
    if (thread_.joinable())
      return {StatusCode::failed_precondition, scheme_ + ": stop() comes before the next start()"};
    if (Status s = before_run(); !s.ok()) return s;
    state_ = State::streaming;
    thread_ = std::jthread([this, &sink](const std::stop_token& stop) {
      pthread_setname_np(pthread_self(), kThreadName);
      run(sink, stop);
    });
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
  /// The thread: pushes frames until `stop` is requested or the end. Sets state_ then, and while the device is lost.
  virtual void run(FrameSink& sink, const std::stop_token& stop) = 0;
  virtual void after_run() {}

  std::atomic<State> state_{State::idle};

 private:
  const std::string scheme_;
  std::jthread thread_;
};

}  // namespace lightwell
