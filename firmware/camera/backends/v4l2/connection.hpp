// The options of a V4L2 camera, from its URI and the configuration (README.md); opens a device and prepares it for
// streaming: switches off all automatic controls, sets manual values, and reads back the values in force.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>

#include "camera/backends/v4l2/device.hpp"
#include "camera/backends/v4l2/formats.hpp"
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

/// Unit of V4L2_CID_EXPOSURE_ABSOLUTE, s.
inline constexpr double kExposureUnit_s = 1e-4;

/// Sets gain, white balance, power-line filter, focus and other automatic controls. Appends the values read back and
/// the missing controls to `notes`.
void disable_auto_controls(Device& device, const Options& options, std::vector<std::string>& notes);

/// The cycle of exposures.
struct ExposureControl {
  std::optional<Control> control;  ///< Empty: no exposure control; `seconds` is an assumption.
  std::vector<int> codes;          ///< Control value by index in the cycle; empty without a control.
  std::vector<double> seconds;     ///< Exposure by index in the cycle, as read back.
};

/// Sets manual exposure: each of options.capture.exposure_s is set and read back, finally the first one. `rate`: frame
/// rate, 1/s, 0 if unknown. invalid_argument for a bracket on a device without an exposure control.
[[nodiscard]] Result<ExposureControl> configure_exposure(Device& device, const Options& options, double rate,
                                                         std::vector<std::string>& notes);

struct Connection {
  Device device;
  const Encoding* encoding = nullptr;
  Layout layout;
  double rate = 0;
  ExposureControl exposure;
  MappedBuffers buffers;
  /// Frames lend the driver's memory; false: they are converted, or copied because the driver gave too few buffers.
  bool zero_copy = false;
};

/// Buffers that stay queued while all frames are lent, so that the driver continues to capture and count frames.
inline constexpr int kMinQueuedBuffers = 3;

/// Opens the device, negotiates the format, sets controls, maps buffers. Appends texts for CameraInfo::notes to
/// `notes`.
[[nodiscard]] Result<Connection> connect(const Options& options, std::vector<std::string>& notes);

}  // namespace lightwell::v4l2
