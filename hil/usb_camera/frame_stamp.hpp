// A frame's number inside the frame, for tests that do not mind that its light is no longer the scene's.
#pragma once

#include <cstdint>

#include "usb_camera/frame_source.hpp"

namespace lightwell::usb_camera {

/// A copy of the picture with the number in it.
///   yuyv, nv12   the luma of pixel i of the first row, 0 to 15, is 16 d + 8 with d the number's hexadecimal digit i,
///                the least first
///   mjpeg        a comment (COM) right behind the start marker holds the number, eight bytes, the least first: the
///                light stays as it is
[[nodiscard]] Picture stamped(const Picture& picture, Encoding encoding, std::uint64_t number);

}  // namespace lightwell::usb_camera
