#include <array>
#include <cstdio>
#include <ctime>
#include <iostream>
#include <string>

#include <nlohmann/json.hpp>

#include <lightwell/pair.hpp>
#include <lightwell/text.hpp>

#include "common.hpp"

namespace lightwell::tool {
namespace {

/// "2027-11-21", UTC.
std::string day_of(std::int64_t seconds) {
  const auto time = static_cast<std::time_t>(seconds);
  std::tm parts{};
  std::array<char, 32> text{};
  if (gmtime_r(&time, &parts) == nullptr || std::strftime(text.data(), text.size(), "%Y-%m-%d", &parts) == 0)
    return std::to_string(seconds) + " s";
  return text.data();
}

}  // namespace

int run_pair(const Options& options) {
  std::string code = options.code;
  if (code.empty()) {
    std::fprintf(stderr, "The six digits that the probe shows: ");
    std::getline(std::cin, code);
  }
  PairOptions how;
  how.store = options.store;
  how.client_name = options.name;
  const Result<PairedProbe> paired = pair_with_probe(options.uri, code, how);
  if (!paired.ok()) return fail(paired.status());
  if (options.json) {
    print_json(
        {{"name", paired->name}, {"uri", paired->uri}, {"folder", paired->folder}, {"expires_s", paired->expires_s}});
    return kOk;
  }
  std::printf("paired with %s until %s\n", printable(paired->name).c_str(), day_of(paired->expires_s).c_str());
  std::printf("credentials  %s\n", paired->folder.c_str());
  if (!paired->uri.empty()) std::printf("try          lightwell info %s\n", printable(paired->uri).c_str());
  return kOk;
}

}  // namespace lightwell::tool
