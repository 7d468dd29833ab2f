// The rig of a capture, from a marker that stands beside the object in every photograph.
#pragma once

#include <optional>
#include <vector>

#include <lightwell/descriptor.hpp>
#include <lightwell/image_object.hpp>
#include <lightwell/result.hpp>

namespace lightwell::tool {

/// What `lightwell-estimate --body` made of the photographs: estimates[view][light], nullopt where the marker was not
/// found. Frame: the camera's, -Z forward. The camera does not move; the marker turns with the object; a light stays
/// where it is for all views.
using MarkerEstimates = std::vector<std::vector<std::optional<Descriptor>>>;

struct MarkerRig {
  /// Without columns and rows. A light is where the directions from the marker in all views meet; one whose distance
  /// they do not show is 100 m away. The reference irradiance is the mean luminance of the lights.
  ObjectRig rig;
  double tilt_rad = 0;              ///< Angle by which the camera looks off the plane across the axis of the turntable.
  double axis_error_rad = 0;        ///< Largest rotation of the marker that is not about the axis.
  double light_spread_rad = 0;      ///< Largest angle between a light's direction in one view and its place.
  double brightest_by_darkest = 1;  ///< Ratio of the lights' irradiances.
};

/// The axis is that of the marker's rotations, the origin the point of it that is nearest to the camera's optical axis.
/// `half_field_tan` is the tangent of half of the horizontal field of view. failed_precondition, saying what is wrong
/// in the capture: fewer than two turns, a marker that was moved, a light that was moved or that no view shows, an axis
/// along the view.
[[nodiscard]] Result<MarkerRig> rig_of(const MarkerEstimates& estimates, double half_field_tan);

}  // namespace lightwell::tool
