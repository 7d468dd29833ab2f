// One lens: buffers that are queued to a camera with an exposure and come back with a picture.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <lightwell/pixel.hpp>
#include <lightwell/result.hpp>
#include <lightwell/time.hpp>

#include "camera/backend.hpp"
#include "camera/backends/libcamera/choices.hpp"

namespace lightwell::libcam {

/// Both clocks at one instant.
struct ClockReading {
  std::int64_t monotonic_ns = 0;
  std::int64_t boottime_ns = 0;  ///< Includes the time the machine was suspended.
};
[[nodiscard]] ClockReading read_clocks();

/// Converts libcamera's timestamps to the probe's clock (CLOCK_MONOTONIC). libcamera documents SensorTimestamp as
/// CLOCK_BOOTTIME, but passes on the timestamp of the kernel's driver, which is usually CLOCK_MONOTONIC. They differ by
/// the time of suspension, so a timestamp in the future of CLOCK_MONOTONIC must be CLOCK_BOOTTIME.
class SensorClock {
 public:
  /// Converts to CLOCK_MONOTONIC; `now` is the time of arrival. Empty if the timestamp fits neither clock: it is not
  /// before `now`, or more than 5 s ago. Once a timestamp can only be CLOCK_BOOTTIME, all later ones are read as such.
  [[nodiscard]] std::optional<ProbeTime> to_probe_time(std::int64_t timestamp_ns, const ClockReading& now);

 private:
  bool boottime_ = false;
};

/// Rows are exposed `row_readout` after one another (zero for a global shutter).
struct FrameTiming {
  double exposure_s = 0;
  Duration row_readout;
  int rows = 0;
  TimestampEvent event = TimestampEvent::readout;
};

/// Middle of the centre row's exposure.
[[nodiscard]] ProbeTime mid_exposure(ProbeTime stamp, const FrameTiming& timing);
/// Start of the first row's exposure.
[[nodiscard]] ProbeTime exposure_begin(ProbeTime stamp, const FrameTiming& timing);

/// Memory layout of a picture in a buffer.
struct PictureLayout {
  PixelFormat format = PixelFormat::nv12;
  int width = 0, height = 0;
  std::size_t stride = 0;
};

/// Metadata of a completed buffer.
struct Picture {
  bool good = false;  ///< The picture is complete; otherwise the other fields are undefined.
  std::int64_t timestamp_ns = 0;
  std::uint64_t sequence = 0;
  std::optional<double> exposure_s;  ///< Exposure of this frame, if the camera reports it.
  std::optional<double> gain;
};

/// The buffers' memory. It may outlive its lens and its camera.
class PictureMemory {
 public:
  virtual ~PictureMemory() = default;
  [[nodiscard]] virtual std::span<const std::byte> picture(int buffer) const = 0;
  /// Ends the reading that Lens::collect() began, where the lens has other buffers by then; else make_idle() does.
  virtual void end_reading(int buffer) const = 0;
};

/// Life cycle: acquire -> (start -> stop)* -> release, and acquire again after a disconnection. One thread at a time;
/// completions and connection changes reach the backend's mailbox from other threads.
class Lens {
 public:
  virtual ~Lens() = default;

  /// Acquires the camera, fixes format, size and controls, and maps `lendable` buffers plus those that stay queued in
  /// the camera. Format and size must be the same at each acquisition. unavailable while it is disconnected.
  [[nodiscard]] virtual Status acquire(const LibcameraOptions& options, int lendable) = 0;
  virtual void release() = 0;
  [[nodiscard]] virtual bool acquired() const = 0;
  /// Acquired, and the camera is still connected.
  [[nodiscard]] virtual bool present() const = 0;

  [[nodiscard]] virtual Status start() = 0;
  /// No completion is posted after it has returned.
  virtual void stop() = 0;

  // After the first acquire()
  [[nodiscard]] virtual const std::string& id() const = 0;
  [[nodiscard]] virtual const std::string& model() const = 0;
  [[nodiscard]] virtual const PictureLayout& layout() const = 0;
  [[nodiscard]] virtual const SelectedControls& controls() const = 0;
  [[nodiscard]] virtual const std::vector<std::string>& notes() const = 0;
  [[nodiscard]] virtual std::shared_ptr<const PictureMemory> memory() const = 0;
  [[nodiscard]] virtual int buffers() const = 0;
  /// Number of acquisitions so far.
  [[nodiscard]] virtual int session() const = 0;

