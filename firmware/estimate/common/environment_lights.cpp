#include "estimate/common/environment_lights.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <lightwell/cap.hpp>

namespace lightwell::estimate {
namespace {

/// The surroundings of a narrow light: texels with a centre at most this many texels beyond those that it reaches.
constexpr float kSurroundingsTexels = 1.5F;

}  // namespace

LightSubtraction::LightSubtraction(const OctahedralGrid& grid)
    : grid_(grid), texel_rad_(static_cast<float>(std::sqrt(kSphere)) / static_cast<float>(grid.edge)) {
  centre_.reserve(grid.texels());
  for (int j = 0; j < grid.edge; ++j)
    for (int i = 0; i < grid.edge; ++i) centre_.push_back(texel_direction(grid.edge, i, j));
  near_.reserve(grid.texels());
}

void LightSubtraction::find_near(Vec3f direction, float reach_rad) {
  near_.clear();
  const float least = std::cos(std::min(reach_rad, std::numbers::pi_v<float>));
  for (std::size_t texel = 0; texel < centre_.size(); ++texel) {
    const float cosine = dot(centre_[texel], direction);
    if (cosine >= least)
      near_.push_back({static_cast<std::uint32_t>(texel), std::acos(std::clamp(cosine, -1.0F, 1.0F)), {}});
  }
}

void LightSubtraction::remove_excess(const Light& light, float radiance_per_unit, float share,
                                     std::span<const Rgbx> texels) {
  const float reach = light.angular_radius_rad + texel_rad_;
  for (std::size_t k = 0; k < 3; ++k) {
    double around = 0, around_sr = 0, excess = 0;
    for (const Removal& n : near_)
      if (n.angle > reach && n.angle <= reach + kSurroundingsTexels * texel_rad_) {
        around += grid_.solid_angle[n.texel] * texels[n.texel].v[k];
        around_sr += grid_.solid_angle[n.texel];
      }
    const float background = around_sr > 0 ? static_cast<float>(std::max(around / around_sr, 0.0)) : 0;
    const auto excess_of = [&](const Removal& n) {
      return n.angle <= reach ? std::max(texels[n.texel].v[k] - background, 0.0F) : 0.0F;
    };
    for (const Removal& n : near_) excess += grid_.solid_angle[n.texel] * excess_of(n);
    if (!(excess > 0)) continue;
    const double wanted = static_cast<double>(light.irradiance[static_cast<int>(k)]) * radiance_per_unit;
    const auto part = share * static_cast<float>(std::clamp(wanted / excess, 0.0, 1.0));
    for (Removal& n : near_) n.removed[k] += part * excess_of(n);
  }
}

void LightSubtraction::remove_cap(const Light& light, float radiance_per_unit, float share) {
  // The rim is a ramp as wide as the distance of two samples, so that a cap that moves changes texels gradually.
  const float ramp = texel_rad_ / static_cast<float>(grid_.samples);
  const float rho = light.angular_radius_rad;
  const float inner = std::cos(std::max(rho - ramp / 2, 0.0F)), outer = std::cos(rho + ramp / 2);
  const auto radiance = share * radiance_per_unit / static_cast<float>(cap_vector_irradiance(rho));
  for (Removal& n : near_) {
    double covered = 0;
    for (std::size_t s = n.texel * grid_.per_texel(); s < (n.texel + 1) * grid_.per_texel(); ++s) {
      const OctahedralGrid::Sample& sample = grid_.sample[s];
      const float cosine = dot(sample.direction, light.direction);
      covered += sample.solid_angle * std::clamp((cosine - outer) / (inner - outer), 0.0F, 1.0F);
    }
    const auto mean = static_cast<float>(covered / grid_.solid_angle[n.texel]) * radiance;
    for (int k = 0; k < 3; ++k) n.removed[k] += mean * light.irradiance[k];
  }
}

std::span<const LightSubtraction::Removal> LightSubtraction::removal(const Light& light, float radiance_per_unit,
                                                                     std::span<const Rgbx> texels) {
  find_near(light.direction, light.angular_radius_rad + (1 + kSurroundingsTexels) * texel_rad_);
  const float cap_share = std::clamp(light.angular_radius_rad / texel_rad_ - 1, 0.0F, 1.0F);
  if (cap_share < 1) remove_excess(light, radiance_per_unit, 1 - cap_share, texels);
  if (cap_share > 0) remove_cap(light, radiance_per_unit, cap_share);
  std::erase_if(near_, [](const Removal& n) { return n.removed == std::array<float, 3>{}; });
  return near_;
}

void LightSubtraction::subtract(std::span<const Removal> removal, std::span<Rgbx> texels) {
  for (const Removal& r : removal)
    for (std::size_t k = 0; k < 3; ++k) texels[r.texel].v[k] -= r.removed[k];
}

}  // namespace lightwell::estimate
