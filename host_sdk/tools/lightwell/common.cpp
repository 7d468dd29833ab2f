#include "common.hpp"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <tuple>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <lightwell/files.hpp>
#include <lightwell/mqtt.hpp>
#include <lightwell/text.hpp>

namespace lightwell::tool {
namespace {

std::string environment(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? std::string() : std::string(value);
}

}  // namespace

void warn(std::string_view message) { std::fprintf(stderr, "lightwell: %s\n", printable(message).c_str()); }

void fail(ExitCode code, const std::string& message) { throw Failure(code, message); }

void require(const Status& status, std::optional<ExitCode> code) {
  if (status.ok()) return;
  const ExitCode by_status = status.code() == StatusCode::invalid_argument ? kUsage
                             : status.code() == StatusCode::unavailable    ? kUnreachable
                                                                           : kFile;
  fail(code.value_or(by_status), status.message());
}

int parse(CLI::App& app, int argc, const char* const* argv) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& success) {
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    warn(std::string(error.what()) + "; see " + app.get_name() + " --help");
    return kUsage;
  } catch (const Failure& failure) {
    warn(failure.what());
    return failure.code;
  }
  return kOk;
}

std::string json_text(const nlohmann::ordered_json& document) {
  return document.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace);
}

void print_json(const nlohmann::ordered_json& document) { std::printf("%s\n", json_text(document).c_str()); }

std::vector<std::string_view> flag_names(Flags flags) {
  std::vector<std::string_view> names;
  for (const Flag flag : kFlags)
    if (flags.has(flag)) names.push_back(to_string(flag));
  return names;
}

std::string flags_text(Flags flags) {
  std::string text;
  for (const std::string_view name : flag_names(flags)) text += (text.empty() ? "" : " ") + std::string(name);
  return text.empty() ? "-" : text;
}

std::string bound_text(float bound) {
  if (!std::isfinite(bound)) return "infinite";
  return formatted("%.2f %%", 100 * static_cast<double>(bound));
}

Status read_login(const std::string& path, MqttCredentials& credentials) {
  const Result<std::optional<std::string>> text = read_named_file(path);
  if (!text.ok()) return text.status();
  if (!*text) return {StatusCode::not_found, path + ": there is no such file"};
  std::tie(credentials.user, credentials.password) = mqtt_login_of(**text);
  if (credentials.user.empty())
    return {StatusCode::invalid_argument, path + ": the first line must be the user, the second the password"};
  return {};
}

MqttCredentials broker_login() {
  MqttCredentials out;
  out.ca_file = environment("LIGHTWELL_MQTT_CA");
  out.certificate_file = environment("LIGHTWELL_MQTT_CERTIFICATE");
  out.key_file = environment("LIGHTWELL_MQTT_KEY");
  if (const std::string login = environment("LIGHTWELL_MQTT_LOGIN"); !login.empty()) require(read_login(login, out));
  return out;
}

Probe connect(const Options& options, std::function<void(const Arrival&)> on_descriptor,
              std::function<void(const PlaneArrival&)> on_plane) {
  ProbeOptions how;
  how.mqtt = broker_login();
  how.credentials.folder = options.credentials;
  how.on_descriptor = std::move(on_descriptor);
  if (on_plane) how.plane = PlaneReception::receive;
  how.on_plane = std::move(on_plane);
  return require(Probe::connect(options.uri, std::move(how)));
}

Lighting lighting_with_map(const Probe& probe) {
  const HostTime deadline = HostTime{monotonic_now_ns()} + kMapTimeout;
  Lighting lighting = probe.latest();
  while (!lighting.environment()) {
    const Duration left = deadline - HostTime{monotonic_now_ns()};
    if (left <= Duration{}) break;
    // The end of a recording can be reported before its last descriptor was processed here.
    const bool over = probe.stats().state == LinkState::ended;
    std::optional<std::uint64_t> seen;
    if (lighting.validity() != Validity::none) seen = lighting.descriptor().sequence;
    const Result<Lighting> next = probe.wait_for_next(seen, left);
    if (next.ok()) lighting = *next;
    if (over || !next.ok()) break;
  }
  return lighting;
}

}  // namespace lightwell::tool
