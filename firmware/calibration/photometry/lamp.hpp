// One lamp in a picture: where it is and how much light comes from it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "calibration/photometry/picture.hpp"
#include "calibration/photometry/vignetting_solver.hpp"

namespace lightwell::photometry {

/// Finds the brightest thing in pictures of one lens.
class LampFinder {
 public:
  /// Works out solid angles once. invalid_argument where the lens is impossible.
  [[nodiscard]] static Result<LampFinder> make(const LensParameters& lens);

  /// The lamp's light: linear values (sum of r g b) above the surroundings', times solid angle, by `exposure`
  /// (exposure_s * gain). A constant lamp gives the same at any angle but for vignetting, whatever the projection does
  /// to its size. The angle is `angle_rad`, or that of the lamp's centroid by the lens's geometry. Its deviation
  /// follows from the calibration's noise, where it has one. invalid_argument naming `name`, with what to do: another
  /// size than the lens's, no lamp that stands out, one that is saturated, wider than a tenth of the field, or cut by
  /// the picture's edge or the field's.
  [[nodiscard]] Result<LampObservation> find(const Picture& picture, double exposure, std::optional<double> angle_rad,
                                          const std::string& name) const;

 private:
  LampFinder() = default;
  LensParameters lens_;
  std::vector<float> solid_angle_;  ///< Of a pixel; 0 outside the field.
};

}  // namespace lightwell::photometry
