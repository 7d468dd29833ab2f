#include "golden_vectors.hpp"

#include <cmath>
#include <limits>

#include "support/captured_planes.hpp"

namespace lightwell {
namespace {

Descriptor base() {
  Descriptor d;
  d.sequence = 7;
  d.time = {{1'000'000'000}, {12'000'000}, {15'000'000}};
  d.coverage = 1;
  d.bound = {0.01F, 0.005F, 0.002F, 0.0005F, 0.0002F};
  d.probe_id = fnv1a_32("golden");
  d.calibration_id = 0x12345678;
  return d;
}

Descriptor smallest() {
  Descriptor d;
  d.flags.set(Flag::dark);
  d.bound.total = std::numeric_limits<float>::infinity();
  return d;
}

Descriptor constant() {
  Descriptor d = base();
  d.radiance.c[0] = {3.5449077F, 1.7724539F, 0.8862269F};
  return d;
}

Descriptor lamp_at_plus_x() {
  Descriptor d = base();
  d.radiance.band = 2;
  for (std::size_t i = 0; i < 9; ++i)
    d.radiance.c[i] = {1.0F / static_cast<float>(i + 1), -0.5F / static_cast<float>(i + 1), 0.125F};
  Light l;
  l.direction = {1, 0, 0};
  l.irradiance = {10, 8, 5};
  l.angular_radius_rad = 0.05F;
  l.direction_covariance = {1e-6F, 0, 2e-6F};
  l.track = 3;
  d.lights = {l};
  return d;
}

/// Of a marker: the origin is not the probe, and the distance of one of two lamps is known.
Descriptor near_lamp() {
  Descriptor d = lamp_at_plus_x();
  d.lights[0].distance_m = 0.3F;
  d.lights[0].distance_sigma_m = 0.00512F;
  Light distant = d.lights[0];
  distant.direction = {0, 1, 0};
  distant.irradiance = {1, 1, 1};
  distant.track = 4;
  distant.distance_m = distant.distance_sigma_m = 0;
  d.lights.push_back(distant);
  d.T_probe_origin = {{0.5, -0.5, 0.5, 0.5}, {0.0625, -0.125, -0.75}};
  return d;
}

EnvironmentMap whole_map() {
  EnvironmentMap map;
  map.levels = {{16, 0}, {8, 0.5F}};
  map.exponent = -3;
  map.key_interval_ms = 1200;
  for (std::uint32_t i = 0; i < 16 * 16 + 8 * 8; ++i) map.texels.push_back(i * 0x01010101U);
  map.key = environment_key(map);
  return map;
}

/// Changes to whole_map(): three texels from the eighth on, and the last one.
Descriptor environment_changes() {
  Descriptor d = base();
  EnvironmentMap map;
  map.key = whole_map().key;
  map.runs = {7, 3, 309, 1};
  map.texels = {0x80000001U, 0x80000200U, 0x80040000U, 0xFFFFFFFFU};
  d.environment = map;
  return d;
}

/// A map of which texels show one of two lights, a window.
Descriptor window_in_texels() {
  Descriptor d = lamp_at_plus_x();
  Light window = d.lights[0];
  window.direction = {0, 0, -1};
  window.angular_radius_rad = 0.25F;
  window.track = 9;
  d.lights.push_back(window);
  d.environment = whole_map();
  d.environment->light_tracks = {9};
  d.environment->light_runs = {20, 2, 5, 1};
  d.environment->light_texels = {0x90000101U, 0x90020200U, 0x90040000U};
  return d;
}

/// Every field set, every number at its maximum.
Descriptor fullest() {
  Descriptor d = base();
  d.sequence = std::numeric_limits<std::uint64_t>::max();
  d.units = Units::absolute;
  d.radiance.band = kMaxBand;
  for (std::size_t i = 0; i < static_cast<std::size_t>(sh_count(kMaxBand)); ++i)
    d.radiance.c[i] = {static_cast<float>(i % 2 == 0 ? 8191 : -8191), 8190, -8189};
  for (std::size_t i = 0; i < kMaxLights; ++i) {
    Light l;
    const float a = 0.1F * static_cast<float>(i);
    l.direction = {std::round(std::sin(a)), 0, std::round(std::sin(a)) == 0 ? -1.0F : 0.0F};
    l.irradiance = {1e6F, 1e5F, static_cast<float>(i)};
    l.angular_radius_rad = 1.5F;
    l.direction_covariance = {0.25F, -0.125F, 0.5F};
    l.track = static_cast<std::uint32_t>(i + 1);
    d.lights.push_back(l);
  }
  d.environment = whole_map();
  d.saturated = 0.25F;
  // The vectors with which version 1 was frozen.
  for (const Flag f :
       {Flag::unseen, Flag::clipped, Flag::cleaned, Flag::dark, Flag::moved, Flag::filled, Flag::recovered})
    d.flags.set(f);
  d.bound.total = std::numeric_limits<float>::infinity();
  return d;
}

}  // namespace

std::vector<GoldenVector> golden_vectors() {
  return {{"v1_smallest", smallest()},
          {"v1_constant", constant()},
          {"v1_lamp_at_plus_x", lamp_at_plus_x()},
          {"v1_near_lamp", near_lamp()},
          {"v1_environment_changes", environment_changes()},
          {"v1_window_in_texels", window_in_texels()},
          {"v1_fullest", fullest()}};
}

CapturedPlane golden_plane() {
  CapturedPlane plane = test::linear_plane(12, 4, 3);
  plane.info.T_probe_plane = Pose{{0, 0, 0, 1}, {0.01, 0.02, -0.5}};
  plane.info.texture_to_plane = {0.001, 0.002, 0.003, 1.004};
  plane.info.gloss_alpha = 0.125F;
  plane.info.f0 = 0.0625F;
  plane.lumisphere.state[40] = SampleState::unseen;
  plane.texture.state[17] = SampleState::clipped;
  plane.coverage.seen[24] = 0;
  return plane;
}

}  // namespace lightwell
