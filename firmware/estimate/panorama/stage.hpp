// From pixels to what the sphere looks like: pictures through blocks of one size, their lights, their harmonics.
#pragma once

#include <lightwell/descriptor.hpp>
#include <vector>

#include "calibration/lens_table.hpp"
#include "estimate/common/cells.hpp"
#include "estimate/panorama/blocks.hpp"
#include "estimate/panorama/bracket_pass.hpp"
#include "estimate/panorama/code_pass.hpp"
#include "estimate/panorama/light_finder.hpp"
#include "estimate/panorama/row_reader.hpp"
#include "estimate/panorama/unseen.hpp"

namespace lightwell::estimate {

/// What one look at a bracket gave.
struct Seen {
  Projection projection;
  std::vector<Light> lights;  ///< Strongest first.
  int lamp = -1;  ///< Which light is so bright a spot that people look for it, however little it gives; -1: none.
  double seen_sr = 0;    ///< Solid angle that the lenses of this bracket saw.
  double doubt = 0;      ///< Of the lights' irradiance, as luminance, what shared colours may get wrong.
  bool filled = false;   ///< Something stands in for what they did not see.
  double uneven = 0;  ///< Luminance times the angle by which it sits beside its cell's middle, of cells taken as even.
};

class Stage {
 public:
  Stage(const RigParameters& rig, const RigTable& table, int edge);
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

  /// `reader` holds the bracket.
  void look(RowReader& reader, std::span<const Frame> bracket, const EstimatorConfig& config, Seen& out);

  [[nodiscard]] const BlockLayout& layout() const { return layout_; }
  [[nodiscard]] const CellGrid& grid() const { return grid_; }
  [[nodiscard]] const BlockSums& sums() const { return sums_; }

  /// Directions and solid angles of all cells, those that no lens sees last: what an environment map is made of.
  [[nodiscard]] std::vector<Vec3f> cell_directions() const;
  [[nodiscard]] std::vector<float> cell_solid_angles() const;
  /// Their light after look(), without lights[k] of it for each k in `without`.
  void rest_of_cells(std::span<const std::size_t> without, std::vector<CellSum>& out) const;
  /// Mean radiance of the rows of blocks of a lens; NaN where one was saturated or sees nothing. `out` has a row each.
  void row_profile(int lens, std::vector<float>& out) const;

 private:
  void move_uneven(double luminance, Seen& out);
  [[nodiscard]] Vec3d direction_at(const BlockLayout::Place& place, std::size_t block) const;

  const RigTable& table_;
  BlockLayout layout_;
  CellGrid grid_;
  BlockPass pass_;
  CodePass codes_;
  BracketPass brackets_;
  BlockSums sums_;
  UnseenLight unseen_;
  Projection unseen_projection_;
  LightFinder finder_;
  double pixel_rad_;
  std::vector<CellGrid::Moved> moved_;
};

}  // namespace lightwell::estimate
