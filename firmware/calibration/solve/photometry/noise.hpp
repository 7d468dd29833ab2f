// Black level and read noise from dark frames (lens covered), and the photon transfer method (Janesick 2007, ch. 5):
// variance of the linear value as a function of its mean.
//   variance of x = gain² read_noise² + gain shot_noise x
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "calibration/solve/photometry/picture.hpp"

namespace lightwell::photometry {

struct DarkEstimate {
  double black_level = 0, black_deviation = 0;  ///< As in PhotometricCalibration, and its standard deviation.
  double read_noise = 0, read_deviation = 0;    ///< Likewise, at gain 1.
  /// Part of the noise is censored at the lowest code; read_noise then includes fixed-pattern noise.
  bool clipped = false;
  /// False: (nearly) all pixels have one or two codes; read_noise is 0, read_deviation what quantisation may hide.
  bool resolved = true;
  double outlier_share = 0;  ///< Fraction of hot and dead pixels: more than six standard deviations off.
};

/// Picture value without light: the median, interpolated between codes by their counts; 0 if half of the pixels have
/// code 0. invalid_argument without pictures, or if they are not dark.
[[nodiscard]] Result<double> dark_value_of(std::span<const Picture> pictures);

/// Maximum-likelihood fit of a Gaussian, rounded to codes and censored at the lowest, to the histogram of codes
/// (grouped data: Kulldorff 1961); neither rounding nor a black level of 0 biases it. If neither censoring nor rounding
/// matters, read noise is computed from the differences between pictures instead, which excludes fixed-pattern noise.
/// `gain`: of all pictures. invalid_argument for fewer than two pictures, or if they are not alike, not dark, or equal.
[[nodiscard]] Result<DarkEstimate> solve_dark(std::span<const Picture> pictures, const ResponseCurve& response,
                                              double gain = 1);

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
