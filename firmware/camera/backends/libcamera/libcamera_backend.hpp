// Cameras that libcamera drives: the Raspberry Pi's, other boards' CSI-2 sensors, and USB cameras.
#pragma once

#include <memory>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>

#include "camera/backend.hpp"
#include "camera/uri.hpp"

namespace lightwell {

/// libcamera:ID[,ID]?format=nv12&readout=20us&stamp=readout&white=1,1&settle=3
///   - ID: a camera's id or number as `cam --list` prints them; two make a rig of two lenses, whose frames are paired
///   by
///     their times.
///   - format: one of kPixelFormats' names; without, the first that suits (README.md).
///   - readout: from one row's exposure to the next row's, which libcamera cannot tell; 0.
///   - stamp: what happens at the instant of SensorTimestamp, readout or exposure of the first row.
///   - white: gains of red and blue, where the camera's white balance can be set by hand.
///   - settle: frames until a new exposure is in force, with a camera that does not say which it had.
///
/// open() takes the camera and lets it run for a moment, to learn its exposures and its rate. A camera that is pulled
/// out makes the state lost; when it is plugged in again, frames come again and the state is streaming.
///
/// invalid_argument for parameters that make no sense; open() says not_found with the cameras that there are,
/// unavailable or failed_precondition.
[[nodiscard]] Result<std::unique_ptr<CameraBackend>> make_libcamera_backend(const CameraUri& uri,
                                                                            const CameraConfig& config);

}  // namespace lightwell
