// Conversion of environment maps to and from the generated message.
#pragma once

#include <lightwell/environment.hpp>
#include <lightwell/result.hpp>

#include "lightwell/v1/descriptor.pb.h"

namespace lightwell {

/// invalid_argument, naming the field, for a map that violates the specification. Checked when encoding and decoding.
[[nodiscard]] Status environment_problem(const EnvironmentMap& map);

/// Reserves memory for the largest map, so that fill_environment() allocates nothing.
void reserve_environment(v1::EnvironmentMap& m);
/// Replaces the content of `m`.
void fill_environment(const EnvironmentMap& map, v1::EnvironmentMap& m);
/// Checks only what the value type cannot represent; environment_problem() checks the rest.
[[nodiscard]] Status read_environment(const v1::EnvironmentMap& m, EnvironmentMap& map);

}  // namespace lightwell
