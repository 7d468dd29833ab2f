// Shading of a 100 mm dodecahedron and of the table below it in known light, from closed forms, without images.
#pragma once

#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include <lightwell/geometry.hpp>

#include "estimate/marker/shading.hpp"

namespace lightwell::marker::test {

inline constexpr double kInradius = 0.05;
inline constexpr double kDegree = std::numbers::pi / 180;

/// Irradiance of a small surface relative to that at normal incidence in the body's centre: the inverse-square law and
/// Lambert's cosine law.
inline double relative_irradiance_of(const PointLight& lamp, Vec3d at, Vec3d normal) {
  if (!(lamp.inverse_distance > 0)) return std::max(0.0, dot(normal, lamp.direction));
  const double distance = 1 / lamp.inverse_distance;
  const Vec3d way = lamp.direction * distance - at;
  const double from_here = length(way);
  return std::max(0.0, dot(normal, way) / from_here) * std::pow(distance / from_here, 2);
}

/// Unit vector; azimuth from the camera (+Z) towards +X, elevation above the horizon.
inline Vec3d towards(double azimuth_deg, double elevation_deg) {
  const double a = azimuth_deg * kDegree, e = elevation_deg * kDegree;
  return {std::cos(e) * std::sin(a), std::sin(e), std::cos(e) * std::cos(a)};
}

struct LitBody {
  std::vector<PointLight> lamps;
  double ambient = 0.05;  ///< Ambient irradiance, equal for all normals.
  double turn_deg = 0;    ///< About +Y; 0: a face towards the camera, 36: an edge.
  double camera_elevation_deg = 26.565;
  bool table = false;
  double table_albedo = 0.05;
  double table_texture = 0;  ///< Relative standard deviation of the table's albedo: waves of 2 to 15 cm.
  double sample_noise = 0;   ///< Relative standard deviation of each sample.
  double surface_noise = 0;  ///< Relative standard deviation shared by each face.
  double floor_noise = 0;    ///< Standard deviation shared by each face, in units of irradiance.
  unsigned seed = 1;

  [[nodiscard]] std::array<Vec3d, 12> normals() const {
    std::array<Vec3d, 12> out{};
    out[0] = {0, 1, 0};
    for (std::size_t k = 0; k < 5; ++k)
      out[1 + k] = towards(turn_deg + 72.0 * static_cast<double>(k), std::atan(0.5) / kDegree);
    for (std::size_t k = 0; k < 6; ++k) out[6 + k] = -out[k];
    return out;
  }

  [[nodiscard]] std::vector<Vec3d> vertices() const {
    const auto n = normals();
    std::vector<Vec3d> out;
    for (std::size_t i = 0; i < 12; ++i)
      for (std::size_t j = i + 1; j < 12; ++j)
        for (std::size_t k = j + 1; k < 12; ++k) {
          // Three faces share a vertex where their normals are 63.4 degrees apart.
          if (dot(n[i], n[j]) < 0.4 || dot(n[j], n[k]) < 0.4 || dot(n[i], n[k]) < 0.4) continue;
          const Vec3d c = n[i] + n[j] + n[k];
          out.push_back(c * (kInradius / dot(c, n[i])));
        }
    return out;
  }

  /// Whether the body occludes a lamp, as seen from a point outside of it.
  [[nodiscard]] bool shaded(Vec3d point, const PointLight& lamp) const {
    const Vec3d to_lamp =
        lamp.inverse_distance > 0 ? lamp.direction * (1 / lamp.inverse_distance) - point : lamp.direction * 10.0;
    double enter = 0, leave = 1;
    for (const Vec3d& n : normals()) {
      const double slack = kInradius - dot(n, point), speed = dot(n, to_lamp);
      if (std::abs(speed) < 1e-12) {
        if (slack < 0) return false;
      } else if (speed > 0) {
        leave = std::min(leave, slack / speed);
      } else {
        enter = std::max(enter, slack / speed);
      }
    }
    return enter < leave;
  }

