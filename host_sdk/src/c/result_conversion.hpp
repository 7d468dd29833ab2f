// Conversion of results to structs of the C ABI.
#pragma once

#include <lightwell/lighting.hpp>
#include <lightwell/lightwell.h>

namespace lightwell::c {

/// Static string; empty for Validity::valid.
[[nodiscard]] const char* reason_of(Validity validity);

/// The LW_FLAG_ bits.
[[nodiscard]] std::uint32_t bits_of(Flags flags);

template <class T>
[[nodiscard]] lw_answer as_c(const Answer<T>& answer, Units units) {
  lw_answer out{};
  out.size = sizeof out;
  out.validity = static_cast<lw_validity>(answer.validity);
  out.age_ns = answer.age.ns;
  out.reason = reason_of(answer.validity);
  for (int k = 0; k < 3; ++k) out.value[k] = answer.value[k];
  out.error_bound = answer.error_bound;
  out.flags = bits_of(answer.flags);
  out.lights_included = answer.lights == LightsIncluded::yes ? 1 : 0;
  out.units = static_cast<lw_units>(units);
  out.refused = answer.validity == Validity::invalid_query ? 1 : 0;
  return out;
}

[[nodiscard]] lw_lighting_info as_c(const Lighting& lighting);
[[nodiscard]] lw_light as_c(const Light& light);

}  // namespace lightwell::c
