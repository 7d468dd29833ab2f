// Removes samples of a face that another object or its shadow covers.
#pragma once

#include "estimate/marker/shading.hpp"

namespace lightwell::marker {

/// Removes outliers per flat face and returns their number. Irradiance along a face is approximately linear: the plane
/// through three samples with the smallest median absolute residual is the fit (Rousseeuw 1984, "Least median of
/// squares regression"). Faces with fewer than six samples are unchanged.
int remove_occluded_samples(Shading& shading);

}  // namespace lightwell::marker
