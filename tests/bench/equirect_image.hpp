// Input of the peers: non-owning images in the equirectangular mapping of proto/README.md.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace lightwell::bench {

/// A direction (x, y, z) or a colour (r, g, b).
using Triple = std::array<double, 3>;

/// Linear Rec. 709 radiance over the whole sphere, packed rows from the top, three floats per pixel, finite and not
/// negative. Centre -Z, right +X, top +Y (proto/README.md).
struct EquirectImage {
  int width = 0;
  int height = 0;
  std::span<const float> rgb;  ///< 3 * width * height.
};

/// A gamma-encoded 8-bit camera image of the whole sphere, three bytes per pixel, in the same mapping.
struct EquirectFrame {
  int width = 0;
  int height = 0;
  std::span<const std::uint8_t> rgb;  ///< stride * height.
  std::size_t stride = 0;             ///< Bytes from row to row.
};

/// The unit direction of image position (x, y) in pixels; (0.5, 0.5) is the first pixel's centre.
[[nodiscard]] Triple equirect_direction(double x, double y, int width, int height);

/// The exact solid angle in sr of a pixel of row j.
[[nodiscard]] double equirect_solid_angle(int j, int width, int height);

/// CLOCK_MONOTONIC in seconds.
[[nodiscard]] double seconds_now();

}  // namespace lightwell::bench
