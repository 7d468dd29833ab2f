// The light of one bracket of frames, integrated over blocks of pixels and over the sphere.
#pragma once

#include <vector>

#include "estimate/common/cells.hpp"
#include "estimate/panorama/blocks.hpp"

namespace lightwell::estimate {

/// Result of SphereIntegrator::integrate(). Sums are radiance (linear value / (exposure_s * gain * vignetting)) times
/// solid angle. The later steps of the estimate are functions of this value; only LightFinder, GreyPatchReader and, of
/// brackets, RowProfiler read pixels again.
struct FrameIntegral {
  BlockSums blocks;             ///< By block of the rig. The blocks of a missing lens are filled, or zero.
  std::vector<CellSum> unseen;  ///< By cell that no lens of the rig sees: filled, or zero.
  Projection projection;        ///< Of blocks and unseen cells, lights included.
  double observed_sr = 0;       ///< Solid angle observed by the lenses of this bracket.
  float mean_luminance = 0;     ///< Of the observed directions.
  bool filled = false;          ///< Unobserved directions were filled.
  /// Sum over the blocks without centroid correction: luminance times the angle between centroid and middle, rad.
  double centroid_offset = 0;

  /// `unseen_cells`: number of elements of `unseen`.
  FrameIntegral(const BlockLayout& layout, std::size_t unseen_cells) : blocks(layout), unseen(unseen_cells) {}
};

}  // namespace lightwell::estimate
