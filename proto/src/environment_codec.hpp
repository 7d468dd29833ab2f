// The environment map between value and generated message.
#pragma once

#include <lightwell/environment.hpp>
#include <lightwell/result.hpp>

#include "lightwell/v1/descriptor.pb.h"

namespace lightwell {

/// invalid_argument, naming the field, for a map that breaks the specification: what is neither sent nor let in.
[[nodiscard]] Status environment_problem(const EnvironmentMap& map);

/// Room for the largest map, so that fill_environment() allocates nothing.
void reserve_environment(v1::EnvironmentMap& m);
/// Replaces what `m` held.
void fill_environment(const EnvironmentMap& map, v1::EnvironmentMap& m);
/// Checks only what a value cannot hold; environment_problem() checks the rest.
[[nodiscard]] Status read_environment(const v1::EnvironmentMap& m, EnvironmentMap& map);

}  // namespace lightwell
