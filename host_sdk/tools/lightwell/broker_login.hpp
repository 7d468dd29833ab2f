// The tool's credentials for an MQTT broker.
#pragma once

#include <string>

#include <lightwell/probe.hpp>

namespace lightwell::tool {

/// From the environment variables LIGHTWELL_MQTT_CA, _CERTIFICATE, _KEY and _LOGIN, each the path of a file; the first
/// line of LOGIN is the user, the second the password. There is no option for the password, because every user of the
/// machine can see arguments. not_found and invalid_argument name the file.
[[nodiscard]] Result<MqttCredentials> broker_login();

/// Reads user and password from a login file.
[[nodiscard]] Status read_login(const std::string& path, MqttCredentials& credentials);

/// The SDK's defaults, with broker_login().
[[nodiscard]] Result<ProbeOptions> probe_options();

}  // namespace lightwell::tool
