// Octahedral map of the sphere onto the unit square (Cigolle et al. 2014, "A Survey of Efficient Representations
// for Independent Unit Vectors", listing 1), with the map's centre at +Y and its corners at -Y.
#pragma once

#include <cmath>

#include <lightwell/geometry.hpp>

namespace lightwell {

struct OctUv {
  float u = 0, v = 0;
};

/// u, v in [0, 1]; u increases with x, v with z. d need not be normalised; zero maps to the centre.
[[nodiscard]] inline OctUv oct_encode(Vec3f d) {
  const float sum = std::abs(d.x) + std::abs(d.y) + std::abs(d.z);
  if (!(sum > 0)) return {0.5F, 0.5F};
  float a = d.x / sum, b = d.z / sum;
  if (d.y < 0) {
    const float folded_a = (1 - std::abs(b)) * std::copysign(1.0F, a);
    b = (1 - std::abs(a)) * std::copysign(1.0F, b);
    a = folded_a;
  }
  return {0.5F * (a + 1), 0.5F * (b + 1)};
}

/// The unit vector at u, v.
[[nodiscard]] inline Vec3f oct_decode(OctUv uv) {
  float a = 2 * uv.u - 1, b = 2 * uv.v - 1;
  const float y = 1 - std::abs(a) - std::abs(b);
  if (y < 0) {
    const float folded_a = (1 - std::abs(b)) * std::copysign(1.0F, a);
    b = (1 - std::abs(a)) * std::copysign(1.0F, b);
    a = folded_a;
  }
  return normalized(Vec3f{a, y, b});
}

}  // namespace lightwell
