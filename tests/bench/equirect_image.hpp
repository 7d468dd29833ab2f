// What the peers are fed: pictures that belong to the caller, in the house's equirectangular mapping.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace lightwell::bench {

/// A direction or a colour, in the order x, y, z or r, g, b.
using Triple = std::array<double, 3>;

/// Linear radiance over the whole sphere, Rec. 709, rows packed from the top, r g b a pixel; finite
/// and not negative. Centre -Z, to the right +X, top +Y (proto/README.md).
struct EquirectImage {
  int width = 0;
  int height = 0;
  std::span<const float> rgb;  ///< 3 * width * height.
};

/// An 8-bit picture of the whole sphere as a camera gives it, gamma-encoded, r g b a pixel, in the
/// same mapping.
struct EquirectFrame {
  int width = 0;
  int height = 0;
  std::span<const std::uint8_t> rgb;  ///< stride * height.
  std::size_t stride = 0;             ///< Bytes from row to row.
};

/// The unit direction of image position (x, y) in pixels; (0.5, 0.5) is the first pixel's centre.
[[nodiscard]] Triple equirect_direction(double x, double y, int width, int height);

/// The solid angle in sr of any pixel of row j, exactly.
[[nodiscard]] double equirect_solid_angle(int j, int width, int height);

/// What was measured, in seconds of CLOCK_MONOTONIC.
[[nodiscard]] double seconds_now();

}  // namespace lightwell::bench
