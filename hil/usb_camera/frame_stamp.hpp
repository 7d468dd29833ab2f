// Embeds a frame's number in its image, for tests that do not evaluate the light.
#pragma once

#include <cstdint>

#include "usb_camera/frame_source.hpp"

namespace lightwell::usb_camera {

/// A copy of the image that contains the number.
///   yuyv, nv12   the luma of pixel i of the first row, i from 0 to 15, is 16 d + 8, where d is hexadecimal digit i of
///                the number, least significant first
///   mjpeg        a comment (COM) after the start marker holds the number in eight bytes, least significant first; the
///                pixels do not change
[[nodiscard]] Picture stamped(const Picture& picture, Encoding encoding, std::uint64_t number);

}  // namespace lightwell::usb_camera
