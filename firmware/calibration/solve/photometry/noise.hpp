// Photon transfer method (Janesick 2007, ch. 5): variance of the linear value as a function of its mean.
//   variance of x = gain² read_noise² + gain shot_noise x
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "calibration/solve/photometry/dark.hpp"
#include "calibration/solve/photometry/picture.hpp"

namespace lightwell::photometry {

/// Two successive pictures of the same evenly lit surface with the same exposure.
struct FlatPair {
  Picture a, b;
  double gain = 1;
};

/// Statistics of the pixels of one pair that have about the same mean.
struct NoiseLevel {
  double mean = 0;      ///< Linear value x, black level subtracted.
  double variance = 0;  ///< Of x, rounding noise subtracted.
  double rounding = 0;  ///< Variance of rounding that was subtracted.
  double count = 0;     ///< Number of differences.
  double gain = 1;
};

/// Groups the pixels by their mean; a picture with vignetting gives several levels. Only differences are used, which
/// cancels fixed-pattern noise and a change of the overall light. Rejected: levels with more than 0.1 % of pixels
/// saturated or at the lowest code, and those whose noise is concealed by rounding (less than 0.3 codes).
/// invalid_argument for pictures that differ in size or are identical, and if no level is left.
[[nodiscard]] Result<std::vector<NoiseLevel>> noise_levels(std::span<const FlatPair> pairs,
                                                           const PhotometricCalibration& photometry);

struct NoiseEstimate {
  double read_noise = 0, shot_noise = 0;          ///< As in PhotometricCalibration.
  double read_deviation = 0, shot_deviation = 0;  ///< Standard deviations.
  std::array<double, 4> covariance{};             ///< Of read_noise² and shot_noise, row-major.
  double scatter = 1;  ///< Scatter of the levels about the line relative to the expected one.
};

/// Fits a line to the levels by weighted least squares with Tukey's biweight against outliers; `dark`, if given and
/// resolved, is one more level. invalid_argument for fewer than three levels, levels that span less than a factor of
/// three, and a variance that does not increase with light (noise reduction, JPEG).
[[nodiscard]] Result<NoiseEstimate> solve_noise(std::span<const NoiseLevel> levels,
                                                const std::optional<DarkEstimate>& dark = std::nullopt);

}  // namespace lightwell::photometry
