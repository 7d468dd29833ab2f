// Mean linear values of a uniform patch of a picture, such as a grey card.
#pragma once

#include <array>
#include <string>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "calibration/solve/photometry/picture.hpp"

namespace lightwell::photometry {

/// Rectangle in pixels of the lens's picture; (x, y) is the top left pixel.
struct PatchRect {
  int x = 0, y = 0, width = 0, height = 0;
};

struct PatchMean {
  std::array<double, 3> mean{};       ///< Linear value x, black level subtracted.
  std::array<double, 3> deviation{};  ///< Standard deviation of the means.
  double count = 0;                   ///< Number of sites.
};

/// Means without sites more than five standard deviations off (specks). invalid_argument, with `name` and remedy: a
/// patch of fewer than 16 sites or outside the picture, more than 0.1 % saturated, darker than 0.02 of full scale in a
/// channel, or not uniform (standard deviation above a fifth of the mean).
[[nodiscard]] Result<PatchMean> patch_mean(const Picture& picture, const PatchRect& patch,
                                           const PhotometricCalibration& photometry, const std::string& name);

}  // namespace lightwell::photometry
