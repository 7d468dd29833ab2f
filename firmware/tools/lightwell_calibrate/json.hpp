// Numbers as JSON has them; texts by lightwell/json.hpp.
#pragma once

#include <string>

#include <lightwell/json.hpp>

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

}  // namespace lightwell::calibrate
