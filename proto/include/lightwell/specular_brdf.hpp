// Specular reflection of a rough dielectric surface: a microfacet BRDF, as glTF 2.0 (appendix B) and most renderers
// have.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include <lightwell/geometry.hpp>

namespace lightwell {

/// Cook-Torrance BRDF with the isotropic GGX distribution (Walter et al. 2007, "Microfacet Models for Refraction
/// through Rough Surfaces", eq. 33), height-correlated Smith shadowing (Heitz 2014, "Understanding the
/// Masking-Shadowing Function in Microfacet-Based BRDFs", eq. 99) and Schlick's Fresnel term (Schlick 1994, eq. 15).
struct SpecularBrdf {
  float alpha = 0.1F;  ///< Square of the perceptual roughness, above 0 to 1.
  float f0 = 0.04F;    ///< Reflectance at normal incidence: 0.04 is an index of refraction of 1.5.

  static constexpr float kMinAlpha = 0.005F;

  /// Angle from the mirror direction, at normal incidence, at which the distribution has half its peak: twice that of
  /// the half vector, tan² = (sqrt(2) - 1) alpha².
  [[nodiscard]] static double half_width_rad(double alpha) { return 2 * std::atan(0.6436 * alpha); }

  [[nodiscard]] float fresnel(float v_dot_h) const {
    const float m = std::clamp(1 - v_dot_h, 0.0F, 1.0F), m2 = m * m;
    return f0 + (1 - f0) * m2 * m2 * m;
  }

  /// f(v, l) times n·l, sr⁻¹: multiply by radiance and solid angle. `v`, `l`: unit vectors towards viewer and light in
  /// a frame whose +Z is the surface normal. 0 where one of them is not above the surface.
  [[nodiscard]] float times_cosine(Vec3f v, Vec3f l) const {
    if (!(v.z > 0) || !(l.z > 0)) return 0;
    const Vec3f sum = v + l;
    const float square = dot(sum, sum);
    if (!(square > 0)) return 0;
    const float a2 = std::max(alpha, kMinAlpha) * std::max(alpha, kMinAlpha);
    // tan² of the half vector's angle to the normal, without cancellation near the peak.
    const float across = (sum.x * sum.x + sum.y * sum.y) / square, up = sum.z * sum.z / square;
    const float d = across + a2 * up;
    const float distribution = a2 / (std::numbers::pi_v<float> * d * d);
    // G2 / (4 n·v n·l) = 1 / (2 (n·l sqrt(a2 + (1 - a2) (n·v)²) + n·v sqrt(a2 + (1 - a2) (n·l)²)))
    const float visibility =
        0.5F / (l.z * std::sqrt(a2 + (1 - a2) * v.z * v.z) + v.z * std::sqrt(a2 + (1 - a2) * l.z * l.z));
    // v·h = |v + l| / 2.
    return distribution * visibility * fresnel(0.5F * std::sqrt(square)) * l.z;
  }
};

}  // namespace lightwell
