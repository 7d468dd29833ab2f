#include "tools/lightwell_calibrate/json.hpp"

#include <array>
#include <charconv>
#include <cmath>

namespace lightwell::calibrate {

std::string json_number(double value) {
  if (std::isnan(value)) return "\"NaN\"";
  if (std::isinf(value)) return value > 0 ? "\"Infinity\"" : "\"-Infinity\"";
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

}  // namespace lightwell::calibrate
