// Command lines of the tools and of the measuring programs, parsed by CLI11; the files and the JSON that they write.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json_fwd.hpp>

#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// Exit status of the tools.
enum Exit : int { kDone = 0, kBadInput = 1, kUsage = 2 };

/// Parses the arguments after the program's name. nullopt if the program goes on; otherwise its exit status: kDone if
/// --help was given and printed, kUsage after wrong usage, which is reported as by wrong_usage(). The report of an
/// unknown option suggests the nearest known one.
[[nodiscard]] std::optional<int> parse_command_line(CLI::App& app, const std::vector<std::string>& arguments);

/// Writes "NAME: what; see --help" to stderr, with the name of the app, and returns kUsage.
[[nodiscard]] int wrong_usage(const CLI::App& app, std::string_view what);

/// Wrong usage that the parser cannot find; ends the work of run_command().
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// An input is wrong, or a file cannot be written; ends the work of run_command().
struct InputError : std::runtime_error {
  explicit InputError(const Status& status) : std::runtime_error(status.message()), code(status.code()) {}
  StatusCode code;
};

/// Throws InputError with invalid_argument.
[[noreturn]] void refuse(const std::string& what);
/// Throws InputError if the status is not ok.
void require(const Status& status);
/// The value of a result; throws InputError if there is none.
template <class T>
[[nodiscard]] T require(Result<T> result) {
  require(result.status());
  return std::move(*result);
}

/// Parses the arguments as parse_command_line() and calls `work`, which returns the exit status. After UsageError the
/// exit status is kUsage, reported by wrong_usage(); after InputError kBadInput, its message is written to stderr after
/// "NAME: ".
[[nodiscard]] int run_command(CLI::App& app, const std::vector<std::string>& arguments,
                              const std::function<int()>& work);

/// write_atomically() with the permissions of the umask; "-" is standard output.
[[nodiscard]] Status write_output(const std::string& path, std::string_view bytes);

/// Accepts numbers that satisfy `holds`. `range` completes the message "'0' is not ...", for example "above 0".
[[nodiscard]] CLI::Validator number_where(const std::string& range, const std::function<bool(double)>& holds);

/// The options and files of a command line in their order. The number counts the values of an option from 0.
[[nodiscard]] std::vector<std::pair<const CLI::Option*, std::size_t>> in_order(const CLI::App& app);

/// An option whose value `parse` converts; `parse` returns a Result<T>, whose message is reported.
template <class T, class Parse>
CLI::Option* add_parsed_option(CLI::App& app, const std::string& name, T& value, Parse parse,
                               const std::string& description) {
  const auto take = [&value, name, parse](const std::string& text) {
    auto parsed = parse(text);
    if (!parsed) throw CLI::ValidationError(name, parsed.status().message());
    value = std::move(*parsed);
  };
  return app.add_option_function<std::string>(name, take, description);
}

/// An option whose value is the name, by to_string(), of one of `values`, which must outlive the app.
template <class T, class Values>
CLI::Option* add_named_option(CLI::App& app, const std::string& name, T& value, const Values& values,
                              const std::string& description) {
  const auto parse = [&values](const std::string& text) -> Result<T> {
    std::string names;
    for (const T known : values) {
      if (to_string(known) == text) return known;
      names += " " + std::string(to_string(known));
    }
    return invalid_argument("'" + text + "' is not known; known are:" + names);
  };
  return add_parsed_option(app, name, value, parse, description);
}

/// The document in one line of ASCII, all other characters escaped. A byte sequence that is not UTF-8 becomes U+FFFD. A
/// number has the shortest text that gives the same double when parsed; NaN and infinity become null.
[[nodiscard]] std::string json_text(const nlohmann::ordered_json& document);

/// The number, or null.
[[nodiscard]] nlohmann::ordered_json json_or_null(const std::optional<double>& number);

/// A number; infinity and NaN are the texts "Infinity", "-Infinity" and "NaN", as in protobuf's JSON.
[[nodiscard]] nlohmann::ordered_json json_number(double value);
/// A list of them.
[[nodiscard]] nlohmann::ordered_json json_numbers(std::span<const double> values);

/// {"translation_m": [x, y, z], "rotation_xyzw": [x, y, z, w]}
[[nodiscard]] nlohmann::ordered_json json_pose(const Pose& pose);

}  // namespace lightwell
