#include "core/mqtt_login.hpp"

#include <array>
#include <cstdio>
#include <random>

namespace lightwell::core {

std::string random_name() {
  std::random_device random;
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%08x%08x", static_cast<unsigned>(random()), static_cast<unsigned>(random()));
  return text.data();
}

MqttLogin login_of(const MqttCredentials& c) {
  return {"lightwell-sdk-" + random_name(), c.user, c.password, c.ca_file, c.certificate_file, c.key_file};
}

}  // namespace lightwell::core
