// A camera that the kernel drives: USB cameras and whatever else is a V4L2 capture device.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>

#include "camera/backend.hpp"
#include "camera/uri.hpp"

namespace lightwell {

/// v4l2:/dev/video0?width=1280&height=960&fps=30&format=yuyv&...: parameters, formats and limits are in README.md.
///
/// One thread, from start() to stop(). A device that is unplugged, fails, or sends nothing for two seconds and ten
/// frames is lost: the thread looks for its node every 250 ms and streams again once it is back, with the format it
/// had. What was lost meanwhile is a gap in the sequence. Frames of a device that is gone stay valid.
class V4l2Camera : public CameraBackend {
 public:
  /// Since it was made. From any thread.
  struct Counts {
    std::uint64_t delivered = 0;
    std::uint64_t damaged = 0;    ///< Cut off, undecodable, or marked so by the driver.
    std::uint64_t late = 0;       ///< A newer one waited behind it.
    std::uint64_t no_free_buffer = 0;    ///< All frames were lent.
    std::uint64_t wrong_exposure = 0;  ///< Of a bracket: exposed otherwise than its place says, or not known how.
    std::uint64_t non_monotonic = 0;   ///< Its time was not after that of the frame before.
    std::uint64_t disconnects = 0;     ///< Of the device.
  };
  [[nodiscard]] virtual Counts counts() const = 0;

  struct DmaBuffer {
    int fd = -1;             ///< The backend's own: for as long as the frame is held, not to be closed.
    std::size_t offset = 0;  ///< Of the view's first byte.
  };
  /// The DMABUF behind a view of a frame that is held; nothing where the picture was converted, or the driver exports
  /// none. From any thread.
  [[nodiscard]] virtual std::optional<DmaBuffer> dma_buffer(const View& view) const = 0;
};

/// invalid_argument for parameters that make no sense; the device is opened by open().
[[nodiscard]] Result<std::unique_ptr<V4l2Camera>> make_v4l2_camera(const CameraUri& uri, const CameraConfig& config);
/// The same as the table of backends wants it.
[[nodiscard]] Result<std::unique_ptr<CameraBackend>> make_v4l2_backend(const CameraUri& uri,
                                                                       const CameraConfig& config);

}  // namespace lightwell
