// Exact area coverage of grid cells by projected outlines.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/geometry.hpp>

#include "core/occluder.hpp"

namespace lightwell::core {

/// Adds up, over many points of light, the covered share of each cell of a grid. The outlines of one point go into an
/// accumulation buffer: each edge adds its signed area to the cells that it crosses, and the sum along a column is the
/// number of triangles above each cell, with fractions at the outline (the method of FreeType's and Levien's font
/// rasterisers, here with columns for rows so that the sums vectorise).
class CoverageGrid {
 public:
  /// `scale`: cells per texel. All coverage becomes zero. Allocates only if the grid is larger than any before.
  void reset(int columns, int rows, float scale, std::size_t planes);
  /// All coverage becomes zero.
  void clear();

  /// Adds weights[p] times the coverage of each cell to plane p: by what `occluder` hides of `point`, which is bit
  /// `bit` of the silhouettes. `weights`: one for each plane.
  void add(const Occluder& occluder, std::span<const SilhouetteEdge> silhouettes, LightPoint point, unsigned bit,
           std::span<const float> weights);

  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] std::span<const float> row(std::size_t plane, int row) const {
    return std::span(planes_[plane]).subspan(static_cast<std::size_t>(row) * stride(), stride());
  }

 private:
  /// Counts of triangles that face the light, and of the others: the second only for meshes that are not closed.
  static constexpr std::size_t kLayers = 2;
  using Layer = std::vector<float>;

  [[nodiscard]] std::size_t stride() const { return static_cast<std::size_t>(columns_); }
  /// An edge in cells, of any position; `sign` times.
  void add_edge(Layer& layer, Vec3d from, Vec3d to, float sign);
  /// The same within the grid, from.x <= to.x.
  void add_inside(Layer& layer, float x0, float y0, float x1, float y1, float sign);
  void add_in_column(Layer& layer, int column, float width, float low, float high, float sign);
  void resolve(std::size_t layers, std::span<const float> weights);

  int columns_ = 0, rows_ = 0;
  float scale_ = 1;
  std::array<Layer, kLayers> layers_;  ///< rows + 2 each: below the last row is what lies there of the edges.
  std::vector<float> running_, covered_;
  std::vector<std::vector<float>> planes_;
  int first_row_ = 0, last_row_ = 0, first_column_ = 0, last_column_ = 0;  ///< Bounds of what the layers hold.
};

}  // namespace lightwell::core
