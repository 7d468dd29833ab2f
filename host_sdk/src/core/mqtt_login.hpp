// As whom this SDK speaks to a broker.
#pragma once

#include <string>

#include <lightwell/mqtt_session.hpp>
#include <lightwell/probe.hpp>

namespace lightwell::core {

/// Sixteen hexadecimal digits by which nobody else is known.
[[nodiscard]] std::string random_name();

/// Under a name of this one connection: at a broker the second of one name throws the first one out.
[[nodiscard]] MqttLogin login_of(const MqttCredentials& credentials);

}  // namespace lightwell::core
