// Samples of a face on which something else lies: another object, or its shadow.
#pragma once

#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

/// Leaves each face without what lies over a part of it: light changes along a face like a plane, and most of its
/// samples agree on one. The plane through three samples from which the median differs least (Rousseeuw 1984, least
/// median of squares). How many were left out.
int remove_occluded_samples(Shading& shading);

}  // namespace lightwell::marker
