// Options of a V4L2 camera, from its URI and the configuration:
//   v4l2:/dev/video0?width=1280&height=960&fps=30&format=yuyv&exposure=1ms,8ms&gain=0&white_balance=5000
//       &power_line=off&readout=15us&control_delay=2   (on one line)
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
  std::string path;                ///< Device node; symbolic links are resolved again at each reconnection.
  RequestedFormat wanted;          ///< From the URI, else from the configuration.
  std::vector<double> exposure_s;  ///< The bracket, s; empty: the camera's initial exposure.
  std::optional<int> gain;         ///< In the device's own unit; empty: the lowest.
  int white_balance_kelvin = 5000;
  int power_line = 0;                ///< V4L2_CID_POWER_LINE_FREQUENCY: off, 50 Hz or 60 Hz.
  Duration row_readout;              ///< Delay between successive rows; 0: a global shutter, or unknown.
  std::optional<int> control_delay;  ///< Frames until a control takes effect; empty: measured if a bracket needs it.
};

/// Exposures may be given in the URI or in the configuration, not in both. invalid_argument names the parameter, its
/// value and the accepted values.
[[nodiscard]] Result<Options> parse_options(const CameraUri& uri, const CameraConfig& config);

}  // namespace lightwell::v4l2
