// Motion JPEG as cameras send it: baseline, 4:2:2.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <lightwell/result.hpp>

#include "usb_camera/supported_formats.hpp"

namespace lightwell::usb_camera {

/// `rgb`: r g b bytes a pixel, rows without padding. `quality` 1 to 95 as libjpeg counts it; it is lowered, in steps of
/// 5, until the picture has at most `most` bytes. internal where libjpeg fails.
[[nodiscard]] Result<std::vector<std::byte>> encode_jpeg(std::span<const std::byte> rgb, FrameSize size, int quality,
                                                         std::size_t most);

}  // namespace lightwell::usb_camera
