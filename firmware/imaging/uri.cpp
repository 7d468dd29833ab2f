#include "imaging/uri.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>

namespace lightwell {
namespace {

Status bad_uri(std::string_view text, const std::string& what) {
  return invalid_argument("camera '" + std::string(text) + "': " + what);
}

bool is_scheme(std::string_view name) {
  return !name.empty() &&
         std::ranges::all_of(name, [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'; });
}

std::size_t common_prefix(std::string_view a, std::string_view b) {
  return static_cast<std::size_t>(std::ranges::mismatch(a, b).in1 - a.begin());
}

}  // namespace

std::vector<std::string_view> separated(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  while (true) {
    const std::size_t end = text.find(separator);
    parts.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

Result<CameraUri> parse_camera_uri(std::string_view text) {
  CameraUri uri;
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos || !is_scheme(text.substr(0, colon)))
    return bad_uri(text, "no scheme; write scheme:path?key=value, for example replay:room.lwrec?loop=0");
  uri.scheme = text.substr(0, colon);
  const std::string_view rest = text.substr(colon + 1);
  const std::size_t question = rest.find('?');
  uri.path = rest.substr(0, question);
  if (question == std::string_view::npos) return uri;

  for (const std::string_view item : separated(rest.substr(question + 1), '&')) {
    const std::size_t equals = item.find('=');
    if (equals == std::string_view::npos || equals == 0)
      return bad_uri(text, "parameter '" + std::string(item) + "' is not key=value");
    const std::string key(item.substr(0, equals));
    // A repeated key is ambiguous.
    if (std::ranges::any_of(uri.parameters, [&](const auto& p) { return p.first == key; }))
      return bad_uri(text, "parameter '" + key + "' is given twice");
    uri.parameters.emplace_back(key, item.substr(equals + 1));
  }
  return uri;
}

std::string nearest_name(std::string_view name, const std::vector<std::string_view>& known) {
  // Beyond two edits, or a third of the length of a long name, a suggestion would be misleading.
  const std::size_t furthest = std::max<std::size_t>(2, name.size() / 3);
  std::size_t best = furthest + 1, best_prefix = 0;
  std::string nearest;
  for (const std::string_view candidate : known) {
    const std::size_t distance = edit_distance(name, candidate);
    if (distance > furthest || distance >= std::max(name.size(), candidate.size())) continue;
    // Ties: prefer the longer common prefix, because truncated names are more common than a wrong beginning.
    const std::size_t prefix = common_prefix(name, candidate);
    if (distance > best || (distance == best && prefix <= best_prefix)) continue;
    best = distance;
    best_prefix = prefix;
    nearest = candidate;
  }
  return nearest;
}

Status rename_parameters(CameraUri& uri, const std::vector<RenamedParameter>& renamed,
                         std::vector<std::string>& warnings) {
  for (const RenamedParameter& name : renamed) {
    const auto given = [&](std::string_view key) {
      return std::ranges::find_if(uri.parameters, [key](const auto& parameter) { return parameter.first == key; });
    };
    const auto former = given(name.former);
    if (former == uri.parameters.end()) continue;
    const std::string what = "parameter '" + former->first + "' is now called '" + std::string(name.current) + "'";
    if (given(name.current) != uri.parameters.end())
      return bad_uri(uri.scheme + ":" + uri.path, what + ", which is also given: leave '" + former->first + "' out");
    warnings.push_back(what + ": the former name is deprecated");
    former->first = name.current;
  }
  return {};
}

Status check_parameters(const CameraUri& uri, const std::vector<std::string_view>& known) {
  for (const auto& [key, value] : uri.parameters) {
    if (std::ranges::find(known, key) != known.end()) continue;
    std::string message = "no parameter '" + key + "'";
    if (const std::string near = nearest_name(key, known); !near.empty()) message += "; did you mean '" + near + "'?";
    message += known.empty() ? "; this camera takes none" : "; known are:";
    for (const std::string_view name : known) message += " " + std::string(name);
    return bad_uri(uri.scheme + ":" + uri.path, message);
  }
  return {};
}

Result<double> uri_quantity(std::string_view text, std::initializer_list<UriUnit> units) {
  double number = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, number);
  const std::string_view suffix(stop, static_cast<std::size_t>(end - stop));
  std::string known;
  for (const UriUnit& unit : units) {
    if (error == std::errc() && std::isfinite(number) && suffix == unit.suffix) return number * unit.factor;
    if (!unit.suffix.empty()) known += (known.empty() ? "" : ", ") + std::string(unit.suffix);
  }
  return invalid_argument("'" + std::string(text) + "' is not a number" +
                          (known.empty() ? "" : " with a unit (" + known + ")"));
}

Result<double> uri_duration_s(std::string_view text) {
  Result<double> seconds = uri_quantity(text, {{"s", 1}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}, {"", 1}});
  if (seconds && *seconds < 0) return invalid_argument("'" + std::string(text) + "' is negative");
  return seconds;
}

Result<std::vector<double>> uri_durations_s(std::string_view text) {
  std::vector<double> all;
  for (const std::string_view part : separated(text, ',')) {
    const Result<double> one = uri_duration_s(part);
    if (!one) return one.status();
    all.push_back(*one);
  }
  return all;
}

Result<Duration> uri_row_readout(std::string_view text) {
  const Result<double> seconds = uri_quantity(text, {{"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}});
  if (!seconds) return seconds.status();
  if (!(*seconds >= 0 && *seconds <= 0.01))
    return invalid_argument("'" + std::string(text) + "' is not a delay between rows from 0us to 10ms");
  return Duration::from_seconds(*seconds);
}

}  // namespace lightwell
