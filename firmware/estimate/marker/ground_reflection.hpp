// Light that the ground plane (the table) reflects onto the body, computed from its radiance in the image.
#pragma once

#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

/// Sets SurfaceSample::from_ground: the irradiance by the patches of the ground plane. Both kinds of samples must be in
/// the same units. Patches that the body or the image's edge hides get the mean radiance of the visible ones at the
/// same distance from the body.
void estimate_ground_reflection(Shading& shading);

/// Subtracts from_ground from the faces' irradiance, at most down to 0, and adds a fifth of it to the samples' sigma in
/// quadrature. For the hypothesis that the surroundings are a ground plane.
void subtract_ground_reflection(Shading& shading);

}  // namespace lightwell::marker
