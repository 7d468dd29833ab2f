#include "estimate/panorama/clipped_lights.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

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

GreyPatchReader::GreyPatchReader(const GreyPatch& patch, const RigTable& table, const BlockLayout& layout)
    : patch_(patch), table_(table), layout_(layout), row_(table.lenses[static_cast<std::size_t>(patch.lens)].width) {}

std::optional<DiffuseConstraint> GreyPatchReader::read(RowReader& reader, double factor) {
  if (!reader.has(patch_.lens)) return std::nullopt;
  const LensTable& lens = table_.lenses[static_cast<std::size_t>(patch_.lens)];
  double luminance = 0, pixels = 0;
  ReadStatistics ignored;
  for (int y = patch_.y; y < patch_.y + patch_.height; ++y) {
    // A read must not extend beyond its block.
    for (int x = patch_.x, end = 0; x < patch_.x + patch_.width; x = end) {
      end = std::min((x | (layout_.edge() - 1)) + 1, patch_.x + patch_.width);
      reader.read(patch_.lens, y, x, end, RowReader::Reading::with_clipped, row_, ignored);
      for (int i = 0; i < end - x; ++i) {
        const auto k = static_cast<std::size_t>(i);
        if (!row_.certain && row_.clipped[k] != 0) return std::nullopt;
        if (!(lens.solid_angle[lens.index(x + i, y)] > 0)) continue;
        luminance += luminance_of(row_.r[k], row_.g[k], row_.b[k]);
        ++pixels;
      }
    }
  }
  if (!(luminance > 0) || !std::isfinite(luminance)) return std::nullopt;
  return DiffuseConstraint{patch_.normal, luminance / pixels * std::numbers::pi / patch_.albedo * factor};
}

}  // namespace lightwell::estimate
