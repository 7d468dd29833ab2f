// Specular reflection of satin paper, measured on the black ink of the tags.
#pragma once

#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

/// Subtracts each face's specular reflection from the irradiance of its samples, and widens their sigma.
/// A face of diffuse albedo a and specular radiance s has the radiance a E / pi + s; s is that of ink and paper alike
/// (a clear surface over both), so that ink gives it. The ink's albedo is the smallest that the faces with ink show, at
/// most kMaxInkAlbedo: a face without specular reflection then keeps its irradiance, and a specular part that all faces
/// have in common stays, up to that limit. Samples of faces without usable ink keep theirs, too; the median specular
/// share of the other faces is added to their sigma in quadrature.
void subtract_gloss(Shading& shading);

/// Largest albedo of black ink: a solid black of laser and inkjet prints has an optical density of 1.35 or more.
inline constexpr double kMaxInkAlbedo = 0.045;

}  // namespace lightwell::marker
