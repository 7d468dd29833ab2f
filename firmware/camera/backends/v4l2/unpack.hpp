// Unpacks rows of packed pixels, and computes the mean level of a picture.
//   unpack10(), unpack12(), expand_grey(), mean_level()
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "imaging/frame.hpp"

namespace lightwell::v4l2 {

/// MIPI CSI-2 RAW10 (specification 11.4.4; V4L2's 10P): four bytes with the upper eight bits, then one with the lower
/// two of each, the first pixel's in its lowest bits. `pixels.size()` is a multiple of 4; `packed` has 5/4 as many
/// bytes.
void unpack10(std::span<const std::byte> packed, std::span<std::uint16_t> pixels);
/// MIPI CSI-2 RAW12 (11.4.5; V4L2's 12P): two bytes with the upper eight bits, then one with the lower four of each,
/// the first pixel's in its lowest bits. `pixels.size()` is a multiple of 2; `packed` has 3/2 as many bytes.
void unpack12(std::span<const std::byte> packed, std::span<std::uint16_t> pixels);
/// Repeats each value three times.
void expand_grey(std::span<const std::byte> grey, std::span<std::byte> rgb);

/// Mean pixel value on a grid of at most 64 x 64 pixels, as a fraction of full scale: luma, green, or all colours of a
/// mosaic alike. For comparisons between frames of one camera, not for photometry.
[[nodiscard]] double mean_level(const View& view);

}  // namespace lightwell::v4l2
