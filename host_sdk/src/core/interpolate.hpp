// Between two descriptors of the same probe, and a little beyond.
#pragma once

#include <lightwell/descriptor.hpp>

namespace lightwell::core {

/// Whether the light of the two can be blended: units and calibration are the same.
[[nodiscard]] bool blends(const Descriptor& a, const Descriptor& b);

/// The light a share `f` (0 to 1) of the way from `a` to `b`. Harmonics blend linearly, a band that
/// only one has from zero. Lights with the same track move along the great circle and blend; a
/// light without its like fades. Bounds, coverage and flags are the worse of the two. What cannot
/// be blended (sequence, identities, environment map) is the nearer one's; where the two differ in
/// units or calibration, so is everything.
[[nodiscard]] Descriptor interpolated(const Descriptor& a, const Descriptor& b, float f);

/// `newest`, whose lights have moved on: those that `before` has, too, by the share `f` (0 or more) of the turn that
/// they made since, half a turn at most. The bound grows by the irradiance that this moves. Where the two differ in
/// units or calibration: `newest`.
[[nodiscard]] Descriptor extrapolated(const Descriptor& before, const Descriptor& newest, float f);

}  // namespace lightwell::core
