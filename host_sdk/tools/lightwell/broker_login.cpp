#include "broker_login.hpp"

#include <cstdlib>
#include <fstream>

namespace lightwell::tool {
namespace {

std::string environment(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? std::string() : std::string(value);
}

}  // namespace

Status read_login(const std::string& path, MqttCredentials& credentials) {
  std::ifstream file(path);
  if (!file) return {StatusCode::not_found, path + " cannot be read"};
  std::getline(file, credentials.user);
  std::getline(file, credentials.password);
  for (std::string* line : {&credentials.user, &credentials.password})
    if (line->ends_with('\r')) line->pop_back();
  if (credentials.user.empty())
    return {StatusCode::invalid_argument, path + ": the first line is the user, the second the password"};
  return {};
}

Result<MqttCredentials> broker_login() {
  MqttCredentials out;
  out.ca_file = environment("LIGHTWELL_MQTT_CA");
  out.certificate_file = environment("LIGHTWELL_MQTT_CERTIFICATE");
  out.key_file = environment("LIGHTWELL_MQTT_KEY");
  if (const std::string login = environment("LIGHTWELL_MQTT_LOGIN"); !login.empty())
    if (Status status = read_login(login, out); !status.ok()) return status;
  return out;
}

Result<ProbeOptions> probe_options() {
  Result<MqttCredentials> login = broker_login();
  if (!login.ok()) return login.status();
  ProbeOptions options;
  options.mqtt = std::move(*login);
  return options;
}

}  // namespace lightwell::tool
