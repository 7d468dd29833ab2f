// Rooms: scaled, rotated, and with a thousand lamps.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <lightwell/query.hpp>

#include "firmware/estimate/extremes/rows.hpp"
#include "reference/irradiance.hpp"

namespace lightwell::extremes {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

Descriptor answer(Estimator& estimator, const Shot& shot, Tally& tally) {
  Descriptor d;
  if (!estimator.estimate(std::span(&shot.frame, 1), d).ok()) ++tally.refused;
  return d;
}

/// Largest deviation from b = factor * a, relative to the largest coefficient or light.
double deviation(const Descriptor& a, const Descriptor& b, double factor) {
  if (a.lights.size() != b.lights.size() || a.radiance.band != b.radiance.band) return 1;
  double worst = 0, coefficient = 0, light = 0;
  for (int c = 0; c < 3; ++c) {
    for (const auto& x : a.radiance.c) coefficient = std::max(coefficient, static_cast<double>(std::abs(x[c])));
    for (const Light& x : a.lights) light = std::max(light, static_cast<double>(x.irradiance[c]));
  }
  for (int c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < a.radiance.c.size() && coefficient > 0; ++i)
      worst = std::max(worst, std::abs(b.radiance.c[i][c] / factor - a.radiance.c[i][c]) / coefficient);
    for (std::size_t i = 0; i < a.lights.size() && light > 0; ++i)
      worst = std::max(worst, std::abs(b.lights[i].irradiance[c] / factor - a.lights[i].irradiance[c]) / light);
  }
  for (std::size_t i = 0; i < a.lights.size(); ++i) {
    worst = std::max(worst, static_cast<double>(angle_between(a.lights[i].direction, b.lights[i].direction)));
    worst =
        std::max(worst, static_cast<double>(std::abs(a.lights[i].angular_radius_rad - b.lights[i].angular_radius_rad)));
  }
  return worst;
}

void record_worst(double value, const std::string& where, ScaleRow& row) {
  if (value > row.worst || !std::isfinite(value)) row.worst = value, row.worst_case = where;
}

}  // namespace

ScaleRow radiance_scaled(int rooms, Steps steps) {
  ScaleRow row;
  const RigRenderer renderer(rig_of("pair", 160, 120));
  const auto& normals = renderer.truth().normals();
  for (const EstimatorConfig& config : every_choice()) {
    Chance chance(11);
    for (int i = 0; i < rooms; ++i) {
      const Pictures pictures = renderer.render(room(chance));
      const auto truth = renderer.truth().irradiance(pictures);
      const Descriptor one = answer(*estimator_of(renderer.rig(), config), renderer.as_floats(pictures), row.tally);
      const auto estimator = estimator_of(renderer.rig(), config);
      for (int decade = -8; decade <= 8; ++decade) {
        const double exact = std::pow(10.0, decade);
        const auto factor =
            static_cast<float>(steps == Steps::decades ? exact : std::exp2(std::round(std::log2(exact))));
        Pictures more = pictures;
        for (std::vector<float>& picture : more)
          for (float& v : picture) v *= factor;
        std::vector<reference::Rgb> light = truth;
        for (reference::Rgb& e : light)
          for (double& v : e) v *= factor;
        Descriptor d = answer(*estimator, renderer.as_floats(more), row.tally);
        const std::string where = name_of(config) + ", room " + std::to_string(i) + ", 1e" + std::to_string(decade);
        row.tally.count(d, normals, light, where);
        record_worst(deviation(one, d, factor), where, row);
        for (Rgb<RadianceTag>& c : d.radiance.c) c = c * (1 / factor);
        for (Light& l : d.lights) l.irradiance = l.irradiance * (1 / factor);
        if (const double difference = largest_difference(one, d, normals); difference > row.worst_irradiance)
          row.worst_irradiance = difference, row.worst_irradiance_case = where;
      }
    }
  }
  return row;
}

ScaleRow exposure_scaled(int rooms) {
  ScaleRow row;
  const RigRenderer renderer(rig_of("pair", 160, 120, PixelFormat::rgb8));
  for (const EstimatorConfig& config : every_choice()) {
    Chance chance(12);
    for (int i = 0; i < rooms; ++i) {
      const Scene scene = room(chance, 0);
      Shot shot = renderer.as_rgb8(renderer.render(scene), 2e-4, static_cast<std::uint64_t>(i));
      const Descriptor one = answer(*estimator_of(renderer.rig(), config), shot, row.tally);
      for (int decade = -8; decade <= 8; ++decade) {
        shot.frame.info.exposure_s = 2e-4 * std::pow(10.0, decade);
        const Descriptor d = answer(*estimator_of(renderer.rig(), config), shot, row.tally);
        const std::string where = name_of(config) + ", room " + std::to_string(i) + ", 1e" + std::to_string(decade);
        row.tally.count(d, where);
        record_worst(deviation(one, d, std::pow(10.0, -decade)), where, row);
      }
    }
  }
  return row;
}

