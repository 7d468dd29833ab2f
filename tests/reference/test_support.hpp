// Helpers of the reference implementation's own tests. Each tolerance there has its reason beside it.
#pragma once

#include "reference/vector.hpp"

namespace lightwell::reference {

/// Some hundred units in the last place of a double (2e-16): the tolerance for values of about one after
/// a few dozen operations.
inline constexpr double rounding = 1e-13;

inline double distance(const V3& a, const V3& b) { return length(a - b); }

/// A smooth, positive scene without symmetry: polynomials up to degree 3.
inline Rgb smooth_scene(const V3& d) {
  return {2 + d.x + 0.5 * d.y * d.z, 1.5 + d.y - 0.3 * d.x * d.x, 3 + d.z + d.x * d.y * d.z};
}

}  // namespace lightwell::reference
