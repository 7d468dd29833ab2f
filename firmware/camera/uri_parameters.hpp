// Reads the parameters of camera URIs. Those of all cameras, exposure, gain, white_balance and colour_gains, are parsed
// here (README.md).
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
  std::vector<std::string_view> capture;  ///< Those of all cameras that this one has.
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
