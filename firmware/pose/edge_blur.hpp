// Blur of the picture across a tag's edge. Private to firmware/pose.
#pragma once

#include <optional>

#include "pose/edge_fit.hpp"

namespace lightwell {

/// Standard deviation of the blur across a traced edge, px: of a Gaussian, beside the area of a pixel. Lens, focus,
/// motion and demosaicing have one value together. 0 to kMaxEdgeBlur_px. `sign` as in trace_edge().
///
/// The mean profile along the edge is fitted as the sum of blurred steps at the edge and at a cell's width on both
/// sides of it. What lies there varies along the edge (data cells, paper), but its mean is a step again. Blur that is
/// as wide as half a cell is therefore measured, too. nullopt: the contrast has not this sign or is too small, or the
/// profile extends outside of the picture.
[[nodiscard]] std::optional<double> measure_blur(const LinearPicture& picture, const Edge& edge, double sign);

/// The largest value that measure_blur() distinguishes.
inline constexpr double kMaxEdgeBlur_px = 4;

}  // namespace lightwell
