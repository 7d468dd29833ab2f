// Measures direction and light of one lamp in a picture.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "calibration/solve/photometry/picture.hpp"
#include "calibration/solve/photometry/vignetting_solver.hpp"

namespace lightwell::photometry {

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

}  // namespace lightwell::photometry
