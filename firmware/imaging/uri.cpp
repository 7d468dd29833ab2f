#include "imaging/uri.hpp"

#include <algorithm>
#include <numeric>

namespace lightwell {
namespace {

Status bad_uri(std::string_view text, const std::string& what) {
  return {StatusCode::invalid_argument, "camera '" + std::string(text) + "': " + what};
}

bool is_scheme(std::string_view name) {
  return !name.empty() &&
         std::ranges::all_of(name, [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'; });
}

/// Levenshtein distance.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0U : 1U);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

std::size_t common_prefix(std::string_view a, std::string_view b) {
  return static_cast<std::size_t>(std::ranges::mismatch(a, b).in1 - a.begin());
}

}  // namespace

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

  std::string_view query = rest.substr(question + 1);
  for (bool more = true; more;) {
    const std::size_t ampersand = query.find('&');
    more = ampersand != std::string_view::npos;
    const std::string_view item = query.substr(0, ampersand);
    if (more) query.remove_prefix(ampersand + 1);

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

}  // namespace lightwell
