// Options of the libcamera backend, from the URI libcamera:ID?key=value... and the configuration.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <lightwell/config.hpp>
#include <lightwell/pixel.hpp>
#include <lightwell/result.hpp>

#include "camera/backends/libcamera/sensor_clock.hpp"
#include "imaging/uri.hpp"

namespace lightwell::libcam {

struct LibcameraOptions {
  /// Ids or numbers as printed by `cam --list`, one per lens, in the order of the lenses.
  std::vector<std::string> cameras;
  int width = 640, height = 480;
  double frame_rate = 30;             ///< 1/s; 0: the camera's own.
  CaptureSettings capture;            ///< Without exposures: the camera's default. Colour gains of 1 if not set.
  std::optional<PixelFormat> format;  ///< Empty: the first supported one.
  Duration row_readout;               ///< Delay between successive rows; libcamera does not report it.
  TimestampEvent timestamp_event = TimestampEvent::readout;
  int control_delay = 3;           ///< Frames until a new exposure takes effect, if the camera does not report it.
  std::vector<std::string> notes;  ///< Former names of parameters in the URI.
};

/// invalid_argument names the parameter.
[[nodiscard]] Result<LibcameraOptions> parse_options(const CameraUri& uri, const CameraConfig& config);

}  // namespace lightwell::libcam
