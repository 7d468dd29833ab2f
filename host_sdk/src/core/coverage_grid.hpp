// Exact area coverage of grid cells by projected outlines.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <lightwell/geometry.hpp>

#include "core/occluder.hpp"

namespace lightwell::core {

/// A position in cells.
struct Cell {
  float x = 0, y = 0;
};

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
  /// The count of triangles that face the light; for meshes that are not closed, also that of the others minus it.
  static constexpr std::size_t kLayers = 2;
  using Layer = std::vector<float>;

  /// Of rows or columns; empty at first.
  struct Range {
    int first = std::numeric_limits<int>::max(), last = -1;

    void include(Range other) {
      first = std::min(first, other.first);
      last = std::max(last, other.last);
    }
  };

  [[nodiscard]] std::size_t stride() const { return static_cast<std::size_t>(columns_); }
  /// An edge of any position; `sign` times. None if it is not finite.
  void add_edge(Layer& layer, Cell from, Cell to, float sign);
  /// An edge that is not within the grid; from.x < to.x.
  void clip_edge(Layer& layer, Vec3d from, Vec3d to, float sign);
  /// The same within the grid, from.x <= to.x.
  void add_inside(Layer& layer, float x0, float y0, float x1, float y1, float sign);
  void resolve(std::size_t layers, std::span<const float> weights);

  int columns_ = 0, rows_ = 0;
  float scale_ = 1;
  std::array<Layer, kLayers> layers_;  ///< rows + 2 each: below the last row is what lies there of the edges.
  std::vector<float> running_, covered_;
  std::vector<std::vector<float>> planes_;
  Range rows_touched_;                                 ///< That the layers' contents are in.
  std::vector<Range> row_columns_;                     ///< The columns of each row that they are in.
  bool cut_off_left_ = false, cut_off_right_ = false;  ///< An edge crosses that side of the grid.
};

}  // namespace lightwell::core
