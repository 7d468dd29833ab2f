// Cameras that libcamera drives: the Raspberry Pi's, other boards' CSI-2 sensors, and USB cameras.
#pragma once

#include <memory>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>

#include "camera/backend.hpp"
#include "imaging/uri.hpp"

namespace lightwell {

/// libcamera:ID[,ID]?format=nv12&exposure=1ms,8ms&gain=1&colour_gains=1,1&row_readout=20us&timestamp=readout
///     &control_delay=3   (on one line)
///   - ID: id or number of a camera as printed by `cam --list`. Two IDs make a rig of two lenses; their frames are
///     paired by time.
///   - format: a name in kPixelFormats; default: the first supported one (README.md).
///   - exposure, gain, colour_gains: uri_parameters.hpp.
///   - row_readout: delay between successive rows, which libcamera does not report; default 0.
///   - timestamp: the event of SensorTimestamp: readout or exposure of the first row.
///   - control_delay: frames until a new exposure takes effect, for a camera that does not report exposures.
///
/// open() acquires the camera and runs it briefly to measure its exposures and its rate. If a camera is unplugged, the
/// state is lost; after it is plugged in again, frames are delivered and the state is streaming.
///
/// invalid_argument for invalid parameters; open() returns not_found with a list of the cameras, unavailable or
/// failed_precondition.
[[nodiscard]] Result<std::unique_ptr<CameraBackend>> make_libcamera_backend(const CameraUri& uri,
                                                                            const CameraConfig& config);

}  // namespace lightwell
