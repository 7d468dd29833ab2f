#include "ar_viewer/light_state.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <utility>

#include <lightwell/cap.hpp>
#include <lightwell/harmonics.hpp>

namespace lightwell::viewer {
namespace {

/// Y_00.
constexpr float kConstantBasis = 0.28209479F;

/// Adds the light to the harmonics as a cap, up to their band.
void add_cap(const Light& light, RadianceSh& sh) {
  std::array<double, sh_count(kMaxBand)> basis{};
  sh_basis(sh.band, vec_cast<double>(light.direction), std::span<double>(basis));
  for (int l = 0; l <= sh.band; ++l) {
    const double zonal = cap_zonal(l, static_cast<double>(light.angular_radius_rad));
    for (int i = l * l; i < sh_count(l); ++i)
      sh.c[static_cast<std::size_t>(i)] += Radiance{light.irradiance.r, light.irradiance.g, light.irradiance.b} *
                                           static_cast<float>(zonal * basis[static_cast<std::size_t>(i)]);
  }
}

void set_band(RadianceSh& sh, int band) {
  for (int i = sh_count(band); i < sh_count(kMaxBand); ++i) sh.c[static_cast<std::size_t>(i)] = {};
  sh.band = band;
}

/// The strongest light as a point, all else in nine coefficients.
void reduce_to_main_light(Descriptor& d) {
  set_band(d.radiance, 2);
  for (std::size_t i = 1; i < d.lights.size(); ++i) add_cap(d.lights[i], d.radiance);
  if (!d.lights.empty()) {
    d.lights.resize(1);
    d.lights[0].angular_radius_rad = 0;
    d.lights[0].distance_m = d.lights[0].distance_sigma_m = 0;
  }
}

void reduce_to_constant(Descriptor& d) {
  const Radiance mean = mean_radiance(d);
  d.radiance = uniform_radiance(mean);
  d.lights.clear();
}

/// The weakest lights become part of the harmonics.
void limit_lights(Descriptor& d) {
  if (d.lights.size() <= kMaxShadedLights) return;
  std::stable_sort(d.lights.begin(), d.lights.end(),
                   [](const Light& a, const Light& b) { return a.irradiance.luminance() > b.irradiance.luminance(); });
  set_band(d.radiance, kMaxBand);
  for (std::size_t i = kMaxShadedLights; i < d.lights.size(); ++i) add_cap(d.lights[i], d.radiance);
  d.lights.resize(kMaxShadedLights);
}

/// Of one level alone, no roughness is above its share.
std::array<float, 2> first_level_range(std::span<const EnvironmentLevel> levels) {
  if (levels.size() < 2) return {2, 3};
  return {levels[0].roughness, levels[1].roughness};
}

void fade(Descriptor& d, Radiance mean, float presence) {
  for (Radiance& c : d.radiance.c) c = c * presence;
  d.radiance.c[0] += uniform_radiance(mean * (1 - presence)).c[0];
  for (Light& light : d.lights) light.irradiance = light.irradiance * presence;
  if (!(presence > 0)) d.lights.clear();
}

}  // namespace

RadianceSh uniform_radiance(Radiance radiance) {
  RadianceSh sh;
  sh.c[0] = radiance * (1 / kConstantBasis);
  return sh;
}

Radiance mean_radiance(const Descriptor& d) {
  Radiance mean = d.radiance.c[0] * kConstantBasis;
  for (const Light& light : d.lights)
    mean += Radiance{light.irradiance.r, light.irradiance.g, light.irradiance.b} *
            (kConstantBasis * kConstantBasis *
             static_cast<float>(cap_zonal(0, static_cast<double>(light.angular_radius_rad))));
  return mean;
}

float stale_presence(Validity validity, double seconds_stale, double fade_s) {
  if (validity != Validity::stale) return 1;
  if (!(fade_s > 0)) return 0;
  return static_cast<float>(std::clamp(1 - seconds_stale / fade_s, 0.0, 1.0));
}

LightState make_light_state(const Lighting& world, Shading shading, float presence) {
  LightState state;
  if (shading == Shading::off || (world.validity() != Validity::valid && world.validity() != Validity::stale))
    return state;
  Descriptor d = world.descriptor();
  d.environment.reset();
  state.shading = shading;
  state.mean = mean_radiance(d);
  state.presence = presence;
  state.T_world_origin = world.origin();
  if (shading == Shading::main_light_and_sh9) reduce_to_main_light(d);
  if (shading == Shading::constant) reduce_to_constant(d);
  if (shading == Shading::full) {
    state.measured = world;
    limit_lights(d);
  }
  if (presence < 1) fade(d, state.mean, presence);
  state.all = Lighting::of(d);
  const std::optional<EnvironmentView> map = state.measured.environment();
  for (const Light& light : d.lights)
    state.lights.push_back({light.direction, light.irradiance, light.angular_radius_rad, state.all.position(light),
                            light.distance_m, map && map->shown_in_mirror(light)});
  if (map) state.first_level = first_level_range(map->map.levels);
  d.lights.clear();
  state.residual = Lighting::of(std::move(d));
  if (shading == Shading::full && presence >= 1) state.all = world;  // With its map.
  return state;
}

}  // namespace lightwell::viewer
