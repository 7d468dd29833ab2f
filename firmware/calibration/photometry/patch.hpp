// An even patch of a picture, such as a grey card, in linear values.
#pragma once

#include <array>
#include <string>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "calibration/photometry/picture.hpp"

namespace lightwell::photometry {

/// Pixels of the lens's picture: from (x, y) so many to the right and down.
struct PatchRect {
  int x = 0, y = 0, width = 0, height = 0;
};

struct PatchMean {
  std::array<double, 3> mean{};       ///< Linear value x, black taken off.
  std::array<double, 3> deviation{};  ///< Of these means.
  double count = 0;                   ///< Sites.
};

/// Means without what is more than five deviations off (a speck). invalid_argument naming `name`, with what to do: a
/// patch of fewer than 16 sites or outside the picture, one of which more than a thousandth is saturated, one darker
/// than 0.02 of full scale in some channel, and one that is not even (deviation above a fifth of the mean).
[[nodiscard]] Result<PatchMean> patch_mean(const Picture& picture, const PatchRect& patch,
                                           const PhotometricCalibration& photometry, const std::string& name);

}  // namespace lightwell::photometry
