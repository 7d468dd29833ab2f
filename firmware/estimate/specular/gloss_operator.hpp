// Reflection of an environment by a glossy plane, as a linear operator between hemispheres, and its transpose.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/hemisphere_grid.hpp>
#include <lightwell/specular_brdf.hpp>

#include "estimate/specular/work_budget.hpp"

namespace lightwell::specular {

/// S(v) = sum over cells l of f(v, l) n·l L(l) dω. Cells and viewing directions are the nodes of the same hemisphere,
/// in the plane's frame. Near the mirror direction every cell has a coefficient of its own; elsewhere the cells of a
/// coarse hemisphere share one, because the tails of GGX are long and smooth.
///
/// The grid and the BRDF are unchanged by quarter turns about the normal. Coefficients are therefore kept for the
/// viewing directions of one quarter, and each is used for four turns and three channels. Not thread-safe.
class GlossOperator {
 public:
  /// `levels` of both hemispheres; levels_for() are enough. Takes up to a tenth of a second.
  GlossOperator(const SpecularBrdf& brdf, int levels);
  /// The same without coefficients, which build() computes; before that it reflects nothing.
  struct Unbuilt {};
  GlossOperator(const SpecularBrdf& brdf, int levels, Unbuilt);

  /// Computes further rows; may exceed the budget by one of them. Returns whether all are complete.
  bool build(WorkBudget& budget);

  /// Levels at which the lobe's half width at half maximum, 2 atan(0.64 alpha), has about two nodes; 30 to 60. At
  /// grazing angles the lobe is narrower in azimuth than a cell; coefficients near it are means over the cell's
  /// azimuths.
  [[nodiscard]] static int levels_for(double alpha);

  [[nodiscard]] const HemisphereGrid& grid() const { return grid_; }
  [[nodiscard]] const SpecularBrdf& brdf() const { return brdf_; }
  /// Of a cell, sr.
  [[nodiscard]] float solid_angle(std::size_t cell) const { return solid_angle_[cell]; }
  /// By viewing direction: the reflection of an environment of radiance 1.
  [[nodiscard]] std::span<const float> albedo() const { return albedo_; }

  /// Operations of reflect(), and of transpose().
  [[nodiscard]] std::size_t work() const { return far_.size() + near_.size(); }
  /// out[v] = reflected radiance. Both have grid().size() elements.
  void reflect(std::span<const Radiance> radiance, std::span<Radiance> out);
  /// out[l] = sum over v of the coefficient times weight[v].
  void transpose(std::span<const Radiance> weight, std::span<Radiance> out);

 private:
  static constexpr std::size_t kValues = 12;
  /// Rows that are multiplied together: values of the coarse cells are loaded once for all of them.
  static constexpr std::size_t kRows = 2;
  /// A channel's values at the four turns of a node, and the other channels'.
  struct alignas(16) Turns {
    std::array<float, kValues> v{};  ///< Index: 4 channel + turn.
  };
  /// Successive cells near the mirror direction.
  struct Run {
    std::uint32_t cell, cells;
  };
  /// Appends the coefficients of a viewing direction of the quarter. Returns the number of evaluations of the BRDF.
  std::size_t add_row(std::uint32_t v);
  /// Completes the last block and computes the albedo.
  void finish();
  /// The node that a quarter turn, `turn` times, makes of a node.
  [[nodiscard]] std::size_t turned(std::size_t node, std::size_t turn) const { return turned_[4 * node + turn]; }

  SpecularBrdf brdf_;
  HemisphereGrid grid_, coarse_;
  std::vector<Vec3f> direction_, coarse_direction_;
  std::vector<float> solid_angle_, albedo_;
  std::vector<std::uint32_t> turned_;   ///< Four nodes for each node.
  std::vector<std::uint32_t> quarter_;  ///< Viewing directions with coefficients.
  std::vector<std::uint32_t> parent_;   ///< By cell: coarse cell.
  /// A row for each viewing direction of the quarter, a column for each coarse cell; whole blocks of kRows rows.
  std::vector<float> far_;
  std::vector<float> near_;  ///< By cell of the runs: exact minus that of the coarse cell.
  std::vector<Run> runs_;
  std::vector<std::size_t> runs_end_;  ///< By viewing direction of the quarter.
  std::vector<Turns> fine_turns_, coarse_turns_;
};

}  // namespace lightwell::specular
