// Numbers in JSON.
#pragma once

#include <span>

#include <nlohmann/json_fwd.hpp>

namespace lightwell::calibrate {

/// A number; infinity and NaN, which JSON cannot represent, are the texts "Infinity", "-Infinity" and "NaN", as in
/// protobuf's JSON.
[[nodiscard]] nlohmann::ordered_json json_number(double value);
/// A list of them.
[[nodiscard]] nlohmann::ordered_json json_numbers(std::span<const double> values);

}  // namespace lightwell::calibrate
