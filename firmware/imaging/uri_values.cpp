#include "imaging/uri_values.hpp"

#include <charconv>
#include <cmath>
#include <system_error>

namespace lightwell {

namespace {

Status bad(const std::string& what) { return {StatusCode::invalid_argument, what}; }

}  // namespace

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
  return bad("'" + std::string(text) + "' is not a number" + (known.empty() ? "" : " with a unit (" + known + ")"));
}

Result<double> uri_duration_s(std::string_view text) {
  Result<double> seconds = uri_quantity(text, {{"s", 1}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}, {"", 1}});
  if (seconds && *seconds < 0) return bad("'" + std::string(text) + "' is negative");
  return seconds;
}

Result<std::vector<double>> uri_durations_s(std::string_view text) {
  std::vector<double> all;
  for (bool more = true; more;) {
    const std::size_t comma = text.find(',');
    more = comma != std::string_view::npos;
    const Result<double> one = uri_duration_s(text.substr(0, comma));
    if (!one) return one.status();
    all.push_back(*one);
    if (more) text.remove_prefix(comma + 1);
  }
  return all;
}

Result<Duration> uri_row_readout(std::string_view text) {
  const Result<double> seconds = uri_quantity(text, {{"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}});
  if (!seconds) return seconds.status();
  if (!(*seconds >= 0 && *seconds <= 0.01))
    return bad("'" + std::string(text) + "' is not a delay between rows from 0us to 10ms");
  return Duration::from_seconds(*seconds);
}

}  // namespace lightwell
