// How many frames a camera takes until a new exposure shows: measured on the camera itself.
#pragma once

#include <functional>
#include <optional>

#include <lightwell/result.hpp>

#include "camera/backends/v4l2/controls.hpp"
#include "camera/backends/v4l2/device.hpp"

namespace lightwell::v4l2 {

/// How bright the picture in a buffer is, 0 to 1; nothing where it is damaged.
using LevelOfBuffer = std::function<std::optional<double>(const v4l2_buffer&)>;

/// Streams for some two seconds: sets exposure to a step up and down, twice, and looks at which frame it shows. The
/// device has `buffers` buffers, none queued, and is left so, with exposure.codes.front() set.
/// unavailable where no step shows (darkness, light that flickers) or steps disagree.
[[nodiscard]] Result<int> measure_control_delay(Device& device, int buffers, const ExposureControl& exposure,
                                                double rate, const LevelOfBuffer& level_of);

}  // namespace lightwell::v4l2
