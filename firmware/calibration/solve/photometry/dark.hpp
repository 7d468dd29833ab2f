// Black level and read noise from dark frames (lens covered).
#pragma once

#include <span>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "calibration/solve/photometry/picture.hpp"

namespace lightwell::photometry {

struct DarkEstimate {
  double black_level = 0, black_deviation = 0;  ///< As in PhotometricCalibration, and its standard deviation.
  double read_noise = 0, read_deviation = 0;    ///< Likewise, at gain 1.
  /// Part of the noise is censored at the lowest code: read_noise is of a censored Gaussian fit and includes
  /// fixed-pattern noise.
  bool clipped = false;
  /// False: (nearly) all pixels have one or two codes. Then read_noise is 0, and read_deviation is the noise that
  /// quantisation may conceal.
  bool resolved = true;
  double outlier_share = 0;  ///< Fraction of hot and dead pixels: more than six standard deviations off.
};

/// Picture value without light: the median, interpolated between codes by their counts; 0 if half of the pixels have
/// code 0. invalid_argument without pictures, or if they are not dark.
[[nodiscard]] Result<double> dark_value_of(std::span<const Picture> pictures);

/// Maximum-likelihood fit of a Gaussian, rounded to codes and censored at the lowest, to the histogram of codes
/// (grouped data: Kulldorff 1961); neither rounding nor a black level of 0 biases it. If neither censoring nor rounding
/// matters, read noise is computed from the differences between pictures instead, which excludes fixed-pattern noise.
/// `gain`: of all pictures. invalid_argument for fewer than two pictures, pictures that differ in kind, are not dark,
/// or are identical.
[[nodiscard]] Result<DarkEstimate> solve_dark(std::span<const Picture> pictures, const ResponseCurve& response,
                                              double gain = 1);

/// Noise variance of one picture from the differences of two pictures of the same scene: half the mean square about the
/// mean, without differences more than five standard deviations off. `count` is set to the number of differences used.
/// `least`: lower limit of the standard deviation for that rejection.
[[nodiscard]] double difference_variance(std::span<const double> differences, double least, double& count);

}  // namespace lightwell::photometry
