#include "estimate/panorama/clipped_lights.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace lightwell::estimate {
namespace {

/// So much of the saturated solid angle must belong to lights.
constexpr double kMinExplainedFraction = 0.75;
/// Of a light, what lies within twice its radius and this much: a block is that wide.
constexpr float kReachRad = 0.035F;
/// Saturated by a light that has less than this share of it: of a neighbour's glow.
constexpr double kMinLightFraction = 0.02;

}  // namespace

void find_clipped_lights(const BlockSums& sums, const CellGrid& grid, std::span<const Light> lights,
                         std::vector<std::uint32_t>& tracks) {
  tracks.clear();
  const std::size_t count = std::min<std::size_t>(lights.size(), kMaxLights + 1);
  std::array<float, kMaxLights + 1> cos_reach{};
  for (std::size_t k = 0; k < count; ++k)
    cos_reach[k] = std::cos(std::min(2 * lights[k].angular_radius_rad + kReachRad, 3.0F));
  std::array<double, kMaxLights + 1> clipped_sr{};
  double known_sr = 0;
  for (std::size_t block = 0; block < sums.clipped.size(); ++block) {
    if (!(sums.clipped[block] > 0)) continue;
    std::size_t nearest = count;
    float best = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const float within = dot(lights[k].direction, grid.direction(block)) - cos_reach[k];
      if (within < 0 || (nearest < count && within <= best)) continue;
      nearest = k;
      best = within;
    }
    if (nearest == count) continue;
    clipped_sr[nearest] += sums.clipped[block];
    known_sr += sums.clipped[block];
  }
  if (known_sr < kMinExplainedFraction * sums.clipped_sr) return;
  for (std::size_t k = 0; k < count; ++k)
    if (clipped_sr[k] > kMinLightFraction * known_sr) tracks.push_back(lights[k].track);
}

}  // namespace lightwell::estimate
