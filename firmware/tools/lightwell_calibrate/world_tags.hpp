// A room's tags from a file: which hangs where.
//   family,id,size_m,tx,ty,tz,qx,qy,qz,qw
//   tag36h11,7,0.16,0.5,1.4,-2.0,0,0,0,1
// The first line names the columns, in any order; family may be absent (tag36h11), all others must be there. Each row
// is T_world_tag: metres, and a quaternion of unit length; a tag's frame has its origin in the tag's centre, +X right,
// +Y up, +Z towards who reads it. Empty lines and lines that begin with # are passed over.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <lightwell/result.hpp>

#include "pose/mounting.hpp"

namespace lightwell::calibrate {

/// invalid_argument names `name` and the line.
[[nodiscard]] Result<std::vector<WorldTag>> parse_world_tags(std::string_view text, const std::string& name);
/// not_found, data_loss, or as parse_world_tags().
[[nodiscard]] Result<std::vector<WorldTag>> load_world_tags(const std::string& path);

}  // namespace lightwell::calibrate
