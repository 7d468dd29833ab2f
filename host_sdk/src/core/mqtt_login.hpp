// The SDK's login at an MQTT broker.
#pragma once

#include <string>

#include <lightwell/mqtt_session.hpp>
#include <lightwell/probe.hpp>

namespace lightwell::core {

/// Sixteen random hexadecimal digits.
[[nodiscard]] std::string random_name();

/// The login with a client identifier that is unique to this connection: a broker disconnects a client when another one
/// connects with the same identifier.
[[nodiscard]] MqttLogin login_of(const MqttCredentials& credentials);

}  // namespace lightwell::core
