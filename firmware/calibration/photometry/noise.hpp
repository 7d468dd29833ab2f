// Photon transfer (Janesick 2007, ch. 5): how the variance of the linear value grows with its mean.
//   variance of x = gain² read_noise² + gain shot_noise x
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "calibration/photometry/dark.hpp"
#include "calibration/photometry/picture.hpp"

namespace lightwell::photometry {

/// Two pictures of the same evenly lit thing, taken one after the other with the same exposure.
struct FlatPair {
  Picture a, b;
  double gain = 1;
};

/// Pixels of one pair that have about the same mean.
struct NoiseLevel {
  double mean = 0;      ///< Linear value x, black taken off.
  double variance = 0;  ///< Of x, rounding taken off.
  double rounding = 0;  ///< What was taken off.
  double count = 0;     ///< Differences it was made of.
  double gain = 1;
};

/// Pixels by their mean: a picture darkened by its lens gives several levels. Differences alone count, so a fixed
/// pattern does not; a change of all light between the two does not either. Left out: levels of which more than a
/// thousandth is saturated or at the lowest code, and those where rounding hides the noise (less than 0.3 of a code).
/// invalid_argument for pictures that differ in size, two that are the same file, and where nothing is left.
[[nodiscard]] Result<std::vector<NoiseLevel>> noise_levels(std::span<const FlatPair> pairs,
                                                           const PhotometricCalibration& photometry);

struct NoiseEstimate {
  double read_noise = 0, shot_noise = 0;  ///< PhotometricCalibration's.
  double read_deviation = 0, shot_deviation = 0;
  std::array<double, 4> covariance{};  ///< Of read_noise² and shot_noise, row by row.
  double scatter = 1;                  ///< Of the levels about the line, in deviations that their counts let expect: 1.
};

/// A line through the levels by weighted least squares, levels that disagree without weight (Tukey's biweight); `dark`,
/// where given and resolved, is one more level. invalid_argument for fewer than three levels, levels that span less
/// than a factor of three, and a variance that does not grow with light (noise reduction, JPEG).
[[nodiscard]] Result<NoiseEstimate> solve_noise(std::span<const NoiseLevel> levels,
                                                const std::optional<DarkEstimate>& dark = std::nullopt);

}  // namespace lightwell::photometry
