// Where in its room a probe hangs, kept as text: T_world_probe with its covariance.
// What `lightwell-calibrate mounting` writes, lightwelld reads, and Info tells. Meanings:
// proto/lightwell/v1/calibration.proto.
#pragma once

#include <string>
#include <string_view>

#include <lightwell/result.hpp>
#include <lightwell/uncertain_pose.hpp>

namespace lightwell {

/// What no mounting can be: a rotation that is zero or not finite, a translation that is not finite, variances below
/// zero or NaN, a covariance above what its variances allow. invalid_argument names the field.
[[nodiscard]] Status validate_mounting(const UncertainPose& T_world_probe);

/// A Mounting in text format, validated, its rotation normalised.
[[nodiscard]] Result<UncertainPose> load_mounting(const std::string& path);
[[nodiscard]] Result<UncertainPose> parse_mounting(std::string_view text, const std::string& name);
[[nodiscard]] std::string mounting_to_text(const UncertainPose& T_world_probe);

}  // namespace lightwell
