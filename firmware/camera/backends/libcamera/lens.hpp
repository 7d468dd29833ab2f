// Interface of one lens: buffers that are queued to a camera with an exposure and come back with a picture. LensStream
// implements it with libcamera; LensBackend uses only this interface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <lightwell/pixel.hpp>
#include <lightwell/result.hpp>

#include "camera/backends/libcamera/control_choice.hpp"
#include "camera/backends/libcamera/libcamera_options.hpp"

namespace lightwell::libcam {

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
  /// Ends the reading that Lens::collect() began, if the lens has other buffers by then; otherwise Lens::make_idle()
  /// does.
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

}  // namespace lightwell::libcam
