// The texels of a textured plane: a square grid in the plane's frame.
//
// Plane frame: right-handed, m; origin in the middle of the square, z = 0 is the surface, +Z its normal towards the
// viewer, +X to the right and +Y to the top of the texture. Row 0 of the texture is the top one.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>

namespace lightwell::specular {

/// Texels are processed in tiles of kTileEdge x kTileEdge.
inline constexpr int kTileEdge = 4;
inline constexpr int kTileTexels = kTileEdge * kTileEdge;

struct PlaneTexels {
  double size_m = 0.2;  ///< Side of the square, above 0.
  int edge = 256;       ///< Texels along a side: a multiple of kTileEdge, 8 to 256.

  [[nodiscard]] std::size_t count() const { return static_cast<std::size_t>(edge) * static_cast<std::size_t>(edge); }
  [[nodiscard]] int tiles() const { return edge / kTileEdge; }  ///< Along a side.
  [[nodiscard]] double texel_m() const { return size_m / edge; }

  /// Index of texel k (row by row) of a tile (row by row).
  [[nodiscard]] std::size_t texel_of(int tile, int k) const {
    const int column = tile % tiles() * kTileEdge + k % kTileEdge, row = tile / tiles() * kTileEdge + k / kTileEdge;
    return static_cast<std::size_t>(row * edge + column);
  }
  /// The centre of a texel.
  [[nodiscard]] Vec3d center(std::size_t texel) const {
    return point(static_cast<double>(texel % static_cast<std::size_t>(edge)) + 0.5,
                 static_cast<double>(texel / static_cast<std::size_t>(edge)) + 0.5);
  }

  /// The centre of a tile (row by row).
  [[nodiscard]] Vec3d tile_center(int tile) const {
    return point((tile % tiles() + 0.5) * kTileEdge, (tile / tiles() + 0.5) * kTileEdge);
  }

  /// Of the position `column`, `row` in texels: whole numbers are the texels' corners, halves their centres.
  [[nodiscard]] Vec3d point(double column, double row) const {
    return {(column / edge - 0.5) * size_m, (0.5 - row / edge) * size_m, 0};
  }
};

/// Radiance of one texel by channel, and what is known of it.
struct alignas(16) TexelRadiance {
  float r = 0, g = 0, b = 0;
  /// kUnseen; 0: measured; above 0: a pixel that contributes to it is saturated, the radiance is a lower bound.
  float clipped = kUnseen;

  static constexpr float kUnseen = -1;
  [[nodiscard]] bool seen() const { return clipped >= 0; }
  [[nodiscard]] bool measured() const { return clipped == 0; }
  [[nodiscard]] Radiance radiance() const { return {r, g, b}; }
  [[nodiscard]] float luminance() const { return luminance_of(r, g, b); }
};

/// Row by row from the top, PlaneTexels::count() elements.
using TexelImage = std::vector<TexelRadiance>;

/// A value minus the mean of its four neighbours, of an image of that width; `at` is not at its border.
[[nodiscard]] inline float detail_at(const std::vector<float>& image, std::size_t width, std::size_t at) {
  return image[at] - 0.25F * (image[at - 1] + image[at + 1] + image[at - width] + image[at + width]);
}

}  // namespace lightwell::specular
