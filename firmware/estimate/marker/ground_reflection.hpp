// Light that the table sends to the body: seen in the picture, so that it need not be guessed.
#pragma once

#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

/// Tells each sample of the faces the irradiance that comes from the table's samples, a small part of the plane each.
/// Radiance of the samples of both is in the same units. Where the body or the picture's edge hides the table, what is
/// seen of it at the same distance from the body stands in.
void estimate_ground_reflection(Shading& shading);

/// Takes what was found out of the faces' irradiance: for who takes what lies around the body for a table. It is not
/// quite sure: a fifth of it goes into the samples' deviation.
void subtract_ground_reflection(Shading& shading);

}  // namespace lightwell::marker
