#include "broker_login.hpp"

#include <cstdlib>
#include <optional>
#include <tuple>

#include <lightwell/files.hpp>
#include <lightwell/mqtt.hpp>

namespace lightwell::tool {
namespace {

std::string environment(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? std::string() : std::string(value);
}

}  // namespace

Status read_login(const std::string& path, MqttCredentials& credentials) {
  const Result<std::optional<std::string>> text = read_named_file(path);
  if (!text.ok()) return text.status();
  if (!*text) return {StatusCode::not_found, path + ": there is no such file"};
  std::tie(credentials.user, credentials.password) = mqtt_login_of(**text);
  if (credentials.user.empty())
    return {StatusCode::invalid_argument, path + ": the first line must be the user, the second the password"};
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
