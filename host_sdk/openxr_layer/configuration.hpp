// The layer's configuration: environment variables (README.md).
#pragma once

#include <optional>
#include <string>

#include <openxr/openxr.h>

#include <lightwell/geometry.hpp>

namespace lightwell::xr {

/// Prefix of every message, and the layer's name in its manifests.
inline constexpr const char* kLayerName = "XR_APILAYER_LIGHTWELL_light_estimation";

struct Configuration {
  std::string uri;                                             ///< Of the probe, as Probe::connect takes it.
  std::string credentials;                                     ///< Folder; empty: looked up by the address.
  XrReferenceSpaceType space = XR_REFERENCE_SPACE_TYPE_LOCAL;  ///< In which the pose of the probe is stated.
  std::optional<Pose> T_space_probe;                           ///< None: the mounting that the probe reports.
  float scale = 1;                                             ///< Factor of every radiance and irradiance.
  std::string error;                                           ///< Why it cannot be used; empty if it can.
};

/// Reads the environment of the process. Programs with raised privileges have none of the variables.
[[nodiscard]] Configuration read_configuration();

}  // namespace lightwell::xr
