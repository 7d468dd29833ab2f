#include "estimate/panorama/clipped_lights.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace lightwell::estimate {
namespace {

/// Smallest share of the saturated solid angle that must belong to lights.
constexpr double kMinExplainedFraction = 0.75;
/// A block belongs to a light within twice its radius plus this angle, about the width of a block.
constexpr float kMargin_rad = 0.035F;
/// Smallest share of the assigned saturated solid angle of a clipped light; less is the glow of another light.
constexpr double kMinLightFraction = 0.02;

}  // namespace

int find_clipped_lights(const BlockSums& sums, const CellGrid& grid, std::span<const Light> lights,
                        std::vector<std::uint32_t>& tracks) {
  tracks.clear();
  if (!(sums.clipped_sr > 0)) return -1;
  const std::size_t count = std::min<std::size_t>(lights.size(), kMaxLights + 1);
  std::array<float, kMaxLights + 1> cos_reach{};
  for (std::size_t k = 0; k < count; ++k)
    cos_reach[k] = std::cos(std::min(2 * lights[k].angular_radius_rad + kMargin_rad, 3.0F));
  std::array<double, kMaxLights + 1> clipped_sr{};
  double explained_sr = 0;
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
    explained_sr += sums.clipped[block];
  }
  if (explained_sr < kMinExplainedFraction * sums.clipped_sr) return -1;
  int strongest = -1;
  for (std::size_t k = 0; k < count; ++k) {
    if (!(clipped_sr[k] > kMinLightFraction * explained_sr)) continue;
    if (tracks.empty()) strongest = static_cast<int>(k);
    tracks.push_back(lights[k].track);
  }
  return strongest;
}

}  // namespace lightwell::estimate
