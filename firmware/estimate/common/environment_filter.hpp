// From the light of a rig's cells to the levels of an environment map.
#pragma once

#include <span>
#include <vector>

#include <lightwell/environment.hpp>

#include "estimate/common/cells.hpp"
#include "estimate/common/environment_lobe.hpp"
#include "estimate/common/sparse_rows.hpp"

namespace lightwell::estimate {

/// The levels of a map with this edge: roughness 0, 0.25 (not for edge 8, whose texels are wider than that lobe), 0.5,
/// 0.75, 1, each with texels narrower than half its lobe as far as `edge` allows. Empty for an edge that is none.
[[nodiscard]] std::vector<EnvironmentLevel> environment_levels(int edge);

/// Weights worked out once from the cells of a rig, then applied to each map's light. One thread at a time.
class EnvironmentFilter {
 public:
  /// `direction` (unit, probe frame) and `solid_angle` (sr) of each cell; what no cell sees is dark (splat_rows()).
  /// edge: 8, 16, 32 or 64. Takes some tenths of a second.
  EnvironmentFilter(std::span<const Vec3f> direction, std::span<const float> solid_angle, int edge);

  [[nodiscard]] std::span<const EnvironmentLevel> levels() const { return levels_; }
  [[nodiscard]] std::size_t cells() const { return light_.size(); }
  /// Weights in use: the cost of run() is about a nanosecond each.
  [[nodiscard]] std::size_t weights() const;

  /// The texels of all levels, in the order of EnvironmentMap::texels, radiance in units of the sums by sr, never
  /// negative and never NaN: of a sum, what is negative, NaN or beyond kMaxCellSum counts as dark. Too few sums leave
  /// the other cells dark. Allocates nothing; lives until the next call.
  [[nodiscard]] std::span<const Rgbx> run(std::span<const CellSum> sums);

  /// No light of this world, and far enough from the end of a float for every product that follows.
  static constexpr float kMaxCellSum = 1e24F;

 private:
  std::vector<EnvironmentLevel> levels_;
  OctahedralGrid base_;  ///< Twice as fine as the map where that is not too fine: lobes are gathered from it.
  MeanPyramid pyramid_;
  SparseRows splat_;
  std::vector<SparseRows> lobes_;  ///< Of the levels after the first.
  std::vector<Rgbx> light_;        ///< Of the cells.
  std::vector<Rgbx> means_;        ///< The pyramid's list.
  std::vector<Rgbx> texels_;
};

}  // namespace lightwell::estimate
