// Options of a V4L2 camera, from its URI and the configuration:
//   v4l2:/dev/video0?width=1280&height=960&frame_rate=30&format=yuyv&exposure=1ms,8ms&gain_raw=0&white_balance=5000K
//       &power_line=off&row_readout=15us&control_delay=2   (on one line)
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>

#include "camera/backends/v4l2/negotiation.hpp"
#include "imaging/uri.hpp"

namespace lightwell::v4l2 {

struct Options {
  std::string path;                  ///< Device node, or a symbolic link to one.
  RequestedFormat wanted;            ///< From the URI, else from the configuration.
  CaptureSettings capture;           ///< Exposures and white balance; without exposures: the camera's initial exposure.
  std::optional<int> gain_raw;       ///< V4L2_CID_GAIN, which has no unit; empty: the lowest.
  int power_line = 0;                ///< V4L2_CID_POWER_LINE_FREQUENCY: off, 50 Hz or 60 Hz.
  Duration row_readout;              ///< Delay between successive rows; 0: a global shutter, or unknown.
  std::optional<int> control_delay;  ///< Frames until a control takes effect; empty: measured if a bracket needs it.
  std::vector<std::string> notes;    ///< Former names of parameters in the URI.
};

/// invalid_argument names the parameter, its value and the accepted values.
[[nodiscard]] Result<Options> parse_options(const CameraUri& uri, const CameraConfig& config);

}  // namespace lightwell::v4l2
