// Measures the control delay of a camera: the number of frames until a new exposure takes effect.
#pragma once

#include <lightwell/result.hpp>

#include "camera/backends/v4l2/connection.hpp"
#include "camera/backends/v4l2/converter.hpp"

namespace lightwell::v4l2 {

/// Streams for about a hundred frames: switches between two exposures until four steps are visible in the mean levels,
/// and counts the frames from each request to its effect. `rate`: frame rate, 1/s. No buffer may be queued before, and
/// none is afterwards; exposure.codes.front() is set at the end.
/// unavailable if no step is visible (darkness, flicker) or the steps disagree.
[[nodiscard]] Result<int> measure_control_delay(Connection& connection, Converter& converter, double rate);

}  // namespace lightwell::v4l2
