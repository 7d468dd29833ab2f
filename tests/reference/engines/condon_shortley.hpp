// Real spherical harmonics with the Condon-Shortley phase, by their definition.
#pragma once

#include "reference/vector.hpp"

namespace lightwell::reference::engines {

/// Y_l^m at a unit direction, polar axis z: sqrt(2) K P_l^|m|(cos theta) times cos(m phi) for m > 0 and sin(|m| phi)
/// for m < 0, K P_l for m = 0, K = sqrt((2l+1) (l-|m|)! / (4 pi (l+|m|)!)), and the phase (-1)^m inside P_l^|m|.
/// Sloan, "Stupid Spherical Harmonics (SH) Tricks" (2008), appendix A1 and A2, lists the same functions up to l = 5.
double condon_shortley(int l, int m, const V3& d);

}  // namespace lightwell::reference::engines
