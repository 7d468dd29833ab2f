// Between two descriptors of the same probe.
#pragma once

#include <lightwell/descriptor.hpp>

namespace lightwell::core {

/// The light a share `f` (0 to 1) of the way from `a` to `b`. Harmonics blend linearly, a band that
/// only one has from zero. Lights with the same track move along the great circle and blend; a
/// light without its like fades. Bounds, coverage and flags are the worse of the two. What cannot
/// be blended (sequence, identities, environment map) is the nearer one's; where the two differ in
/// units or calibration, so is everything.
[[nodiscard]] Descriptor interpolated(const Descriptor& a, const Descriptor& b, float f);

}  // namespace lightwell::core
