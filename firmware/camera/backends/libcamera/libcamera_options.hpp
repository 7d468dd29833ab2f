// libcamera:ID?key=value...: what is asked of the camera.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <lightwell/config.hpp>
#include <lightwell/pixel.hpp>
#include <lightwell/result.hpp>

#include "camera/backends/libcamera/sensor_clock.hpp"
#include "camera/uri.hpp"

namespace lightwell::libcam {

struct LibcameraOptions {
  /// Ids or numbers as `cam --list` prints them; one a lens, in the order of the lenses.
  std::vector<std::string> cameras;
  int width = 640, height = 480;
  double frame_rate = 30;          ///< 0: the camera's own.
  std::vector<double> exposure_s;  ///< Empty: the camera's default.
  double gain = 1;
  std::optional<PixelFormat> format;  ///< Nothing: the first that suits.
  Duration row_readout;               ///< From one row's exposure to the next row's; libcamera cannot tell.
  TimestampEvent timestamp_event = TimestampEvent::readout;
  std::array<double, 2> colour_gains{1, 1};  ///< Red, blue. 1: no channel clips before the sensor does.
  int settle_frames = 3;                     ///< Until a new exposure is in force, with a camera that does not say.
};

/// invalid_argument names the parameter.
[[nodiscard]] Result<LibcameraOptions> parse_options(const CameraUri& uri, const CameraConfig& config);

}  // namespace lightwell::libcam
