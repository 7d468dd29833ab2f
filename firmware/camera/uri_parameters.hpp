// Reads the parameters of camera URIs; parses those of all cameras: exposure, gain, white_balance, colour_gains.
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

/// invalid_argument names a parameter: unknown, invalid, in both URI and configuration, or not this camera's.
[[nodiscard]] Result<UriParameters> read_parameters(CameraUri uri, const CameraConfig& config,
                                                    const ParameterNames& names);

}  // namespace lightwell
