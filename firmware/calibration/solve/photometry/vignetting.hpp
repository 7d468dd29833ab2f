// Vignetting from pictures of one constant lamp at many angles: the camera is rotated in front of it.
//   value = level * (1 + v1 theta² + v2 theta⁴ + v3 theta⁶)
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "calibration/solve/photometry/picture.hpp"

namespace lightwell::photometry {

struct LampObservation {
  double angle_rad = 0;  ///< From the lens's axis.
  double value = 0;      ///< The lamp's light, linear, divided by exposure and gain; any unit.
  double deviation = 0;  ///< Standard deviation of `value`; 0: unknown, all relative errors are assumed equal.
};

/// Finds the brightest object in pictures of one lens.
class LampFinder {
 public:
  /// Computes the solid angles of the pixels. invalid_argument if the lens is invalid.
  [[nodiscard]] static Result<LampFinder> make(const LensParameters& lens);

  /// The lamp's light: sum over pixels of the linear value (r + g + b) above the surroundings, times solid angle,
  /// divided by `exposure` (exposure_s * gain). For a constant lamp it depends on the angle only by vignetting, not by
  /// the projection. The angle is `angle_rad`, or that of the lamp's centroid. The standard deviation follows from the
  /// calibrated noise, if there is any. invalid_argument, with `name` and remedy: a picture of another size than the
  /// lens's; no lamp above the background; a lamp that is saturated, wider than a tenth of the field, or cut by the
  /// edge of the picture or the field.
  [[nodiscard]] Result<LampObservation> find(const Picture& picture, double exposure, std::optional<double> angle_rad,
                                             const std::string& name) const;

 private:
  LampFinder() = default;
  LensParameters lens_;
  std::vector<float> solid_angle_;  ///< sr, by pixel; 0 outside the field of view.
};

struct VignettingEstimate {
  std::array<double, 3> vignetting{};  ///< As in PhotometricCalibration.
  std::array<double, 9> covariance{};  ///< Of `vignetting`, row-major.
  double level = 0;
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
