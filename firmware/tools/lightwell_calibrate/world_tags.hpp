// Parses the poses of a room's tags, a CSV file.
//   family,id,size_m,tx,ty,tz,qx,qy,qz,qw
//   tag36h11,7,0.16,0.5,1.4,-2.0,0,0,0,1
// The first line names the columns, in any order; family is optional (tag36h11), all others are required. Each row is
// T_world_tag: metres, and a unit quaternion; a tag's frame has its origin in the tag's centre, +X right, +Y up, +Z
// towards the viewer. Empty lines and lines that begin with # are ignored.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <lightwell/result.hpp>

#include "pose/mounting.hpp"

namespace lightwell::calibrate {

/// invalid_argument: a malformed line or an invalid value; the message has `name` and the line.
[[nodiscard]] Result<std::vector<WorldTag>> parse_world_tags(std::string_view text, const std::string& name);

}  // namespace lightwell::calibrate
