#include <chrono>
#include <cstdio>
#include <iostream>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include <lightwell/discover.hpp>
#include <lightwell/pair.hpp>
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

/// "2027-11-21", UTC.
std::string day_of(std::int64_t seconds) {
  const auto days = std::chrono::floor<std::chrono::days>(std::chrono::sys_seconds(std::chrono::seconds(seconds)));
  const std::chrono::year_month_day date(days);
  return formatted("%04d-%02u-%02u", int{date.year()}, unsigned{date.month()}, unsigned{date.day()});
}

}  // namespace

int run_discover(const Options& options) {
  DiscoverOptions how;
  how.timeout = Duration::from_seconds(options.timeout);
  how.broker = options.broker;
  how.credentials = broker_login();
  if (!options.ca_file.empty()) how.credentials.ca_file = options.ca_file;
  if (!options.login_file.empty()) require(read_login(options.login_file, how.credentials), kFile);
  const Discovered found = require(discover(how));
  for (const FoundProbe& probe : found.probes) {
    if (options.json)
      print_json(json_of(probe));
    else
      print(probe);
  }
  for (const std::string& problem : found.problems) warn(problem);
  if (found.refused > 0)
    warn(std::to_string(found.refused) + " announcements were malformed or above the limit, and are omitted");
  if (!found.probes.empty()) return kOk;
  // If a method failed, there may be probes that were not found.
  if (found.problems.empty()) fail(kNothingReceived, "no probe was found");
  return kUnreachable;
}

int run_pair(const Options& options) {
  std::string code = options.code;
  if (code.empty()) {
    std::fprintf(stderr, "The six digits that the probe shows: ");
    std::getline(std::cin, code);
  }
  PairOptions how;
  how.store = options.store;
  how.client_name = options.name;
  const PairedProbe paired = require(pair_with_probe(options.uri, code, how));
  if (options.json) {
    print_json(
        {{"name", paired.name}, {"uri", paired.uri}, {"folder", paired.folder}, {"expires_s", paired.expires_s}});
    return kOk;
  }
  std::printf("paired with %s until %s\n", printable(paired.name).c_str(), day_of(paired.expires_s).c_str());
  std::printf("credentials  %s\n", paired.folder.c_str());
  if (!paired.uri.empty()) std::printf("try          lightwell info %s\n", printable(paired.uri).c_str());
  return kOk;
}

}  // namespace lightwell::tool
