// Options of an OAK camera, from the URI depthai:MXID?key=value... and the configuration.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <lightwell/config.hpp>
#include <lightwell/pixel.hpp>
#include <lightwell/result.hpp>
#include <lightwell/time.hpp>

#include "imaging/uri.hpp"

namespace lightwell::oak {

struct OakOptions {
  std::string id;                          ///< MXID (device id), IP address or name, as depthai takes them.
  char socket = 'A';                       ///< Board socket, A to J.
  PixelFormat format = PixelFormat::nv12;  ///< nv12, or bayer_rggb10 from the sensor itself.
  int width = 640, height = 480;
  double frame_rate = 30;
  std::vector<std::uint32_t> exposure_us;  ///< One entry or more.
  std::uint32_t iso = 100;                 ///< 100: a gain of 1.
  /// Colour temperature of the fixed white balance, K.
  int white_balance_k = static_cast<int>(CaptureSettings::kDefaultWhiteBalance_k);
  Duration row_readout;
  std::vector<std::string> notes;  ///< Deviations from the request, and former names of parameters.

  [[nodiscard]] std::vector<double> exposure_s() const;
  [[nodiscard]] double gain() const { return gain_of_iso(iso); }
  [[nodiscard]] static double gain_of_iso(std::uint32_t iso_value) { return iso_value / 100.0; }
};

/// Clamps exposures to the frame interval and gains to 1 to 16, the range of depthai's control messages, and adds
/// notes. invalid_argument names the parameter.
[[nodiscard]] Result<OakOptions> parse_options(const CameraUri& uri, const CameraConfig& config);

}  // namespace lightwell::oak
