// Interpolation between two descriptors of the same probe, and short extrapolation.
#pragma once

#include <lightwell/descriptor.hpp>

namespace lightwell::core {

/// Whether the two can be interpolated: units and calibration are the same.
[[nodiscard]] bool blends(const Descriptor& a, const Descriptor& b);

/// Descriptor at the fraction `f` (0 to 1) between `a` and `b`. Harmonics are interpolated linearly; a band that only
/// one has is zero in the other. Lights with the same track move along the great circle, with linear irradiance; a
/// light that only one has fades. Bounds, coverage and flags are the worse of the two. Sequence, identities and
/// environment map are those of the nearer descriptor; if units or calibration differ, so is everything.
[[nodiscard]] Descriptor interpolated(const Descriptor& a, const Descriptor& b, float f);

/// `newest` with its lights extrapolated: each light that `before` has too is rotated by `f` (>= 0) times its rotation
/// since then, at most by pi. The error bound grows by the change of irradiance. If units or calibration differ:
/// `newest` unchanged.
[[nodiscard]] Descriptor extrapolated(const Descriptor& before, const Descriptor& newest, float f);

}  // namespace lightwell::core
