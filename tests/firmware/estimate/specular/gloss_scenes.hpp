// Reflections of a glossy plane for tests of GlossEstimator: the light of one lamp, by the reference renderer.
#pragma once

#include <cmath>
#include <limits>
#include <numbers>

#include "estimate/specular/gloss_estimate.hpp"
#include "reference/glossy_plane.hpp"
#include "reference/glossy_sequence.hpp"

namespace lightwell::specular {

inline constexpr double kAlpha = 0.1;
inline const reference::V3 kLamp{std::sqrt(0.5), 0, std::sqrt(0.5)};

/// Texels of albedo 0.03 to 0.8 under an irradiance, plus a part that is specular.
inline TexelImage texels(double irradiance, float common = 0) {
  TexelImage out;
  for (int k = 0; k < 1024; ++k) {
    const double albedo = k % 4 == 0 ? 0.8 : k % 4 == 1 ? 0.03 : 0.03 + 0.77 * k / 1024;
    const auto value = static_cast<float>(albedo / std::numbers::pi * irradiance) + common;
    out.push_back({value, value, value, 0});
  }
  return out;
}

/// Every direction above 5 degrees is seen, with a specular part of this radiance.
inline Lumisphere lumisphere_of(float radiance) {
  Lumisphere out(60);
  for (std::size_t node = 0; node < out.value.size(); ++node) {
    if (out.grid.direction(node).z < 0.09) continue;
    out.value[node] = {radiance, radiance, radiance};
    out.weight[node] = 100, out.sigma[node] = 0.001F;
  }
  return out;
}

/// The reflection of a lamp on uniform radiance, less its least value.
struct LampScene {
  explicit LampScene(double alpha = kAlpha, double radius_rad = 0.1, double radiance = 20) {
    const reference::Panorama env = reference::lamps_on_gradient(
        256, 128, {0.3, 0.3, 0.3}, {0.3, 0.3, 0.3},
        {{reference::world_from_plane(kLamp), radius_rad, {radiance, radiance, radiance}}});
    irradiance = reference::luminance(reference::plane_irradiance(env));
    const reference::SpecularTable table(env, reference::Gloss{alpha});
    common = std::numeric_limits<float>::infinity();
    for (std::size_t node = 0; node < lumisphere.value.size(); ++node) {
      const Vec3d d = lumisphere.grid.direction(node);
      if (!(lumisphere.weight[node] > 0)) continue;
      const auto s = static_cast<float>(table.radiance({d.x, d.y, d.z})[1]);
      lumisphere.value[node] = {s, s, s};
      common = std::min(common, s);
    }
    for (std::size_t node = 0; node < lumisphere.value.size(); ++node)
      if (lumisphere.weight[node] > 0) lumisphere.value[node] += Radiance{-common, -common, -common};
  }
  Lumisphere lumisphere = lumisphere_of(0);
  double irradiance = 0;
  float common = 0;
};

}  // namespace lightwell::specular
