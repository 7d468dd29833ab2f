#include <cstdio>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include <lightwell/discover.hpp>
#include <lightwell/text.hpp>

#include "common.hpp"

namespace lightwell::tool {
namespace {

std::string hex(std::uint32_t value) { return formatted("%08x", value); }

nlohmann::ordered_json json_of(const FoundProbe& probe) {
  nlohmann::ordered_json links = nlohmann::ordered_json::array();
  for (const FoundLink& link : probe.links)
    links.push_back({{"uri", printable(link.uri)}, {"security", link.security}});
  return {{"found_by", to_string(probe.by)},
          {"name", printable(probe.name)},
          {"id", hex(probe.id)},
          {"version", printable(probe.version)},
          {"calibration_id", hex(probe.calibration_id)},
          {"wire_version", probe.wire_version},
          {"instance", printable(probe.instance)},
          {"host", printable(probe.host)},
          {"state", probe.gone ? "gone" : "there"},
          {"links", std::move(links)}};
}

void print(const FoundProbe& probe) {
  // Only the topic of a probe that has left the broker is known.
  if (probe.gone) {
    std::printf("%s  has left the broker\n", printable(probe.instance).c_str());
    return;
  }
  std::printf("%s  version %s  calibration %s  by %s", printable(probe.name).c_str(), printable(probe.version).c_str(),
              hex(probe.calibration_id).c_str(), std::string(to_string(probe.by)).c_str());
  if (probe.instance != probe.name) std::printf(" as '%s'", printable(probe.instance).c_str());
  if (!probe.host.empty()) std::printf(" on %s", printable(probe.host).c_str());
  std::printf("\n");
  for (const FoundLink& link : probe.links)
    std::printf("    %s  %s\n", printable(link.uri).c_str(), link.security == "tls" ? "TLS" : "not encrypted");
  if (probe.links.empty()) std::printf("    no link that other machines can reach\n");
}

}  // namespace

int run_discover(const Options& options) {
  DiscoverOptions how;
  how.timeout = Duration::from_seconds(options.timeout);
  how.broker = options.broker;
  const Result<MqttCredentials> login = broker_login();
  if (!login.ok()) return fail(login.status());
  how.credentials = *login;
  if (!options.ca_file.empty()) how.credentials.ca_file = options.ca_file;
  if (!options.login_file.empty())
    if (const Status status = read_login(options.login_file, how.credentials); !status.ok())
      return fail(kFile, status.message());
  const Result<Discovered> found = discover(how);
  if (!found.ok()) return fail(found.status());
  for (const FoundProbe& probe : found->probes) {
    if (options.json)
      print_json(json_of(probe));
    else
      print(probe);
  }
  for (const std::string& problem : found->problems)
    std::fprintf(stderr, "lightwell: %s\n", printable(problem).c_str());
  if (found->refused > 0)
    std::fprintf(stderr, "lightwell: %zu announcements were malformed or above the limit, and are omitted\n",
                 found->refused);
  if (!found->probes.empty()) return kOk;
  // If a method failed, there may be probes that were not found.
  return found->problems.empty() ? fail(kNothingReceived, "no probe was found") : kUnreachable;
}

}  // namespace lightwell::tool
