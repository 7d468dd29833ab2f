// A capture as the value that clients receive.
#pragma once

#include <lightwell/captured_plane.hpp>

#include "estimate/specular/gloss_estimate.hpp"
#include "estimate/specular/plane_capture.hpp"

namespace lightwell::specular {

/// Fills texture, lumisphere and coverage of `out`, its size, `texture_to_plane` and gloss; reuses its memory. Radiance
/// is that of the capture times `scale`, where it is negative 0. The texture is ReflectanceSeparation::diffuse(). An
/// even number of more than kMaxSentLevels levels of the lumisphere is halved: every second node, exactly. Unseen
/// directions have GlossEstimate::predicted(), or the mean of their neighbours. `gloss`: the last estimate; null, or
/// not glossy: `gloss_alpha` and `f0` are not known. Identity, time, units and pose of `out` stay as they are.
void fill_captured_plane(const PlaneCapture& capture, const GlossEstimate* gloss, float scale, CapturedPlane& out);

/// The lumisphere changes with every sweep, and then all of it is sent: 31 KB at 60 levels, 123 KB at 120.
inline constexpr int kMaxSentLevels = 60;

}  // namespace lightwell::specular
