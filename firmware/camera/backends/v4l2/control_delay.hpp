// How many frames a camera takes until a new exposure shows: measured on the camera itself.
#pragma once

#include <lightwell/result.hpp>

#include "camera/backends/v4l2/connection.hpp"
#include "camera/backends/v4l2/converter.hpp"

namespace lightwell::v4l2 {

/// Streams for a hundred frames: sets exposure a step up and down until four steps showed, and looks at which frame
/// each does. No buffer of the connection is queued, and it is left so, with exposure.codes.front() set. `rate` is the
/// camera's, frames a second.
/// unavailable where no step shows (darkness, light that flickers) or steps disagree.
[[nodiscard]] Result<int> measure_control_delay(Connection& connection, Converter& converter, double rate);

}  // namespace lightwell::v4l2
