// Integrates a bracket of frames over the sphere: SH projection, block sums, detected lights.
#pragma once

#include <vector>

#include <lightwell/descriptor.hpp>

#include "calibration/model/lens_table.hpp"
#include "estimate/common/cells.hpp"
#include "estimate/common/row_reader.hpp"
#include "estimate/panorama/blocks.hpp"
#include "estimate/panorama/bracket_pass.hpp"
#include "estimate/panorama/code_pass.hpp"
#include "estimate/panorama/light_finder.hpp"
#include "estimate/panorama/unseen.hpp"

namespace lightwell::estimate {

/// Result of the integration of one bracket.
struct FrameIntegral {
  Projection projection;
  std::vector<Light> lights;     ///< Strongest first. The projection includes them.
  int required_light = -1;       ///< Index of a light that must be sent because of its peak luminance; -1: none.
  double observed_sr = 0;        ///< Solid angle observed by the lenses of this bracket.
  double chroma_edge_error = 0;  ///< Possible error of the lights' irradiance (luminance) by shared chroma samples.
  bool filled = false;           ///< Unobserved directions were filled.
  /// Sum over the cells without centroid correction: luminance times the angle between centroid and middle, rad.
  double centroid_offset = 0;
};

class SphereIntegrator {
 public:
  SphereIntegrator(const RigParameters& rig, const RigTable& table, int edge);
  SphereIntegrator(const SphereIntegrator&) = delete;
  SphereIntegrator& operator=(const SphereIntegrator&) = delete;

  /// Integrates the bracket and detects the brightest light alone. `reader` must be bound to the bracket.
  void integrate(RowReader& reader, std::span<const Frame> bracket, const EstimatorConfig& config, FrameIntegral& out);
  /// After integrate(): detects the other lights, at most `most` with the brightest.
  void find_lights(RowReader& reader, int most, FrameIntegral& out);

  [[nodiscard]] const BlockLayout& layout() const { return layout_; }
  [[nodiscard]] const CellGrid& grid() const { return grid_; }
  [[nodiscard]] const BlockSums& sums() const { return sums_; }

  /// Directions and solid angles, sr, of all cells, those that no lens sees last. Input of an environment map.
  [[nodiscard]] std::vector<Vec3f> cell_directions() const;
  [[nodiscard]] std::vector<float> cell_solid_angles() const;
  /// After integrate() and find_lights(): sums of all cells minus lights[k] for each k in `without`.
  void residual_cell_sums(std::span<const std::size_t> without, std::vector<CellSum>& out) const;
  /// Mean radiance of each row of blocks of a lens; NaN where a pixel is saturated or the row is outside of the image
  /// circle.
  void row_profile(int lens, std::vector<float>& out) const;

 private:
  /// A position between four pixels: pointer to the upper left direction, offsets of the right and lower neighbours (0
  /// where there is none), and interpolation weights, 0 to 1.
  struct BilinearSample {
    const Vec3f* at;
    int right, down;
    float x, y;
  };

  /// Fills centroid_overrides_ for the blocks whose centroid offset matters most; sums the others to
  /// out.centroid_offset. `luminance`: of all blocks.
  void correct_centroids(double luminance, FrameIntegral& out);
  /// Position of the centroid of a block's light.
  [[nodiscard]] BilinearSample bilinear_sample_of(std::size_t block) const;
  [[nodiscard]] static Vec3d direction_at(const BilinearSample& sample);

  const RigTable& table_;
  BlockLayout layout_;
  CellGrid grid_;
  BlockPass block_pass_;
  CodePass code_pass_;
  BracketPass bracket_pass_;
  BlockSums sums_;
  UnseenLight unseen_;
  Projection unseen_projection_;
  LightFinder finder_;
  double pixel_rad_;
  std::vector<float> offset_luminance_;           ///< By block, luminance times pixels from the middle.
  std::vector<std::uint32_t> offset_blocks_;      ///< Blocks with centroid correction, and one unused element.
  std::vector<BilinearSample> bilinear_samples_;  ///< Of these blocks.
  std::vector<CellGrid::CentroidOverride> centroid_overrides_;
};

}  // namespace lightwell::estimate
