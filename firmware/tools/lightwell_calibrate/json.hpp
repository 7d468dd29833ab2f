// Numbers and texts as JSON has them.
#pragma once

#include <string>
#include <string_view>

namespace lightwell::calibrate {

/// The shortest text that reads back as the same number; "Infinity" and "NaN" in quotes, as protobuf's JSON has them.
[[nodiscard]] std::string json_number(double value);
/// "[1, 2]"
template <class Numbers>
[[nodiscard]] std::string json_numbers(const Numbers& values) {
  std::string out;
  for (const double v : values) out += (out.empty() ? "" : ", ") + json_number(v);
  return "[" + out + "]";
}
[[nodiscard]] std::string json_string(std::string_view text);

}  // namespace lightwell::calibrate