  // While started
  /// Whether the camera's queue is full, or no buffer is idle.
  [[nodiscard]] virtual bool full() const = 0;
  /// Queues an idle buffer to the camera and sets the exposure from then on. False if the camera refuses it.
  [[nodiscard]] virtual bool queue(std::int32_t exposure_us) = 0;
  /// Takes a completed buffer, which is then neither queued nor idle, and begins reading.
  [[nodiscard]] virtual Picture collect(int buffer) = 0;
  /// The buffer is no longer in use.
  virtual void make_idle(int buffer) = 0;
};

struct Completion {
  int lens = 0;
  int session = 0;  ///< Lens::session() of the request; completions of older sessions are ignored.
  int buffer = 0;
  ClockReading at;
};

/// Events for the backend's thread: requests that libcamera has completed, released frames, connected and disconnected
/// cameras. Bounded by the number of buffers; no allocation after prepare().
class Mailbox {
 public:
  struct Events {
    std::vector<Completion> completions;
    std::vector<int> returned;
    bool cameras_changed = false;
    bool stop = false;
  };

  /// Reserves capacity, here and in `post`, the argument of every take(). Call before other threads use the mailbox.
  void prepare(Events& post, std::size_t completions, std::size_t returns) {
    max_completions_ = completions;
    for (Events* p : {&post, &filling_}) {
      p->completions.reserve(completions);
      p->returned.reserve(returns);
    }
  }

  // Thread-safe.
  void complete(const Completion& completion) {
    const std::lock_guard lock(mutex_);
    // Full only with completions of an older session: each buffer is queued at most once.
    if (filling_.completions.size() == max_completions_) return;
    filling_.completions.push_back(completion);
    changed_.notify_all();
  }
  void give_back(int slot) {
    const std::lock_guard lock(mutex_);
    filling_.returned.push_back(slot);
    changed_.notify_all();
  }
  void cameras_changed() {
    const std::lock_guard lock(mutex_);
    filling_.cameras_changed = true;
    changed_.notify_all();
  }
  void stop() {
    const std::lock_guard lock(mutex_);
    filling_.stop = true;
    changed_.notify_all();
  }

  // Called by the backend's thread.
  using Clock = std::chrono::steady_clock;
  /// Waits until there are events, or until `limit`; replaces `post` by them, in order.
  void take(Events& post, Clock::time_point limit) {
    post.completions.clear();
    post.returned.clear();
    post.cameras_changed = false;
    std::unique_lock lock(mutex_);
    changed_.wait_until(lock, limit, [this] {
      return filling_.stop || filling_.cameras_changed || !filling_.completions.empty() || !filling_.returned.empty();
    });
    // Swap, so that both vectors keep their capacity.
    std::swap(post.completions, filling_.completions);
    std::swap(post.returned, filling_.returned);
    post.cameras_changed = std::exchange(filling_.cameras_changed, false);
    post.stop = filling_.stop;
  }
  /// Discards completions and a pending stop; released frames stay until take().
  void restart() {
    const std::lock_guard lock(mutex_);
    filling_.completions.clear();
    filling_.stop = false;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  Events filling_;
  std::size_t max_completions_ = 0;
};

/// The exposures that a camera sets when asked for those of the cycle, whether it reports them, and its frame rate.
struct CameraCapabilities {
  bool reports_exposure = false;   ///< Each frame's metadata states its exposure.
  std::vector<double> exposure_s;  ///< The cycle: as reported, or as requested if the camera does not report it.
  double gain = 1;
  Duration interval;  ///< Frame interval.
  std::vector<std::string> notes;
};

/// Starts `lens`, takes frames, and stops it: a second or two at 30 frames per second. unavailable if no frame comes
/// within 5 s; failed_precondition if a bracket's reported exposures are not the requested ones (a single exposure:
/// a note), or if a report is not positive.
[[nodiscard]] Result<CameraCapabilities> probe_capabilities(Lens& lens, Mailbox& mailbox, Mailbox::Events& post,
                                                            double nominal_rate);

/// Frame interval from the time between the first and the last of `frames` intervals; `nominal` if that is implausible.
[[nodiscard]] Duration measured_interval(Duration passed, std::uint64_t frames, Duration nominal);

/// The backend over one or two lenses, with the indices 0 and 1, that post to `mailbox`. Pushes from one thread of its
/// own, which also queues idle buffers to the cameras. open() runs the cameras briefly (probe_capabilities()). If a
/// camera is disconnected, or delivers nothing for seconds, the state is lost; all lenses stop until it is back.
[[nodiscard]] std::unique_ptr<CameraBackend> make_lens_backend(LibcameraOptions options,
                                                               std::vector<std::unique_ptr<Lens>> lenses,
                                                               std::shared_ptr<Mailbox> mailbox);

}  // namespace lightwell::libcam
