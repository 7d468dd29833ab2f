// Vignetting from pictures of one constant lamp at many angles: the camera is rotated in front of it.
//   value = level * (1 + v1 theta² + v2 theta⁴ + v3 theta⁶)
#pragma once

#include <array>
#include <span>
#include <vector>

#include <lightwell/result.hpp>

namespace lightwell::photometry {

struct LampObservation {
  double angle_rad = 0;  ///< From the lens's axis.
  double value = 0;      ///< The lamp's light, linear, divided by exposure and gain; any unit.
  double deviation = 0;  ///< Standard deviation of `value`; 0: unknown, all relative errors are assumed equal.
};

struct VignettingEstimate {
  std::array<double, 3> vignetting{};  ///< As in PhotometricCalibration.
  std::array<double, 9> covariance{};  ///< Of `vignetting`, row-major.
  double level = 0, level_deviation = 0;
  double residual = 0;  ///< Typical difference of an observation from the curve, relative to the curve.
  int outliers = 0;
  std::vector<double> weight;  ///< By observation; 0: outlier.
};

/// Linear least squares in (level, level v1, level v2, level v3), iterated with the weights of Tukey's biweight; the
/// covariance of v1 to v3 follows by first-order propagation. `max_angle_rad`: half the field of view.
/// invalid_argument, with the remedy: fewer than eight observations, none within a quarter of the field or none in its
/// last tenth (a polynomial cannot be extrapolated), gaps of more than a third of the field, values that are not
/// positive, and a curve below 0.05 anywhere in the field.
[[nodiscard]] Result<VignettingEstimate> solve_vignetting(std::span<const LampObservation> observations,
                                                          double max_angle_rad);

/// Standard deviation of the fitted vignetting curve at an angle.
[[nodiscard]] double vignetting_deviation(const VignettingEstimate& estimate, double angle_rad);

}  // namespace lightwell::photometry
