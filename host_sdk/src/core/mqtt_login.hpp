// The SDK's login at an MQTT broker.
#pragma once

#include <random>
#include <string>

#include <lightwell/mqtt_session.hpp>
#include <lightwell/probe.hpp>
#include <lightwell/text.hpp>

namespace lightwell::core {

/// Sixteen random hexadecimal digits.
[[nodiscard]] inline std::string random_name() {
  std::random_device random;
  return formatted("%08x%08x", static_cast<unsigned>(random()), static_cast<unsigned>(random()));
}

/// The login with a client identifier that is unique to this connection: a broker disconnects a client when another one
/// connects with the same identifier.
[[nodiscard]] inline MqttLogin login_of(const MqttCredentials& c) {
  return {"lightwell-sdk-" + random_name(), c.user, c.password, c.ca_file, c.certificate_file, c.key_file};
}

}  // namespace lightwell::core
