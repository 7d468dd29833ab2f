// Reads the parameters of camera URIs. Exposure, gain and white balance are parsed here for all cameras:
//   exposure=1ms,8ms         exposure time, or the times of a bracket; s, ms, us, ns, a bare number is seconds
//   gain=2                   linear gain of the sensor
//   white_balance=5000K      colour temperature for which the camera's white balance is fixed; a bare number is kelvin
//   colour_gains=1.8,1.5     gains of red and blue relative to green
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lightwell/config.hpp>
#include <lightwell/result.hpp>

#include "imaging/uri.hpp"

namespace lightwell {

/// The parameters of a backend.
struct ParameterNames {
  std::vector<std::string_view> capture;  ///< Those of the list above that the camera has.
  std::vector<std::string_view> own;      ///< The others.
  std::vector<RenamedParameter> renamed;
};

/// The parameters of one camera.
struct UriParameters {
  CaptureSettings capture;                               ///< From the URI, else from the configuration. Valid.
  std::vector<std::pair<std::string, std::string>> own;  ///< Name and value, in the order written.
  std::vector<std::string> warnings;                     ///< Former names in the URI, for CameraInfo::notes.
};

/// invalid_argument names the parameter: unknown, of an invalid value, given in both the URI and the configuration, or
/// given in the configuration of a camera that does not have it.
[[nodiscard]] Result<UriParameters> read_parameters(CameraUri uri, const CameraConfig& config,
                                                    const ParameterNames& names);

}  // namespace lightwell
