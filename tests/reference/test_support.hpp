// What the self tests of the oracles share. Each tolerance there has its reason beside it.
#pragma once

#include "reference/vector.hpp"

namespace lightwell::reference {

/// Some hundred units in the last place of a double (2e-16): for values of about one that went
/// through a few dozen operations.
inline constexpr double rounding = 1e-13;

inline double distance(const V3& a, const V3& b) { return length(a - b); }

/// A scene that is smooth, positive and without symmetry: polynomials of degree 3 at most.
inline Rgb smooth_scene(const V3& d) {
  return {2 + d.x + 0.5 * d.y * d.z, 1.5 + d.y - 0.3 * d.x * d.x, 3 + d.z + d.x * d.y * d.z};
}

}  // namespace lightwell::reference
