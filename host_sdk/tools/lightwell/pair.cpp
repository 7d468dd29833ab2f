#include <array>
#include <cstdio>
#include <ctime>
#include <iostream>
#include <string>

#include <nlohmann/json.hpp>

#include <lightwell/pair.hpp>
#include <lightwell/printable.hpp>

#include "commands.hpp"
#include "exit_code.hpp"
#include "json_text.hpp"

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

int run_pair(const PairCommand& command) {
  std::string code = command.code;
  if (code.empty()) {
    std::fprintf(stderr, "The six digits that the probe shows: ");
    std::getline(std::cin, code);
  }
  PairOptions options;
  options.store = command.store;
  options.client_name = command.name;
  const Result<PairedProbe> paired = pair_with_probe(command.uri, code, options);
  if (!paired.ok()) return fail(paired.status());
  if (command.output == Output::json) {
    const nlohmann::ordered_json out = {
        {"name", paired->name}, {"uri", paired->uri}, {"folder", paired->folder}, {"expires_s", paired->expires_s}};
    std::printf("%s\n", json_text(out).c_str());
    return kOk;
  }
  std::printf("paired with %s until %s\n", printable(paired->name).c_str(), day_of(paired->expires_s).c_str());
  std::printf("credentials  %s\n", paired->folder.c_str());
  if (!paired->uri.empty()) std::printf("try          lightwell info %s\n", printable(paired->uri).c_str());
  return kOk;
}

}  // namespace lightwell::tool
