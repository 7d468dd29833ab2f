// Peer: Debevec, "A Median Cut Algorithm for Light Probe Sampling" (SIGGRAPH 2005 poster): a panorama
// becomes 2^n distant lights of about the same energy.
#pragma once

#include <vector>

#include "bench/equirect_image.hpp"

namespace lightwell::bench {

struct CutLight {
  /// Towards the light, unit: the region's centroid by energy, taken on the sphere (the paper says
  /// "center or centroid"; on the sphere it is right at the poles too). Without energy, the middle.
  Triple direction{};
  Triple irradiance{};  ///< The region's integral of radiance over solid angle: what a receiver facing it gets.
  double solid_angle_sr = 0;
};

/// The paper's steps: the whole picture is one region; `generations` times each region is cut along its
/// longer side (its width weighted by the cosine of its mid-latitude) where the luminance times solid
/// angle of both parts is most nearly equal; each region becomes one light. Sums come from a summed-area
/// table, so a cut costs a binary search. A region of one pixel is not cut: there may be fewer than
/// 2^generations lights. 6 generations are 64 lights.
[[nodiscard]] std::vector<CutLight> median_cut(const EquirectImage& image, int generations = 6);

/// The irradiance that an application computes from them: the sum of irradiance * max(0, n . direction).
[[nodiscard]] Triple irradiance_of(const std::vector<CutLight>& lights, const Triple& normal);

}  // namespace lightwell::bench
