// JSON numbers; strings are in lightwell/json.hpp.
#pragma once

#include <string>

#include <lightwell/json.hpp>

namespace lightwell::calibrate {

/// The shortest text that gives the same number when parsed; "Infinity" and "NaN" in quotes, as in protobuf's JSON.
[[nodiscard]] std::string json_number(double value);
/// A JSON list, for example "[1, 2]".
template <class Numbers>
[[nodiscard]] std::string json_numbers(const Numbers& values) {
  std::string out;
  for (const double v : values) out += (out.empty() ? "" : ", ") + json_number(v);
  return "[" + out + "]";
}

}  // namespace lightwell::calibrate
