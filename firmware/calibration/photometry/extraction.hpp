// From pictures to the samples that the response solver wants.
#pragma once

#include <span>

#include <lightwell/result.hpp>

#include "calibration/photometry/picture.hpp"
#include "calibration/photometry/response_solver.hpp"

namespace lightwell::photometry {

struct SampleOptions {
  int pixels = 600;  ///< Series to choose; time grows in proportion.
  int block =
      3;  ///< A series is the mean of so many by so many sites: less noise, and less harm where the camera shook.
  int shades = 20;  ///< As many series of each shade, from the darkest that changes to the brightest.
  [[nodiscard]] Status validate() const;
};

/// Blocks spread over shades first and over the picture second, the most even ones of each, each of one channel.
/// `exposures`: exposure_s * gain, one a picture. Left out: blocks that get darker in a longer exposure (something
/// moved), and a block with a pixel well above saturation counts as saturated. invalid_argument: pictures that differ
/// in size or kind, a number of exposures that is not that of the pictures, pictures too small, fewer than 20 blocks
/// left.
[[nodiscard]] Result<ResponseSamples> choose_samples(std::span<const Picture> pictures,
                                                     std::span<const double> exposures, double dark_value,
                                                     double saturation, const SampleOptions& options = {});

}  // namespace lightwell::photometry
