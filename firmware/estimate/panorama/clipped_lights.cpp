#include "estimate/panorama/clipped_lights.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace lightwell::estimate {
namespace {

/// Reading saturated blocks again must not cost more than the frame itself: a picture with more of them is no lamp's.
constexpr int kMostBlocks = 256;
/// Blocks whose peak is fainter than this share of the brightest are left alone; their part is then missing, and counted.
constexpr float kFaintest = 0.05F;
/// So much of the saturated solid angle must belong to lights.
constexpr double kMostOfIt = 0.75;
/// Of a light, what lies within twice its radius and this much.
constexpr float kReachRad = 0.035F;

int widest(const RigTable& table) {
  int w = 0;
  for (const LensTable& lens : table.lenses) w = std::max(w, lens.width);
  return w;
}

}  // namespace

ClippedLights::ClippedLights(const RigTable& table) : table_(table), row_(widest(table)) {}

void ClippedLights::find(RowReader& reader, const BlockLayout& layout, const BlockSums& sums,
                         std::span<const Light> lights, std::vector<std::uint32_t>& tracks) {
  tracks.clear();
  const float brightest = *std::max_element(sums.peak.begin(), sums.peak.end());
  std::array<double, kMaxLights + 1> clipped_sr{};
  double known_sr = 0;
  int blocks = 0;
  ReadingCounts ignored;
  for (std::size_t block = 0; block < layout.size() && blocks < kMostBlocks; ++block) {
    if (!(sums.peak[block] > kFaintest * brightest)) continue;
    const BlockLayout::Place p = layout.place(block);
    if (sums.clipped_row[layout.row_of(p.lens, p.y)] == 0) continue;
    ++blocks;
    const LensTable& lens = table_.lenses[static_cast<std::size_t>(p.lens)];
    for (int y = p.y; y < p.y + p.height; ++y) {
      reader.read(p.lens, y, p.x, p.x + p.width, row_, ignored);
      if (row_.certain) continue;
      for (int x = 0; x < p.width; ++x) {
        const std::size_t at = static_cast<std::size_t>(y) * static_cast<std::size_t>(lens.width) + static_cast<std::size_t>(p.x + x);
        if (row_.clipped[static_cast<std::size_t>(x)] == 0 || !(lens.solid_angle[at] > 0)) continue;
        std::size_t nearest = lights.size();
        float best = 0;
        for (std::size_t k = 0; k < lights.size() && k < clipped_sr.size(); ++k) {
          const float reach = std::min(2 * lights[k].angular_radius_rad + kReachRad, 3.0F);
          const float within = dot(lights[k].direction, lens.direction[at]) - std::cos(reach);
          if (within < 0 || (nearest < lights.size() && within <= best)) continue;
          nearest = k;
          best = within;
        }
        if (nearest == lights.size()) continue;
        clipped_sr[nearest] += lens.solid_angle[at];
        known_sr += lens.solid_angle[at];
      }
    }
  }
  if (known_sr < kMostOfIt * sums.clipped_sr) return;
  for (std::size_t k = 0; k < lights.size() && k < clipped_sr.size(); ++k)
    if (clipped_sr[k] > 0.02 * known_sr) tracks.push_back(lights[k].track);
}

}  // namespace lightwell::estimate
