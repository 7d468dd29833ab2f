// Conversions between generated messages and values that several codec files use.
#pragma once

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>
#include <lightwell/uncertain_pose.hpp>

#include "lightwell/v1/calibration.pb.h"

namespace lightwell {

[[nodiscard]] RigParameters rig_from(const v1::RigCalibration& m);
[[nodiscard]] v1::RigCalibration rig_to(const RigParameters& rig);

/// invalid_argument names the field.
[[nodiscard]] Result<UncertainPose> mounting_from(const v1::Mounting& m);
[[nodiscard]] v1::Mounting mounting_to(const UncertainPose& T_world_probe);

}  // namespace lightwell
