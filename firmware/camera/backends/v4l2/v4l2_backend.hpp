// Camera backend for V4L2 capture devices, such as USB cameras.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>

#include "camera/backend.hpp"
#include "imaging/uri.hpp"

namespace lightwell {

/// v4l2:/dev/video0?width=1280&height=960&frame_rate=30&format=yuyv&...: README.md lists parameters, formats, limits,
/// and what happens when the device is unplugged. One thread runs from start() to stop().
class V4l2Camera : public ThreadedBackend {
 public:
  /// Counters since construction.
  struct Counts {
    std::uint64_t delivered = 0;
    std::uint64_t damaged = 0;         ///< Truncated, undecodable, or flagged as erroneous by the driver.
    std::uint64_t late = 0;            ///< Dropped because a newer frame was available.
    std::uint64_t no_free_buffer = 0;  ///< Dropped because all buffers were lent.
    std::uint64_t wrong_exposure = 0;  ///< In a bracket: the exposure was not the one of the frame's index, or unknown.
    std::uint64_t non_monotonic = 0;   ///< Dropped because its time was not after the previous frame's.
    std::uint64_t disconnects = 0;     ///< Losses of the device.
  };
  /// Thread-safe.
  [[nodiscard]] virtual Counts counts() const = 0;

  struct DmaBuffer {
    int fd = -1;             ///< Owned by the backend: do not close; valid while the frame is held.
    std::size_t offset = 0;  ///< Of the view's first byte.
  };
  /// The DMABUF that contains a view of a held frame; empty if the picture was converted, or the driver cannot export
  /// buffers. Thread-safe.
  [[nodiscard]] virtual std::optional<DmaBuffer> dma_buffer(const View& view) const = 0;

 protected:
  using ThreadedBackend::ThreadedBackend;
};

/// A V4l2Camera. invalid_argument for invalid parameters. open() opens the device.
[[nodiscard]] Result<std::unique_ptr<CameraBackend>> make_v4l2_backend(const CameraUri& uri,
                                                                       const CameraConfig& config);

}  // namespace lightwell
