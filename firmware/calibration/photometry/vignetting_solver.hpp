// Vignetting from one constant lamp seen at many angles: the camera is turned in front of it.
//   value = level * (1 + v1 theta² + v2 theta⁴ + v3 theta⁶)
#pragma once

#include <array>
#include <span>
#include <vector>

#include <lightwell/result.hpp>

namespace lightwell::photometry {

struct LampObservation {
  double angle_rad = 0;  ///< From the lens's axis.
  double value = 0;      ///< The lamp's light, linear, by exposure and gain; any unit.
  double deviation = 0;  ///< Of `value`; 0: not known, all are taken to be equally sure for their size.
};

struct VignettingEstimate {
  std::array<double, 3> vignetting{};  ///< PhotometricCalibration's.
  std::array<double, 9> covariance{};  ///< Of these, row by row.
  double level = 0, level_deviation = 0;
  double residual = 0;  ///< Typical difference of a sighting from the curve, by the curve.
  int outliers = 0;
  std::vector<double> weight;  ///< Of each sighting, 0: it disagreed.
};

/// Linear least squares in (level, level v1, level v2, level v3), repeated with Tukey's biweight; the level is
/// eliminated by the first-order propagation of its covariance. `max_angle_rad`: half the field of view.
/// invalid_argument, with what to do: fewer than eight sightings, none within a quarter of the field or none in its
/// last tenth (a polynomial says nothing beyond its data), gaps of more than a third of the field, values that are not
/// positive, and a curve that leaves less than 0.05 anywhere in the field.
[[nodiscard]] Result<VignettingEstimate> solve_vignetting(std::span<const LampObservation> observations,
                                                          double max_angle_rad);

/// Standard deviation of the curve at an angle.
[[nodiscard]] double vignetting_deviation(const VignettingEstimate& estimate, double angle_rad);

}  // namespace lightwell::photometry
