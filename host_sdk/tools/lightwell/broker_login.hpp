// With what the tool comes in at an MQTT broker.
#pragma once

#include <string>

#include <lightwell/probe.hpp>

namespace lightwell::tool {

/// Of the environment: LIGHTWELL_MQTT_CA, _CERTIFICATE, _KEY and _LOGIN, each a file's path; of LOGIN the first line is
/// the user, the second the password. A password in an argument would be seen by everybody on the machine. not_found or
/// invalid_argument name the file.
[[nodiscard]] Result<MqttCredentials> broker_login();

/// User and password of a file as above.
[[nodiscard]] Status read_login(const std::string& path, MqttCredentials& credentials);

/// The SDK's defaults, with broker_login().
[[nodiscard]] Result<ProbeOptions> probe_options();

}  // namespace lightwell::tool
