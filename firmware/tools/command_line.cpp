#include "tools/command_line.hpp"

#include <array>
#include <cmath>
#include <iostream>
#include <map>

#include <nlohmann/json.hpp>

#include <lightwell/files.hpp>
#include <lightwell/text.hpp>

#include "imaging/uri.hpp"

namespace lightwell {
namespace {

/// Describes the first argument that is no option, file or subcommand of the app; empty if there is none.
std::string unexpected_argument(const CLI::App& app) {
  const std::vector<std::string> extra = app.remaining();
  if (extra.empty()) return "";
  const bool option = extra.front().size() > 1 && extra.front().starts_with('-');
  const std::string given = option ? extra.front().substr(0, extra.front().find('=')) : extra.front();
  std::vector<std::string> names;
  if (option) {
    for (const CLI::Option* known : app.get_options())
      for (const std::string& name : known->get_lnames()) names.push_back("--" + name);
  } else {
    for (const CLI::App* known : app.get_subcommands({})) names.push_back(known->get_name());
  }
  const std::string near = nearest_name(given, {names.begin(), names.end()});
  return (option ? "unknown option " + given : "unexpected argument '" + given + "'") +
         (near.empty() ? "" : "; did you mean " + near + "?");
}

}  // namespace

std::optional<int> parse_command_line(CLI::App& app, const std::vector<std::string>& arguments) {
  try {
    app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));  // CLI11 expects reverse order.
  } catch (const CLI::Success& done) {
    return app.exit(done);
  } catch (const CLI::ParseError& error) {
    const std::string unexpected = unexpected_argument(app);
    return wrong_usage(app, unexpected.empty() ? error.what() : unexpected);
  }
  return std::nullopt;
}

int wrong_usage(const CLI::App& app, std::string_view what) {
  std::cerr << app.get_name() << ": " << what << "; see --help\n";
  return kUsage;
}

void refuse(const std::string& what) { throw InputError(invalid_argument(what)); }

void require(const Status& status) {
  if (!status.ok()) throw InputError(status);
}

int run_command(CLI::App& app, const std::vector<std::string>& arguments, const std::function<int()>& work) {
  if (const auto exit = parse_command_line(app, arguments)) return *exit;
  try {
    return work();
  } catch (const UsageError& error) {
    return wrong_usage(app, error.what());
  } catch (const InputError& error) {
    std::cerr << app.get_name() << ": " << error.what() << "\n";
    return kBadInput;
  }
}

Status write_output(const std::string& path, std::string_view bytes) {
  if (path != "-") return write_atomically(path, bytes, FileMode::umask);
  std::cout << bytes << std::flush;
  return std::cout ? Status() : Status(StatusCode::data_loss, "standard output cannot be written");
}

CLI::Validator number_where(const std::string& range, const std::function<bool(double)>& holds) {
  const auto check = [range, holds](const std::string& text) {
    const std::optional<double> number = parse_number<double>(text);
    return number && holds(*number) ? "" : "'" + text + "' is not " + range;
  };
  return {check, ""};
}

std::vector<std::pair<const CLI::Option*, std::size_t>> in_order(const CLI::App& app) {
  std::map<const CLI::Option*, std::size_t> counts;
  std::vector<std::pair<const CLI::Option*, std::size_t>> out;
  for (const CLI::Option* option : app.parse_order()) out.emplace_back(option, counts[option]++);
  return out;
}

std::string json_text(const nlohmann::ordered_json& document) {
  return document.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace);
}

nlohmann::ordered_json json_or_null(const std::optional<double>& number) {
  return number ? nlohmann::ordered_json(*number) : nlohmann::ordered_json();
}

nlohmann::ordered_json json_number(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "Infinity" : "-Infinity";
  return value;
}

nlohmann::ordered_json json_numbers(std::span<const double> values) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const double value : values) out.push_back(json_number(value));
  return out;
}

nlohmann::ordered_json json_pose(const Pose& pose) {
  const auto& [q, t] = pose;
  return {{"translation_m", json_numbers(std::array{t.x, t.y, t.z})},
          {"rotation_xyzw", json_numbers(std::array{q.x, q.y, q.z, q.w})}};
}

}  // namespace lightwell
