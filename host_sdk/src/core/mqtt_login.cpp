#include "core/mqtt_login.hpp"

#include <random>

#include <lightwell/text.hpp>

namespace lightwell::core {

std::string random_name() {
  std::random_device random;
  return formatted("%08x%08x", static_cast<unsigned>(random()), static_cast<unsigned>(random()));
}

MqttLogin login_of(const MqttCredentials& c) {
  return {"lightwell-sdk-" + random_name(), c.user, c.password, c.ca_file, c.certificate_file, c.key_file};
}

}  // namespace lightwell::core
