// Extracts the samples for the response solver from pictures.
#pragma once

#include <span>

#include <lightwell/result.hpp>

#include "calibration/solve/photometry/picture.hpp"
#include "calibration/solve/photometry/response_solver.hpp"

namespace lightwell::photometry {

struct SampleOptions {
  int pixels = 600;  ///< Number of series; time is proportional to it.
  /// Side of the block of sites that a series averages: reduces noise and the effect of camera shake.
  int block = 3;
  int shades = 20;  ///< Number of brightness classes; each contributes the same number of series.
  [[nodiscard]] Status validate() const;
};

/// Chooses blocks spread first over brightness classes, then over the picture, preferring uniform ones; each gives a
/// series of one channel. `exposures`: exposure_s * gain, one per picture. Blocks that become darker in a longer
/// exposure (motion) are rejected; a block with a pixel well above saturation counts as saturated. invalid_argument:
/// pictures that differ in size or kind, a wrong number of exposures, pictures that are too small, fewer than 20 blocks
/// left.
[[nodiscard]] Result<ResponseSamples> choose_samples(std::span<const Picture> pictures,
                                                     std::span<const double> exposures, double dark_value,
                                                     double saturation, const SampleOptions& options = {});

}  // namespace lightwell::photometry
