// Filters the sums of a rig's cells to the levels of a prefiltered environment map.
#pragma once

#include <span>
#include <vector>

#include <lightwell/environment.hpp>

#include "estimate/common/cells.hpp"
#include "estimate/common/environment_grid.hpp"

namespace lightwell::estimate {

/// Levels of a map with this edge: roughness 0, 0.25 (not for edge 8, whose texels are wider than that lobe), 0.5, 0.75
/// and 1, with texels narrower than half the lobe as far as `edge` allows. Empty for an invalid edge.
[[nodiscard]] std::vector<EnvironmentLevel> environment_levels(int edge);

/// A mip pyramid of an octahedral map: means over 2x2, 4x4, ... texels, down to 4x4 texels, all layers in one array.
class MeanPyramid {
 public:
  static constexpr int kMinEdge = 4;
  explicit MeanPyramid(const OctahedralGrid& grid);

  struct Layer {
    int edge;
    std::size_t first;  ///< Index of its first texel in the array.
    SparseRows means;   ///< From the previous layer; empty for the map itself.
    [[nodiscard]] std::size_t texels() const { return static_cast<std::size_t>(edge) * static_cast<std::size_t>(edge); }
  };
  [[nodiscard]] const std::vector<Layer>& layers() const { return layers_; }
  [[nodiscard]] std::size_t size() const { return layers_.back().first + layers_.back().texels(); }
  /// Computes all layers from the map, which is at the start of the array.
  void apply(std::span<Rgbx> list) const;

 private:
  std::vector<Layer> layers_;
};

/// Precomputes weights from the cells of a rig, then applies them to each map. Not thread-safe.
class EnvironmentFilter {
 public:
  /// `direction` (unit, probe frame) and `solid_angle` (sr) of each cell; directions without a cell are dark
  /// (splat_rows()). `edge`: 8, 16, 32 or 64. Takes some tenths of a second.
  EnvironmentFilter(std::span<const Vec3f> direction, std::span<const float> solid_angle, int edge);

  [[nodiscard]] std::span<const EnvironmentLevel> levels() const { return levels_; }

  /// Returns the texels of all levels in the order of EnvironmentMap::texels: radiance in units of the sums per sr,
  /// never negative or NaN. Sums that are negative, NaN, above kMaxCellSum or missing count as 0. Allocates nothing;
  /// the result is valid until the next call.
  [[nodiscard]] std::span<const Rgbx> run(std::span<const CellSum> sums);

  /// Largest valid sum; products with all weights stay in the range of float.
  static constexpr float kMaxCellSum = 1e24F;

 private:
  std::vector<EnvironmentLevel> levels_;
  OctahedralGrid base_;  ///< Grid from which lobes are integrated: twice the map's edge, at most 64.
  MeanPyramid pyramid_;
  SparseRows splat_;
  std::vector<SparseRows> lobes_;  ///< Of the levels after the first.
  std::vector<Rgbx> light_;        ///< Valid sums of the cells.
  std::vector<Rgbx> means_;        ///< All layers of the pyramid.
  std::vector<Rgbx> texels_;
};

}  // namespace lightwell::estimate
