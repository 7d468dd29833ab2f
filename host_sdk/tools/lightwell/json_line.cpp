#include "json_line.hpp"

#include <array>
#include <charconv>
#include <cmath>

namespace lightwell::tool {

std::string json_number(double value) {
  if (!std::isfinite(value)) return "null";
  std::array<char, 32> text{};
  // Integers exactly, other values with six significant digits.
  const auto whole = std::abs(value) < 1e15 && value == std::nearbyint(value);
  const auto [end, error] =
      whole ? std::to_chars(text.data(), text.data() + text.size(), static_cast<long long>(value))
            : std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, 6);
  return {text.data(), end};
}

JsonLine& JsonLine::numbers(std::string_view key, std::span<const float> values) {
  std::string list;
  for (const float value : values) list += (list.empty() ? "" : ",") + json_number(static_cast<double>(value));
  return raw(key, "[" + list + "]");
}

JsonLine& JsonLine::texts(std::string_view key, std::span<const std::string_view> values) {
  std::string list;
  for (const std::string_view value : values) list += (list.empty() ? "" : ",") + json_string(value);
  return raw(key, "[" + list + "]");
}

JsonLine& JsonLine::raw(std::string_view key, std::string_view json) {
  if (!body_.empty()) body_ += ',';
  body_ += json_string(key);
  body_ += ':';
  body_ += json;
  return *this;
}

}  // namespace lightwell::tool