TurnRow turned_rooms(int rooms, int turns) {
  TurnRow row;
  for (const char* kind : {"pair", "double_sphere", "equirect"}) {
    const RigRenderer renderer(std::string(kind) == "equirect" ? rig_of(kind, 320, 160) : rig_of(kind, 240, 180));
    const auto& normals = renderer.truth().normals();
    for (const EstimatorConfig& config : every_choice()) {
      const auto estimator = estimator_of(renderer.rig(), config);
      Chance chance(13);
      for (int i = 0; i < rooms; ++i) {
        const Scene scene = room(chance);
        const Descriptor still = answer(*estimator, renderer.as_floats(renderer.render(scene)), row.tally);
        for (int j = 0; j < turns; ++j) {
          const Quat q = chance.rotation();
          const Pictures pictures = renderer.render(turned(scene, q));
          const Descriptor d = answer(*estimator, renderer.as_floats(pictures), row.tally);
          const std::string where = std::string(kind) + ", " + name_of(config) + ", room " + std::to_string(i) +
                                    ", turn " + std::to_string(j);
          row.tally.count(d, normals, renderer.truth().irradiance(pictures), where);
          std::vector<reference::Rgb> expected;
          for (const reference::V3& n : normals) {
            const Irradiance e = irradiance_at(still, vec_cast<float>(rotate(q.inverse(), Vec3d{n.x, n.y, n.z})));
            expected.push_back({e.r, e.g, e.b});
          }
          const double difference = error_of(d, normals, expected);
          row.worst = std::max(row.worst, difference);
          if (difference > static_cast<double>(d.bound.total) + still.bound.total) ++row.beyond_both_bounds;
          if (scene.discs.empty() || still.lights.empty() || d.lights.empty()) continue;
          const Vec3d strongest = rotate(q, vec_cast<double>(still.lights[0].direction));
          double nearest = std::numbers::pi;
          for (const Light& l : d.lights)
            nearest = std::min(nearest, angle_between(vec_cast<double>(l.direction), strongest));
          // Farther away, it is another light: a selection with fewer lights is not an error of direction.
          if (nearest < 5 * kDegree) row.worst_direction_deg = std::max(row.worst_direction_deg, nearest / kDegree);
        }
      }
    }
  }
  return row;
}

Tally thousand_lights(int scenes) {
  Tally tally;
  const RigRenderer renderer(rig_of("pair", 320, 240));
  std::vector<EstimatorConfig> configs = every_choice();
  configs.push_back(choice(Setting::exact, 0));
  configs.back().max_lights = static_cast<int>(kMaxLights);
  for (int i = 0; i < scenes; ++i) {
    Chance chance(100 + static_cast<std::uint32_t>(i));
    Scene scene = constant({0.1F, 0.1F, 0.1F});
    // Equal lamps on a lattice, then random ones over four decades.
    const auto lattice = reference::fibonacci_normals(1000);
    for (const reference::V3& n : lattice) {
      const auto l = static_cast<float>(i % 2 == 0 ? 500 : chance.magnitude(1, 1e4));
      scene.discs.push_back({i % 2 == 0 ? Vec3d{n.x, n.y, n.z} : chance.direction(), 0.01, {l, l, l}});
    }
    const Pictures pictures = renderer.render(scene);
    const auto truth = renderer.truth().irradiance(pictures);
    const Shot shot = renderer.as_floats(pictures);
    for (const EstimatorConfig& config : configs) {
      const Descriptor d = answer(*estimator_of(renderer.rig(), config), shot, tally);
      const std::string where =
          name_of(config) + ", " + std::to_string(config.max_lights) + " lights, scene " + std::to_string(i);
      tally.count(d, renderer.truth().normals(), truth, where);
      if (static_cast<int>(d.lights.size()) > config.max_lights && tally.silent++ == 0)
        tally.silent_case = where + ": more lights than allowed";
    }
  }
  return tally;
}

}  // namespace lightwell::extremes
