// Interface through which the stream gets its images; scene_source.hpp implements it.
//   Picture, stamped(), FrameSource
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <lightwell/result.hpp>

#include "usb_camera/controls.hpp"
#include "usb_camera/supported_formats.hpp"

namespace lightwell::usb_camera {

/// The immutable bytes of one frame.
using Picture = std::shared_ptr<const std::vector<std::byte>>;

/// A copy of the image that contains the frame's number, for tests that do not evaluate the light.
///   yuyv, nv12   the luma of pixel i of the first row, i from 0 to 15, is 16 d + 8, where d is hexadecimal digit i of
///                the number, least significant first
///   mjpeg        a comment (COM) after the start marker holds the number in eight bytes, least significant first; the
///                pixels do not change
[[nodiscard]] inline Picture stamped(const Picture& picture, Encoding encoding, std::uint64_t number) {
  auto out = std::make_shared<std::vector<std::byte>>(*picture);
  if (encoding == Encoding::mjpeg) {
    // After the two bytes of the start marker, the comment: marker, length including itself, number.
    std::array<std::byte, 12> comment = {std::byte{0xFF}, std::byte{0xFE}, std::byte{0}, std::byte{10}};
    for (std::size_t i = 0; i < 8; ++i) comment[4 + i] = static_cast<std::byte>(number >> (8 * i));
    if (out->size() >= 2) out->insert(out->begin() + 2, comment.begin(), comment.end());
    return out;
  }
  const std::size_t step = encoding == Encoding::yuyv ? 2 : 1;
  for (std::size_t i = 0; i < 16 && i * step < out->size(); ++i)
    (*out)[i * step] = static_cast<std::byte>(16 * (number >> (4 * i) & 0xF) + 8);
  return out;
}

class FrameSource {
 public:
  virtual ~FrameSource() = default;

  /// Sets the format of the images from now on.
  [[nodiscard]] virtual Status configure(const StreamFormat& format) = 0;
  /// Automatic exposure time at gain 1 in seconds. Does not need configure().
  [[nodiscard]] virtual double automatic_exposure_s() const = 0;
  /// From the end of the first row's exposure to the end of the last row's, in the format configured.
  [[nodiscard]] virtual double readout_s() const = 0;
  /// The image of a frame, or nullptr while it is not ready; it is then queued for rendering before all others.
  [[nodiscard]] virtual Picture picture(std::uint64_t number, const SensorSettings& settings) = 0;
  /// Queues an image that will be needed soon.
  virtual void order(std::uint64_t number, const SensorSettings& settings) = 0;
};

}  // namespace lightwell::usb_camera
