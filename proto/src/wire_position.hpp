// Poses on the wire, the origin of a descriptor among them, and the distances of its lights. Specification:
// proto/README.md, "Origin and near lamps".
#pragma once

#include <lightwell/descriptor.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

#include "lightwell/v1/descriptor.pb.h"

namespace lightwell {

/// invalid_argument, beginning with `who`: not a unit quaternion, or a translation that the wire format does not allow.
[[nodiscard]] Status wire_pose_problem(const Pose& pose, const char* who);
/// With a unit quaternion. invalid_argument, beginning with `who`: pose_problem(), or wire_pose_problem() of the
/// result.
[[nodiscard]] Result<Pose> wire_pose_from(const v1::Pose& m, const char* who);

/// wire_pose_problem() of a descriptor's origin.
[[nodiscard]] Status origin_problem(const Pose& T_probe_origin);
/// invalid_argument: only one of distance and standard deviation is set, or one is negative, not finite, or out of the
/// range of the wire format (1e-4 m to 429 km; a standard deviation may be less than 1e-4 m).
[[nodiscard]] Status distance_problem(const Light& light);

/// Requires origin_problem().ok(). A descriptor whose origin is the probe has no such message.
void fill_origin(const Pose& T_probe_origin, v1::Pose& m);
/// Requires distance_problem().ok(). Sets no field if the distance is not known.
void fill_distance(const Light& light, v1::Light& m);

/// With a unit quaternion; the identity if the message has no origin.
[[nodiscard]] Result<Pose> origin_from(const v1::LightingDescriptor& m);
[[nodiscard]] Status read_distance(const v1::Light& m, Light& light);

}  // namespace lightwell
