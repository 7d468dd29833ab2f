// JPEG encoder for motion JPEG: baseline, 4:2:2, as USB cameras send it.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <lightwell/result.hpp>

#include "usb_camera/supported_formats.hpp"

namespace lightwell::usb_camera {

/// `rgb`: 3 bytes per pixel, rows without padding. `quality`: libjpeg's, 1 to 95; it is lowered in steps of 5 until the
/// image has at most `max_bytes` bytes. internal: libjpeg fails, or no quality suffices.
[[nodiscard]] Result<std::vector<std::byte>> encode_jpeg(std::span<const std::byte> rgb, FrameSize size, int quality,
                                                         std::size_t max_bytes);

}  // namespace lightwell::usb_camera
