#include "tools/lightwell_calibrate/arguments.hpp"

#include <algorithm>

#include "imaging/uri.hpp"

namespace lightwell::calibrate {

Result<std::vector<Argument>> parse_arguments(std::span<char* const> arguments,
                                              const std::vector<std::string_view>& known,
                                              const std::vector<std::string_view>& flags) {
  const auto usage = [](const std::string& what) {
    return Status(StatusCode::invalid_argument, what + "; see --help");
  };
  std::vector<Argument> out;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string_view text = arguments[i];
    if (text == "--help" || text == "-h") {
      out.push_back({"--help", ""});
      return out;
    }
    if (text.size() < 2 || text[0] != '-') {
      out.push_back({"", std::string(text)});
      continue;
    }
    if (std::find(flags.begin(), flags.end(), text) != flags.end()) {
      out.push_back({std::string(text), ""});
      continue;
    }
    const auto equals = text.find('=');
    const std::string name(text.substr(0, equals));
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      std::vector<std::string_view> all = known;
      all.insert(all.end(), flags.begin(), flags.end());
      const std::string near = nearest_name(name, all);
      return usage("unknown option " + name + (near.empty() ? "" : "; did you mean " + near + "?"));
    }
    if (equals != std::string_view::npos) {
      out.push_back({name, std::string(text.substr(equals + 1))});
    } else if (i + 1 < arguments.size()) {
      out.push_back({name, arguments[++i]});
    } else {
      return usage(name + " needs a value");
    }
  }
  return out;
}

std::optional<std::vector<double>> numbers(std::string_view text, std::size_t count) {
  std::vector<double> out;
  while (true) {
    const auto comma = text.find(',');
    const auto value = number<double>(text.substr(0, comma));
    if (!value || !std::isfinite(*value)) return std::nullopt;
    out.push_back(*value);
    if (comma == std::string_view::npos) break;
    text.remove_prefix(comma + 1);
  }
  if (out.size() != count) return std::nullopt;
  return out;
}

}  // namespace lightwell::calibrate
