// Lamps in space, and what ideal probes see of them.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <lightwell/field.hpp>

namespace lightwell::test {

struct Lamp {
  Vec3d position;
  Irradiance intensity{4, 3, 2};
  double radius_m = 0.05;
};

/// Probes see all lamps, the sun if it shines, and even ambient light.
struct FieldScene {
  std::vector<Lamp> lamps{};
  Irradiance sun{};
  Vec3d towards_sun{0.3, 0.8, 0.52};
  float ambient = 0.3F;
  Units units = Units::absolute;

  [[nodiscard]] Light light_of(const Lamp& lamp, Vec3d point) const {
    const Vec3d to = lamp.position - point;
    const double distance = length(to);
    Light out;
    out.direction = vec_cast<float>(to * (1 / distance));
    out.irradiance = lamp.intensity * static_cast<float>(1 / (distance * distance));
    out.angular_radius_rad = static_cast<float>(std::asin(lamp.radius_m / distance));
    out.direction_covariance = {1e-7F, 0, 1e-7F};
    return out;
  }

  /// In the world's axes.
  [[nodiscard]] Descriptor at(Vec3d point) const {
    Descriptor out;
    out.units = units;
    out.probe_id = out.calibration_id = 1;
    out.bound.total = 0.01F;
    out.coverage = 1;
    out.radiance.band = 2;
    out.radiance.c[0] = {ambient, ambient, ambient};
    for (const Lamp& lamp : lamps) out.lights.push_back(light_of(lamp, point));
    if (sun.g > 0) {
      Light light;
      light.direction = vec_cast<float>(normalized(towards_sun));
      light.irradiance = sun;
      light.angular_radius_rad = 0.0047F;
      out.lights.push_back(light);
    }
    return out;
  }

  /// Irradiance of a receiver at a point, in closed form for lamps that are small.
  [[nodiscard]] Irradiance irradiance(Vec3d point, Vec3f normal) const {
    return Lighting::of(at(point)).irradiance(normal).value;
  }
};

/// A sample of a probe that stands at `place`, turned by `turn`, and measured `light` (world axes).
inline FieldSample sample_at(Vec3d place, const Descriptor& light, Quat turn = {}, HostTime when = {}) {
  FieldSample out;
  out.light = light;
  const Quat back = turn.inverse();
  out.light.radiance = rotated(light.radiance, back);
  for (Light& l : out.light.lights) l.direction = rotate(back, l.direction);
  out.T_world_probe.pose = {turn, place};
  for (std::size_t i = 0; i < 6; ++i) out.T_world_probe.covariance[i][i] = i < 3 ? 1e-7 : 1e-6;
  out.mid_exposure = when;
  return out;
}

/// Four places around the middle of a room of 4 m.
inline std::vector<Vec3d> four_places() {
  return {{-1.5, 1.2, -1.4}, {1.6, 1.0, -1.2}, {1.4, 1.4, 1.5}, {-1.3, 1.1, 1.6}};
}

inline std::string name_of(std::size_t k) { return "probe " + std::to_string(k); }

/// A field of probes that see the whole scene; each is turned another way.
inline LightField field_of(const FieldScene& scene, const std::vector<Vec3d>& places,
                           const FieldOptions& options = {}) {
  LightField out = std::move(LightField::make(options).value());
  for (std::size_t k = 0; k < places.size(); ++k) {
    const Quat turn = Quat::about({0, 1, 0}, 0.7 * static_cast<double>(k));
    (void)out.set(name_of(k), sample_at(places[k], scene.at(places[k]), turn));
  }
  (void)out.update({});
  return out;
}

inline const FieldLight* light_near(const FieldState& state, Vec3d position, double reach_m = 0.1) {
  for (const FieldLight& light : state.lights)
    if (light.placed && length(light.position - position) < reach_m) return &light;
  return nullptr;
}

inline const FieldProbe& probe_named(const FieldState& state, const std::string& name) {
  for (const FieldProbe& probe : state.probes)
    if (probe.name == name) return probe;
  static const FieldProbe none;
  return none;
}

/// A Lambertian disc, by the vector irradiance of its parts.
struct Disc {
  Vec3d center, normal;
  double radius_m = 0.3, radiance = 10;

  /// As a probe sees it: one light, whose cap has the disc's second moment.
  [[nodiscard]] Light seen_from(Vec3d point) const {
    constexpr int kRings = 24, kSectors = 48;
    const auto [u, v] = tangent_basis(normal);
    Vec3d sum;
    for (int i = 0; i < kRings; ++i)
      for (int k = 0; k < kSectors; ++k) {
        const double r = radius_m * std::sqrt((i + 0.5) / kRings), a = 2 * std::numbers::pi * (k + 0.5) / kSectors;
        const Vec3d to = center + u * (r * std::cos(a)) + v * (r * std::sin(a)) - point;
        const double area = std::numbers::pi * radius_m * radius_m / (kRings * kSectors);
        sum += normalized(to) * (radiance * area * std::max(0.0, -dot(normalized(to), normal)) / dot(to, to));
      }
    Light out;
    const float e = static_cast<float>(length(sum));
    out.direction = vec_cast<float>(normalized(sum));
    out.irradiance = {e, e, e};
    out.angular_radius_rad = static_cast<float>(std::atan(radius_m / length(center - point)));
    out.direction_covariance = {1e-7F, 0, 1e-7F};
    return out;
  }
};

/// A field of probes that see the emitter, and little else.
inline LightField field_of(const Disc& disc, const std::vector<Vec3d>& places) {
  LightField out = std::move(LightField::make().value());
  for (std::size_t k = 0; k < places.size(); ++k) {
    Descriptor d = FieldScene{.ambient = 0.02F}.at(places[k]);
    d.lights.push_back(disc.seen_from(places[k]));
    (void)out.set(name_of(k), sample_at(places[k], d));
  }
  (void)out.update({});
  return out;
}

/// Of the strongest light at a point, relative.
inline double irradiance_error(const LightField& field, const Disc& disc, Vec3d point) {
  const double truth = static_cast<double>(disc.seen_from(point).irradiance.g);
  const auto primary = field.at(point, {}).light.primary_light();
  return primary ? std::abs(static_cast<double>(primary->irradiance.g) - truth) / truth : 1;
}

}  // namespace lightwell::test
