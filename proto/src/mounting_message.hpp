// Conversion of a Mounting message to and from the probe's pose.
#pragma once

#include <lightwell/result.hpp>
#include <lightwell/uncertain_pose.hpp>

#include "lightwell/v1/calibration.pb.h"

namespace lightwell {

/// T_world_probe with a unit rotation. invalid_argument, naming the field: a rotation that is zero or not finite, a
/// translation that is not finite, a number of covariances other than 0 and 21, a variance that is negative or NaN, a
/// covariance larger than its variances allow.
[[nodiscard]] Result<UncertainPose> mounting_from(const v1::Mounting& m);
[[nodiscard]] v1::Mounting mounting_to(const UncertainPose& T_world_probe);

}  // namespace lightwell
