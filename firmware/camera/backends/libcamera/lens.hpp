// A lens as the backend sees it: buffers that are handed to a camera with an exposure and come back with a picture.
// Real ones are LensStreams; what becomes of their frames is decided on this face alone.
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

/// How a picture lies in a buffer.
struct PictureLayout {
  PixelFormat format = PixelFormat::nv12;
  int width = 0, height = 0;
  std::size_t stride = 0;
};

/// What a buffer that has come back says of its picture.
struct Picture {
  bool good = false;  ///< Exposed, read out and whole; the rest is of no meaning otherwise.
  std::int64_t timestamp_ns = 0;
  std::uint64_t sequence = 0;
  std::optional<double> exposure_s;  ///< In force, where the camera says.
  std::optional<double> gain;
};

/// The buffers' memory. It outlives its lens and its camera for as long as somebody holds it.
class PictureMemory {
 public:
  virtual ~PictureMemory() = default;
  [[nodiscard]] virtual std::span<const std::byte> picture(int buffer) const = 0;
  /// Reading has begun with Lens::collect() and ends with Lens::make_idle(), or here where the lens has other buffers
  /// by then.
  virtual void end_reading(int buffer) const = 0;
};

/// Life: acquire -> (start -> stop)* -> release, and acquire again where the camera went away in between. From one
/// thread at a time; completions and news of cameras reach the backend's mailbox from others.
class Lens {
 public:
  virtual ~Lens() = default;

  /// Takes the camera, settles format, size and controls, and maps `lendable` buffers and those that stay in the
  /// camera's hands. After the first time, format and size must come out as they were. unavailable while it is away.
  [[nodiscard]] virtual Status acquire(const LibcameraOptions& options, int lendable) = 0;
  virtual void release() = 0;
  [[nodiscard]] virtual bool acquired() const = 0;
  /// Acquired, and the camera has not gone since.
  [[nodiscard]] virtual bool present() const = 0;

  [[nodiscard]] virtual Status start() = 0;
  /// No completion comes afterwards.
  virtual void stop() = 0;

  // After the first acquire()
  [[nodiscard]] virtual const std::string& id() const = 0;
  [[nodiscard]] virtual const std::string& model() const = 0;
  [[nodiscard]] virtual const PictureLayout& layout() const = 0;
  [[nodiscard]] virtual const SelectedControls& controls() const = 0;
  [[nodiscard]] virtual const std::vector<std::string>& notes() const = 0;
  [[nodiscard]] virtual std::shared_ptr<const PictureMemory> memory() const = 0;
  [[nodiscard]] virtual int buffers() const = 0;
  /// Goes up with each acquire().
  [[nodiscard]] virtual int session() const = 0;

  // While started
  /// Whether the camera has as many buffers as it takes, or none is idle.
  [[nodiscard]] virtual bool full() const = 0;
  /// Hands the camera an idle buffer, to be exposed for so long from then on. False where it does not take it.
  [[nodiscard]] virtual bool queue(std::int32_t exposure_us) = 0;
  /// The buffer has come back; it is neither queued nor idle.
  [[nodiscard]] virtual Picture collect(int buffer) = 0;
  /// Nobody looks at it any more.
  virtual void make_idle(int buffer) = 0;
};

}  // namespace lightwell::libcam
