#include "estimate/panorama/light_texels.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <lightwell/cap.hpp>
#include <lightwell/descriptor.hpp>

namespace lightwell::estimate {
namespace {

/// The choice changes where the errors of the other one are below this share of those of the last one.
constexpr double kClearlyBetter = 0.8;

/// Least weight of texels that pixels fill (TexelSums::run()).
constexpr float kObserved = 0.99F;

}  // namespace

LightTexels::LightTexels(const RigTable& table, const BlockLayout& layout, const CellGrid& cells,
                         const OctahedralGrid& grid, int edge)
    : table_(table),
      layout_(layout),
      cells_(cells),
      grid_(grid),
      edge_(edge),
      pixel_rad_(static_cast<float>(pixel_side(table))),
      block_rad_(pixel_rad_ * static_cast<float>(layout.edge())),
      solid_angle_(static_cast<std::size_t>(edge) * static_cast<std::size_t>(edge)),
      with_(solid_angle_.size()),
      added_(grid.texels()),
      used_(solid_angle_.size()),
      row_(max_image_width(table)) {
  for (std::size_t k = 0; k < grid.texels(); ++k) solid_angle_[level_texel(k)] += grid.solid_angle[k];
  without_.reserve(with_.size());
  near_.reserve(grid.texels());
  tracks_.reserve(kMaxLights);
  last_tracks_.reserve(kMaxLights);
  caps_.reserve(kMaxLights);
  last_caps_.reserve(kMaxLights);
}

std::size_t LightTexels::level_texel(std::size_t grid_texel) const {
  const auto edge = static_cast<std::size_t>(grid_.edge), part = edge / static_cast<std::size_t>(edge_);
  return grid_texel / edge / part * static_cast<std::size_t>(edge_) + grid_texel % edge / part;
}

void LightTexels::begin(std::span<const Rgbx> texels) {
  std::fill(with_.begin(), with_.end(), Rgbx{});
  for (std::size_t k = 0; k < texels.size(); ++k) {
    const std::size_t level = level_texel(k);
    const auto share = static_cast<float>(grid_.solid_angle[k] / solid_angle_[level]);
    for (std::size_t c = 0; c < 4; ++c) with_[level].v[c] += share * texels[k].v[c];
  }
  without_ = with_;
  std::fill(added_.begin(), added_.end(), Rgbx{});
  std::fill(used_.begin(), used_.end(), std::uint8_t{0});
  used_count_ = 0;
  std::swap(tracks_, last_tracks_);
  std::swap(caps_, last_caps_);
  tracks_.clear();
  caps_.clear();
}

void LightTexels::add(const Light& light, float radiance_per_unit, std::span<const LightSubtraction::Removal> removal,
                      RowReader& reader) {
  near_.clear();
  for (const LightSubtraction::Removal& r : removal) {
    const std::size_t level = level_texel(r.texel);
    const auto share = static_cast<float>(grid_.solid_angle[r.texel] / solid_angle_[level]);
    for (std::size_t c = 0; c < 3; ++c) without_[level].v[c] -= share * r.removed[c];
    near_.push_back(static_cast<std::uint32_t>(level));
  }
  std::ranges::sort(near_);
  near_.erase(std::ranges::unique(near_).begin(), near_.end());
  const auto more =
      static_cast<std::size_t>(std::ranges::count_if(near_, [this](std::uint32_t level) { return used_[level] == 0; }));
  const bool observed =
      std::ranges::all_of(near_, [this](std::uint32_t level) { return with_[level].v[3] >= kObserved; });
  for (const std::uint32_t level : near_)
    for (float& v : without_[level].v) v = std::max(v, 0.0F);
  const bool fits =
      !removal.empty() && used_count_ + more <= kMaxTexels && tracks_.size() < kMaxLights && light.track != 0;
  const auto was_in = [&](const std::vector<std::uint32_t>& tracks) {
    return std::ranges::find(tracks, light.track) != tracks.end();
  };
  const double factor = was_in(last_tracks_) ? kClearlyBetter : was_in(last_caps_) ? 1 / kClearlyBetter : 1;
  if (!fits || !observed || cap_is_better(light, radiance_per_unit, factor, reader)) {
    if (caps_.size() < kMaxLights) caps_.push_back(light.track);
  } else {
    for (const LightSubtraction::Removal& r : removal)
      for (std::size_t c = 0; c < 3; ++c) added_[r.texel].v[c] += r.removed[c];
    for (const std::uint32_t level : near_) used_[level] = 1;
    used_count_ += more;
    tracks_.insert(std::ranges::upper_bound(tracks_, light.track), light.track);
  }
  for (const std::uint32_t level : near_) without_[level] = with_[level];
}

void LightTexels::SquaredErrors::add(float sr, float pixel, float shown) {
  const double difference = static_cast<double>(pixel) - static_cast<double>(shown);
  const double of_roots = std::sqrt(std::max(static_cast<double>(pixel), 0.0)) - std::sqrt(static_cast<double>(shown));
  radiance += static_cast<double>(sr) * difference * difference;
  root += static_cast<double>(sr) * of_roots * of_roots;
}

bool LightTexels::cap_is_better(const Light& light, float radiance_per_unit, double factor, RowReader& reader) {
  const auto texel_rad = static_cast<float>(std::sqrt(kSphere)) / static_cast<float>(edge_);
  // A cap narrower than a pixel is compared as if it filled one.
  const float rho = std::max(light.angular_radius_rad, 0.5F * pixel_rad_);
  const float inner = std::cos(std::max(rho - 0.5F * pixel_rad_, 0.0F)), outer = std::cos(rho + 0.5F * pixel_rad_);
  const Irradiance radiance =
      light.irradiance * (radiance_per_unit / static_cast<float>(cap_vector_irradiance(static_cast<double>(rho))));
  const float reach = std::min(rho + 2 * texel_rad, std::numbers::pi_v<float>);
  const float least = std::cos(reach);
  const float least_of_blocks = std::cos(std::min(reach + block_rad_, std::numbers::pi_v<float>));
  // Half a dozen places across a texel are enough, but all pixels of a cap that is narrower than a texel.
  const int step = std::max(1, static_cast<int>(texel_rad / pixel_rad_ / 6));
  const float least_of_all = rho < texel_rad ? std::cos(rho + pixel_rad_) : 2;
  const float least_of_all_blocks = rho < texel_rad ? std::cos(rho + pixel_rad_ + block_rad_) : 2;
  SquaredErrors of_cap, of_texels;
  ReadStatistics ignored;
  for (std::size_t block = 0; block < layout_.size(); ++block) {
    const float of_block = dot(cells_.direction(block), light.direction);
    if (of_block < least_of_blocks) continue;
    const BlockLayout::Place& p = layout_.place(block);
    if (!reader.has(p.lens)) continue;
    const LensTable& lens = table_.lenses[static_cast<std::size_t>(p.lens)];
    for (int y = p.y; y < p.y + p.height; ++y) {
      if (y % step != 0 && of_block < least_of_all_blocks) continue;
      reader.read(p.lens, y, p.x, p.x + p.width, RowReader::Reading::radiance, row_, ignored);
      for (int x = 0; x < p.width; ++x) {
        const std::size_t at = lens.index(p.x + x, y);
        const Vec3f d = lens.direction[at];
        const float cosine = dot(d, light.direction);
        const bool each = cosine >= least_of_all, sampled = y % step == 0 && (p.x + x) % step == 0;
        if (cosine < least || !(each || sampled) || !(lens.solid_angle[at] > 0)) continue;
        const float sr = lens.solid_angle[at] * static_cast<float>(each ? 1 : step * step);
        const TexelCorners corners = corners_around(edge_, oct_encode(d));
        const float covered = std::clamp((cosine - outer) / (inner - outer), 0.0F, 1.0F);
        const std::array<float, 3> pixel = {row_.r[static_cast<std::size_t>(x)], row_.g[static_cast<std::size_t>(x)],
                                            row_.b[static_cast<std::size_t>(x)]};
        for (std::size_t c = 0; c < 3; ++c) {
          const float texels = corners.bilinear([&](std::size_t k) { return with_[k].v[c]; });
          const float cap = corners.bilinear([&](std::size_t k) { return without_[k].v[c]; }) +
                            covered * radiance[static_cast<int>(c)];
          of_texels.add(sr, pixel[c], texels);
          of_cap.add(sr, pixel[c], cap);
        }
      }
    }
  }
  return of_cap.below(of_texels, factor);
}

LightsInTexels LightTexels::chosen() { return {tracks_, tracks_.empty() ? std::span<const Rgbx>() : added_}; }

}  // namespace lightwell::estimate
