// Luxonis' OAK cameras, through depthai-core 3.
#pragma once

#include <memory>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>

#include "camera/backend.hpp"
#include "imaging/uri.hpp"

namespace lightwell {

/// depthai:MXID?socket=A&format=nv12&exposure=8ms&gain=1&white_balance=5000K&row_readout=0us
///   - MXID: the device's id, its IP address or its name.
///   - socket: the camera socket of the board, A to J.
///   - format: nv12, or bayer10: the sensor's own pixels, which must have red at the top left.
///   - white: colour temperature of the fixed white balance (for nv12).
///   - readout: delay between successive rows.
///
/// open() boots the device, which takes seconds. If the device is unplugged, the state is lost and a reconnection is
/// tried once a second.
///
/// invalid_argument for invalid parameters; open() returns not_found with a list of the devices, unavailable or
/// failed_precondition.
[[nodiscard]] Result<std::unique_ptr<CameraBackend>> make_depthai_backend(const CameraUri& uri,
                                                                          const CameraConfig& config);

}  // namespace lightwell
