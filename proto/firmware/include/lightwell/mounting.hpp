// A probe's pose in its room as a text file: T_world_probe with its covariance. Written by `lightwell-calibrate
// mounting`, read by lightwelld, reported by Info. Meanings: proto/lightwell/v1/calibration.proto.
#pragma once

#include <string>
#include <string_view>

#include <lightwell/result.hpp>
#include <lightwell/uncertain_pose.hpp>

namespace lightwell {

/// Reads a Mounting in protobuf text format and normalises its rotation. invalid_argument, naming the field: a rotation
/// that is zero or not finite, a translation that is not finite, a variance that is negative or NaN, a covariance
/// larger than its variances allow.
[[nodiscard]] Result<UncertainPose> load_mounting(const std::string& path);
[[nodiscard]] Result<UncertainPose> parse_mounting(std::string_view text, const std::string& name);
[[nodiscard]] std::string mounting_to_text(const UncertainPose& T_world_probe);

}  // namespace lightwell
