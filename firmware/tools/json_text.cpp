#include "tools/json_text.hpp"

#include <array>
#include <cmath>

#include <nlohmann/json.hpp>

namespace lightwell {

std::string json_text(const nlohmann::ordered_json& document) {
  return document.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace);
}

nlohmann::ordered_json json_or_null(const std::optional<double>& number) {
  return number ? nlohmann::ordered_json(*number) : nlohmann::ordered_json();
}

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

nlohmann::ordered_json json_pose(const Pose& pose) {
  const auto& [q, t] = pose;
  return {{"translation_m", json_numbers(std::array{t.x, t.y, t.z})},
          {"rotation_xyzw", json_numbers(std::array{q.x, q.y, q.z, q.w})}};
}

}  // namespace lightwell
