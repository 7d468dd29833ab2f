// lightwell-calibrate mounting: the pose of the probe in the room.
#pragma once

#include <string>
#include <vector>

namespace lightwell::calibrate {

/// `arguments`: those after "mounting". Returns the exit status: 0 done, 1 wrong input, 2 wrong usage.
int mounting_command(const std::vector<std::string>& arguments);

}  // namespace lightwell::calibrate
