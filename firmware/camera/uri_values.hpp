// Values of a camera URI's parameters: numbers in a range, and numbers with a unit.
//   uri_number  uri_quantity  uri_duration_s  uri_durations_s  uri_row_readout
// Each refuses with the text and what it should have been; none takes NaN or infinity.
#pragma once

#include <charconv>
#include <initializer_list>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <lightwell/result.hpp>
#include <lightwell/time.hpp>

namespace lightwell {

struct UriUnit {
  std::string_view suffix;  ///< Empty for a bare number.
  double factor;
};

/// A number and one of the units, in the unit whose factor is 1.
[[nodiscard]] Result<double> uri_quantity(std::string_view text, std::initializer_list<UriUnit> units);

/// A number from `least` to `most`.
template <class T>
[[nodiscard]] Result<T> uri_number(std::string_view text, T least, T most) {
  T value{};
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  // Written so that NaN is refused, too.
  if (error == std::errc() && stop == end && value >= least && value <= most) return value;
  std::ostringstream what;
  what << "'" << text << "' is no number from " << least << " to " << most;
  return Status(StatusCode::invalid_argument, what.str());
}

/// "1.5ms", "200us", "40ns", "0.01s"; a bare number is seconds. Not negative.
[[nodiscard]] Result<double> uri_duration_s(std::string_view text);
/// Durations between commas: "1ms,8ms".
[[nodiscard]] Result<std::vector<double>> uri_durations_s(std::string_view text);
/// From one row's exposure to the next row's, with its unit, up to 10 ms: "18.5us".
[[nodiscard]] Result<Duration> uri_row_readout(std::string_view text);

/// Puts a value in its place, or says why there is none.
template <class T, class U>
[[nodiscard]] Status assign(T& target, Result<U> value) {
  if (!value) return value.status();
  target = std::move(*value);
  return {};
}

}  // namespace lightwell