  /// Albedo of the table at a point, relative to its mean: 40 plane waves.
  [[nodiscard]] std::vector<double> relative_albedos(const std::vector<Vec3d>& points) const {
    constexpr int kWaves = 40;
    std::mt19937 random(seed + 1000);
    std::uniform_real_distribution<double> unit(0, 1);
    std::vector<double> out(points.size(), 1);
    for (int k = 0; k < kWaves; ++k) {
      const double wavelength = 0.02 * std::pow(7.5, unit(random)), phase = 2 * std::numbers::pi * unit(random);
      const Vec3d wave = towards(360 * unit(random), 0) * (2 * std::numbers::pi / wavelength);
      for (std::size_t i = 0; i < points.size(); ++i)
        out[i] += table_texture * std::sqrt(2.0 / kWaves) * std::cos(dot(wave, points[i]) + phase);
    }
    for (double& a : out) a = std::max(a, 0.05);
    return out;
  }

  [[nodiscard]] Shading shading() const {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    Shading out;
    out.hull = vertices();
    const Vec3d camera = towards(0, camera_elevation_deg) * 0.45;
    const auto n = normals();
    for (std::size_t face = 0; face < 12; ++face) {
      const Vec3d middle = n[face] * kInradius;
      if (dot(normalized(camera - middle), n[face]) < 0.17) continue;
      const auto [u, v] = tangent_basis(n[face]);
      const double of_face = 1 + surface_noise * normal(random), floor = floor_noise * normal(random);
      for (int k = 0; k < 12; ++k) {
        const double a = 2 * std::numbers::pi * k / 12;
        SurfaceSample sample;
        sample.position = middle + u * (0.023 * std::cos(a)) + v * (0.023 * std::sin(a));
        sample.normal = n[face];
        sample.surface = static_cast<int>(face);
        sample.patch = 100 * sample.surface + k;
        const double noise = of_face * (1 + sample_noise * normal(random));
        for (std::size_t c = 0; c < 3; ++c) {
          double e = ambient;
          for (const PointLight& lamp : lamps)
            e += lamp.irradiance[c] * relative_irradiance_of(lamp, sample.position, sample.normal);
          sample.irradiance[c] = std::max(0.0, e * noise + floor);
          sample.sigma[c] = 1e-4;
        }
        out.samples.push_back(sample);
      }
    }
    if (!table) return out;
    GroundPlane& plane = out.ground.emplace();
    plane.point = {0, -kInradius, 0};
    plane.normal = {0, 1, 0};
    plane.step_m = 0.02;
    for (double x = -0.2; x <= 0.2; x += plane.step_m)
      for (double z = -0.2; z <= 0.2; z += plane.step_m) {
        const Vec3d p{x, -kInradius, z};
        // Excludes what the body, approximated by a ball, hides from the camera.
        const Vec3d ray = normalized(p - camera);
        if (length(camera + ray * dot(-camera, ray)) < 1.25 * kInradius && dot(-camera, ray) < length(p - camera))
          continue;
        GroundSample sample;
        sample.position = p;
        const double squared = x * x + z * z + kInradius * kInradius;
        sample.occluded = kInradius * kInradius * kInradius / (squared * std::sqrt(squared));
        Rgb e;
        e.fill(ambient * (1 - sample.occluded));
        for (const PointLight& lamp : lamps) {
          double visible = 0;
          for (int k = 0; k < 16; ++k)
            visible += shaded(p + Vec3d{(k % 4 - 1.5) / 4 * plane.step_m, 0, (k / 4 - 1.5) / 4 * plane.step_m}, lamp)
                           ? 0
                           : 1.0 / 16;
          for (std::size_t c = 0; c < 3; ++c)
            e[c] += lamp.irradiance[c] * visible * relative_irradiance_of(lamp, p, plane.normal);
        }
        const double noise = 1 + 2 * sample_noise * normal(random);
        for (std::size_t c = 0; c < 3; ++c) sample.color[c] = table_albedo / std::numbers::pi * e[c] * noise;
        sample.radiance = (sample.color[0] + sample.color[1] + sample.color[2]) / 3;
        sample.sigma = table_albedo * 1e-3;
        plane.samples.push_back(sample);
      }
    std::vector<Vec3d> points;
    for (const GroundSample& sample : plane.samples) points.push_back(sample.position);
    const std::vector<double> albedos = relative_albedos(points);
    for (std::size_t i = 0; i < points.size(); ++i) plane.samples[i].radiance *= albedos[i];
    return out;
  }
};

}  // namespace lightwell::marker::test
