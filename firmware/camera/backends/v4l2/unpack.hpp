// Rows of packed pixels, and how bright a picture is.
//   unpack10(), unpack12(), expand_grey(), mean_level()
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "camera/frame.hpp"

namespace lightwell::v4l2 {

/// MIPI CSI-2 RAW10 (specification 11.4.4; V4L2's 10P): four bytes of the upper eight bits, then one that holds the
/// lower two of each, the first pixel's in its lowest bits. `pixels.size()` is a multiple of 4, and `packed` holds five
/// quarters of it.
void unpack10(std::span<const std::byte> packed, std::span<std::uint16_t> pixels);
/// MIPI CSI-2 RAW12 (11.4.5; V4L2's 12P): two bytes of the upper eight bits, then one that holds the lower four of
/// each, the first pixel's in its lowest bits. `pixels.size()` is a multiple of 2, and `packed` holds three halves of
/// it.
void unpack12(std::span<const std::byte> packed, std::span<std::uint16_t> pixels);
/// Each value three times.
void expand_grey(std::span<const std::byte> grey, std::span<std::byte> rgb);

/// Mean of the values on a grid of at most 64 x 64 pixels, 0 to 1 of full scale: luma, green, or all colours of a
/// mosaic alike. For comparisons between frames of one camera, not for light.
[[nodiscard]] double mean_level(const View& view);

}  // namespace lightwell::v4l2
