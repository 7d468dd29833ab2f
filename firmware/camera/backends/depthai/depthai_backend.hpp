// Luxonis' OAK cameras, through depthai-core 3.
#pragma once

#include <memory>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>

#include "camera/backend.hpp"
#include "imaging/uri.hpp"

namespace lightwell {

/// depthai:MXID?socket=A&format=nv12&...: README.md lists the parameters.
///
/// invalid_argument for parameters; open() returns not_found with all devices, unavailable or failed_precondition.
[[nodiscard]] Result<std::unique_ptr<CameraBackend>> make_depthai_backend(const CameraUri& uri,
                                                                          const CameraConfig& config);

}  // namespace lightwell
