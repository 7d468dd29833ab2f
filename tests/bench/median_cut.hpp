// Peer: Debevec, "A Median Cut Algorithm for Light Probe Sampling" (SIGGRAPH 2005 poster): converts a panorama to 2^n
// distant lights of about equal energy.
#pragma once

#include <vector>

#include "bench/equirect_image.hpp"

namespace lightwell::bench {

struct CutLight {
  /// Towards the light, unit: the region's energy-weighted centroid on the sphere (the paper says "center or centroid";
  /// on the sphere it is also correct at the poles). For a region without energy, its centre.
  Triple direction{};
  Triple irradiance{};  ///< At normal incidence: the integral of the region's radiance over solid angle.
  double solid_angle_sr = 0;
};

/// The paper's algorithm: the whole image is one region; `generations` times, each region is cut across its longer side
/// (the width weighted by the cosine of the mid-latitude) so that luminance times solid angle of both parts is as equal
/// as possible; each region becomes one light. A summed-area table gives the sums, so a cut costs a binary search. A
/// region of one pixel is not cut, so there may be fewer than 2^generations lights. 6 generations give 64 lights.
[[nodiscard]] std::vector<CutLight> median_cut(const EquirectImage& image, int generations = 6);

/// The irradiance that an application computes: the sum of irradiance * max(0, n . direction).
[[nodiscard]] Triple irradiance_of(const std::vector<CutLight>& lights, const Triple& normal);

}  // namespace lightwell::bench
