// Black level and read noise from pictures that were taken with the lens covered.
#pragma once

#include <span>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "calibration/photometry/picture.hpp"

namespace lightwell::photometry {

struct DarkEstimate {
  double black_level = 0, black_deviation = 0;  ///< PhotometricCalibration's, and its standard deviation.
  double read_noise = 0, read_deviation = 0;    ///< The same, at gain 1.
  /// Part of the noise lies below the lowest code: it was completed as a Gaussian, and holds the fixed pattern, too.
  bool clipped = false;
  /// false: (nearly) all pixels show one code. read_noise is then 0 and read_deviation what may hide in a code.
  bool resolved = true;
  double outlier_share = 0;  ///< Hot and dead pixels, more than six deviations away.
};

/// The picture value of no light: the median, between codes by their counts; 0 where half of the pixels show code 0.
/// invalid_argument where there is no picture or it is not dark.
[[nodiscard]] Result<double> dark_value_of(std::span<const Picture> pictures);

/// Mean and deviation of a Gaussian that was rounded to codes and cut at the lowest, by maximum likelihood of the
/// codes' counts (grouped data: Kulldorff 1961), which neither rounding nor a black level of 0 biases. Where nothing is
/// cut and rounding hides nothing, read noise is that of differences between pictures: without the fixed pattern.
/// `gain`: of all pictures. invalid_argument for fewer than two pictures, unequal ones, ones that are not dark, and
/// two that are the same file.
[[nodiscard]] Result<DarkEstimate> solve_dark(std::span<const Picture> pictures, const ResponseCurve& response,
                                              double gain = 1);

/// Variance of half the difference-of-two of equal pictures: mean square about their mean, by two, without what is more
/// than five deviations off. `count` becomes what was counted. `least`: deviation below which none is believed.
[[nodiscard]] double difference_variance(std::span<const double> differences, double least, double& count);

}  // namespace lightwell::photometry
