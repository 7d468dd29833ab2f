// Between generated messages and values, for more than one file of the codec.
#pragma once

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "lightwell/v1/calibration.pb.h"

namespace lightwell {

[[nodiscard]] RigParameters rig_from(const v1::RigCalibration& m);
[[nodiscard]] v1::RigCalibration rig_to(const RigParameters& rig);

}  // namespace lightwell
