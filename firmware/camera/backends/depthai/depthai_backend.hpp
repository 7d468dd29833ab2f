// Luxonis' OAK cameras, through depthai-core 3.
#pragma once

#include <memory>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>

#include "camera/backend.hpp"
#include "camera/uri.hpp"

namespace lightwell {

/// depthai:MXID?socket=A&format=nv12&white=5000K&readout=0us
///   - MXID: the device's id, its IP address or its name.
///   - socket: the board's camera socket, A to J.
///   - format: nv12, or bayer10: the sensor's own pixels, which must have red at the top left.
///   - white: the colour temperature whose gains are held (of nv12).
///   - readout: from one row's exposure to the next row's.
///
/// open() boots the device, which takes seconds. A device that is pulled out makes the state lost and is looked for
/// once a second.
///
/// invalid_argument for parameters that make no sense; open() says not_found with the devices that there are,
/// unavailable or failed_precondition.
[[nodiscard]] Result<std::unique_ptr<CameraBackend>> make_depthai_backend(const CameraUri& uri,
                                                                          const CameraConfig& config);

}  // namespace lightwell
