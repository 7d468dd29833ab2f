// The second factor of the split sum: directional albedo of GGX.
#pragma once

#include <array>

#include "ar_viewer/gl_objects.hpp"

namespace lightwell::viewer {

/// Reflectance of a surface in uniform radiance: factor[0] F0 + factor[1], for Schlick's Fresnel factor, GGX and
/// Smith's height-correlated shadowing (Heitz 2014). nv: cosine of the angle between normal and eye, 0 to 1; perceptual
/// roughness. Karis 2013, "Real Shading in Unreal Engine 4", environment BRDF.
[[nodiscard]] std::array<float, 2> directional_albedo(double nv, double roughness);

/// The table of both factors, s: nv, t: roughness.
[[nodiscard]] GlTexture make_split_sum_table();

}  // namespace lightwell::viewer
