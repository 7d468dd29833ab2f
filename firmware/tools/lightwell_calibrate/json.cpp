#include "tools/lightwell_calibrate/json.hpp"

#include <cmath>

#include <nlohmann/json.hpp>

namespace lightwell::calibrate {

nlohmann::ordered_json json_number(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "Infinity" : "-Infinity";
  return value;
}

nlohmann::ordered_json json_numbers(std::span<const double> values) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const double value : values) out.push_back(json_number(value));
  return out;
}

}  // namespace lightwell::calibrate
