// Cameras that libcamera drives: the Raspberry Pi's, other boards' CSI-2 sensors, and USB cameras.
#pragma once

#include <memory>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>

#include "camera/backend.hpp"
#include "imaging/uri.hpp"

namespace lightwell {

/// libcamera:ID[,ID]?format=nv12&exposure=1ms,8ms&...: README.md lists the parameters. Two IDs make a rig of two
/// lenses, whose frames are paired by time.
///
/// invalid_argument for parameters; open() returns not_found with all cameras, unavailable or failed_precondition.
[[nodiscard]] Result<std::unique_ptr<CameraBackend>> make_libcamera_backend(const CameraUri& uri,
                                                                            const CameraConfig& config);

}  // namespace lightwell
