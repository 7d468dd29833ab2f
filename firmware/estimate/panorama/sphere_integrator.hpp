// From pixels to what the sphere looks like: pictures through blocks of one size, their lights, their harmonics.
#pragma once

#include <vector>

#include <lightwell/descriptor.hpp>

#include "calibration/lens_table.hpp"
#include "estimate/common/cells.hpp"
#include "estimate/common/row_reader.hpp"
#include "estimate/panorama/blocks.hpp"
#include "estimate/panorama/bracket_pass.hpp"
#include "estimate/panorama/code_pass.hpp"
#include "estimate/panorama/light_finder.hpp"
#include "estimate/panorama/unseen.hpp"

namespace lightwell::estimate {

/// What one look at a bracket gave.
struct FrameIntegral {
  Projection projection;
  std::vector<Light> lights;  ///< Strongest first. The projection is of their light too.
  int required_light = -1;        ///< Which light is so bright a spot that people look for it, however little it gives; -1: none.
  double observed_sr = 0;   ///< Solid angle that the lenses of this bracket saw.
  double chroma_edge_error = 0;     ///< Of the lights' irradiance, as luminance, what shared colours may get wrong.
  bool filled = false;  ///< Something stands in for what they did not see.
  double centroid_offset = 0;  ///< Luminance times the angle by which it sits beside its cell's middle, of cells taken as even.
};

class SphereIntegrator {
 public:
  SphereIntegrator(const RigParameters& rig, const RigTable& table, int edge);
  SphereIntegrator(const SphereIntegrator&) = delete;
  SphereIntegrator& operator=(const SphereIntegrator&) = delete;

  /// `reader` holds the bracket. Of the lights, the brightest alone.
  void integrate(RowReader& reader, std::span<const Frame> bracket, const EstimatorConfig& config, FrameIntegral& out);
  /// After look(): the other lights, `most` with the brightest.
  void find_lights(RowReader& reader, int most, FrameIntegral& out);

  [[nodiscard]] const BlockLayout& layout() const { return layout_; }
  [[nodiscard]] const CellGrid& grid() const { return grid_; }
  [[nodiscard]] const BlockSums& sums() const { return sums_; }

  /// Directions and solid angles of all cells, those that no lens sees last: what an environment map is made of.
  [[nodiscard]] std::vector<Vec3f> cell_directions() const;
  [[nodiscard]] std::vector<float> cell_solid_angles() const;
  /// Their light after look(), without lights[k] of it for each k in `without`.
  void residual_cell_sums(std::span<const std::size_t> without, std::vector<CellSum>& out) const;
  /// Mean radiance of the rows of blocks of a lens; NaN where one was saturated or sees nothing. `out` has a row each.
  void row_profile(int lens, std::vector<float>& out) const;

 private:
  /// A place between four pixels: the upper left one's direction, how many entries on those beside and below it are (0
  /// where there is none), and how far it is towards them, 0 to 1.
  struct BilinearSample {
    const Vec3f* at;
    int right, down;
    float x, y;
  };

  void correct_centroids(double luminance, FrameIntegral& out);
  /// Where a block's light sits.
  [[nodiscard]] BilinearSample bilinear_sample_of(std::size_t block) const;
  [[nodiscard]] static Vec3d direction_at(const BilinearSample& corner);

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
  std::vector<float> offset_luminance_;     ///< By block, luminance times pixels from the middle.
  std::vector<std::uint32_t> offset_blocks_;  ///< Blocks whose light does not sit in their middle, and one more.
  std::vector<BilinearSample> bilinear_samples_;        ///< Of these.
  std::vector<CellGrid::CentroidOverride> moved_;
};

}  // namespace lightwell::estimate
