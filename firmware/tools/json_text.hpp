// JSON of the tools and of the measuring programs.
#pragma once

#include <optional>
#include <span>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include <lightwell/geometry.hpp>

namespace lightwell {

/// The document in one line of ASCII, all other characters escaped. A byte sequence that is not UTF-8 becomes U+FFFD. A
/// number has the shortest text that gives the same double when parsed; NaN and infinity become null.
[[nodiscard]] std::string json_text(const nlohmann::ordered_json& document);

/// The number, or null.
[[nodiscard]] nlohmann::ordered_json json_or_null(const std::optional<double>& number);

/// A number; infinity and NaN are the texts "Infinity", "-Infinity" and "NaN", as in protobuf's JSON.
[[nodiscard]] nlohmann::ordered_json json_number(double value);
/// A list of them.
[[nodiscard]] nlohmann::ordered_json json_numbers(std::span<const double> values);

/// {"translation_m": [x, y, z], "rotation_xyzw": [x, y, z, w]}
[[nodiscard]] nlohmann::ordered_json json_pose(const Pose& pose);

}  // namespace lightwell
