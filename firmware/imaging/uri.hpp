// Camera URIs, "scheme:path?key=value&key=value", and the values of their parameters.
#pragma once

#include <initializer_list>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lightwell/result.hpp>
#include <lightwell/text.hpp>
#include <lightwell/time.hpp>

namespace lightwell {

struct CameraUri {
  std::string scheme;
  std::string path;
  std::vector<std::pair<std::string, std::string>> parameters;  ///< In the order written.
};

/// invalid_argument if the scheme is missing, a parameter has no '=', or a parameter occurs twice.
[[nodiscard]] Result<CameraUri> parse_camera_uri(std::string_view text);

/// The parts between the separators; one empty part for an empty text.
[[nodiscard]] std::vector<std::string_view> separated(std::string_view text, char separator);

/// The name in `known` with the smallest edit distance (Levenshtein), or empty if that distance is too large.
[[nodiscard]] std::string nearest_name(std::string_view name, const std::vector<std::string_view>& known);

/// A parameter that had another name, which is still accepted.
struct RenamedParameter {
  std::string_view former, current;
};

/// Replaces former names of parameters by the current ones, with warnings. invalid_argument if both names are given.
[[nodiscard]] Status rename_parameters(CameraUri& uri, const std::vector<RenamedParameter>& renamed,
                                       std::vector<std::string>& warnings);

/// invalid_argument for the first parameter that is not in `known`; the message suggests the nearest known name.
[[nodiscard]] Status check_parameters(const CameraUri& uri, const std::vector<std::string_view>& known);

// Values of parameters. invalid_argument quotes the text and the accepted form. NaN and infinity are refused.

struct UriUnit {
  std::string_view suffix;  ///< Empty for a number without unit.
  double factor;
};

/// A number followed by one of the units; the result is in the unit whose factor is 1.
[[nodiscard]] Result<double> uri_quantity(std::string_view text, std::initializer_list<UriUnit> units);

/// A number from `least` to `most`.
template <class T>
[[nodiscard]] Result<T> uri_number(std::string_view text, T least, T most) {
  if (const std::optional<T> value = parse_number<T>(text); value && *value >= least && *value <= most) return *value;
  std::ostringstream what;
  what << "'" << text << "' is not a number from " << least << " to " << most;
  return invalid_argument(what.str());
}

/// "1.5ms", "200us", "40ns", "0.01s"; a number without unit is in seconds. Not negative.
[[nodiscard]] Result<double> uri_duration_s(std::string_view text);
/// Durations separated by commas: "1ms,8ms".
[[nodiscard]] Result<std::vector<double>> uri_durations_s(std::string_view text);
/// Delay between successive rows of a rolling shutter, 0 to 10 ms: "18.5us".
[[nodiscard]] Result<Duration> uri_row_readout(std::string_view text);

}  // namespace lightwell
