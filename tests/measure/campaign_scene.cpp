#include "measure/campaign_scene.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <utility>

#include "measure/panorama_truth.hpp"
#include "reference/panorama.hpp"
#include "reference/random_scene.hpp"

namespace lightwell::measure {
namespace {

namespace ref = reference;

constexpr double kDeg = std::numbers::pi / 180;
/// Of generated panoramas. A pixel of the smaller one is as wide as one of a lens of 320x240.
constexpr int kWidths[] = {512, 512, 512, 1024};
/// A panorama's own lamps are the pixels above this share of its peak, as in sim::Scene.
constexpr float kLampShare = 0.25F;
constexpr int kSamplesPerAxis = 4;

Vec3d vec_of(const ref::V3& v) { return {v.x, v.y, v.z}; }
ref::V3 v3_of(Vec3d v) { return {v.x, v.y, v.z}; }

/// The irradiance of some pixels of a panorama, as reference::irradiance().
std::vector<ref::Rgb> irradiance_of(const PixelLight& light, int width) {
  std::vector<ref::V3> directions;
  std::vector<ref::Rgb> weights;
  for (std::size_t k = 0; k < light.pixels.size(); ++k) {
    const auto row = static_cast<int>(light.pixels[k] / static_cast<std::size_t>(width)),
               column = static_cast<int>(light.pixels[k] % static_cast<std::size_t>(width));
    directions.push_back(ref::pixel_direction(column, row, width, width / 2));
    const double solid_angle = ref::pixel_solid_angle(row, width, width / 2);
    const Radiance l = light.radiance[k];
    weights.push_back({l.r * solid_angle, l.g * solid_angle, l.b * solid_angle});
  }
  std::vector<ref::Rgb> out;
  for (const ref::V3& n : truth_normals()) {
    ref::Rgb sum{};
    for (std::size_t k = 0; k < directions.size(); ++k) {
      const double cosine = std::max(0.0, ref::dot(n, directions[k]));
      for (std::size_t c = 0; c < 3; ++c) sum[c] += cosine * weights[k][c];
    }
    out.push_back(sum);
  }
  return out;
}

std::vector<ref::Rgb> irradiance_of(const sim::Panorama& p) {
  const PanoramaSums sums(ref::Panorama{p.width, p.height, {p.rgb.begin(), p.rgb.end()}});
  std::vector<ref::Rgb> out;
  for (const ref::V3& n : truth_normals()) out.push_back(sums.irradiance(n));
  return out;
}

bool covers(const LampShape& lamp, const std::array<Vec3d, 2>& tangents, Vec3d direction) {
  const double forward = dot(direction, lamp.axis);
  if (lamp.outline == LampShape::Outline::disc) return forward >= std::cos(lamp.half_width_rad);
  return forward > 0 && std::abs(dot(direction, tangents[0])) <= forward * std::tan(lamp.half_width_rad) &&
         std::abs(dot(direction, tangents[1])) <= forward * std::tan(lamp.half_height_rad);
}

double solid_angle(const LampShape& lamp) {
  if (lamp.outline == LampShape::Outline::disc) return 2 * std::numbers::pi * (1 - std::cos(lamp.half_width_rad));
  return 4 * std::asin(std::sin(lamp.half_width_rad) * std::sin(lamp.half_height_rad));
}

/// Light colours are often near white, sometimes saturated.
Radiance color(extremes::Chance& chance, double luminance) {
  const double least = chance.between(0, 1) < 0.2 ? 0.02 : 0.5;
  const Radiance c{static_cast<float>(chance.between(least, 1)), static_cast<float>(chance.between(least, 1)),
                   static_cast<float>(chance.between(least, 1))};
  return c * (static_cast<float>(luminance) / c.luminance());
}

using Ambient = std::function<Radiance(Vec3d)>;

Ambient gradient(extremes::Chance& chance, int lamps) {
  const ref::RandomScene scene(chance.bits(), lamps);
  return [scene](Vec3d d) {
    const ref::Rgb l = scene.radiance(v3_of(d));
    return Radiance{static_cast<float>(l[0]), static_cast<float>(l[1]), static_cast<float>(l[2])};
  };
}

/// Cells of equal steps in longitude and latitude around a random axis, or stripes of latitude alone.
Ambient pattern(extremes::Chance& chance, SceneKind kind) {
  const Quat turn = chance.rotation();
  const double step = chance.magnitude(2, 40) * kDeg;
  const Radiance first = color(chance, 1), second = color(chance, 1 / chance.magnitude(1.5, 300));
  return [=](Vec3d d) {
    const Vec3d at = rotate(turn, d);
    auto cell = static_cast<int>(std::floor(std::acos(std::clamp(at.z, -1.0, 1.0)) / step));
    if (kind == SceneKind::checker)
      cell += static_cast<int>(std::floor((std::atan2(at.y, at.x) + std::numbers::pi) / step));
    return cell % 2 == 0 ? first : second;
  };
}

Ambient ambient_of(SceneKind kind, extremes::Chance& chance) {
  switch (kind) {
    case SceneKind::uniform:
    case SceneKind::lamps:
      return [l = color(chance, 1)](Vec3d) { return l; };
    case SceneKind::checker:
    case SceneKind::stripes:
      return pattern(chance, kind);
    case SceneKind::gradient:
    case SceneKind::windows:
    case SceneKind::dark:
      return gradient(chance, chance.below(6));
    case SceneKind::room:
    case SceneKind::real:
      break;  // Made elsewhere.
  }
  return {};
}

struct RealScene {
  sim::Panorama base;  ///< Without its lamps.
  std::vector<ref::Rgb> irradiance;
  PixelLight lamps;
};

Result<const RealScene*> real_scene(const std::string& path) {
  static std::map<std::string, RealScene> scenes;
  if (const auto known = scenes.find(path); known != scenes.end()) return &known->second;
  Result<sim::Panorama> panorama = sim::load_panorama(path);
  if (!panorama) return panorama.status();
  RealScene out;
  out.base = std::move(*panorama);
  std::vector<float>& rgb = out.base.rgb;
  const auto luminance = [&](std::size_t k) {
    return Radiance{rgb[3 * k], rgb[3 * k + 1], rgb[3 * k + 2]}.luminance();
  };
  float peak = 0;
  for (std::size_t k = 0; 3 * k < rgb.size(); ++k) peak = std::max(peak, luminance(k));
  for (std::size_t k = 0; 3 * k < rgb.size(); ++k) {
    if (luminance(k) <= kLampShare * peak) continue;
    out.lamps.pixels.push_back(k);
    out.lamps.radiance.push_back({rgb[3 * k], rgb[3 * k + 1], rgb[3 * k + 2]});
    for (std::size_t c = 0; c < 3; ++c) rgb[3 * k + c] = 0;
  }
  out.lamps.irradiance = irradiance_of(out.lamps, out.base.width);
  out.irradiance = irradiance_of(out.base);
  return &scenes.emplace(path, std::move(out)).first->second;
}

}  // namespace

std::string_view to_string(SceneKind kind) {
  constexpr std::string_view kNames[] = {"real",    "uniform", "gradient", "checker", "stripes",
                                         "windows", "lamps",   "room",     "dark"};
  return kNames[static_cast<std::size_t>(kind)];
}

PixelLight rasterized(const LampShape& lamp, int width) {
  PixelLight out;
  const int height = width / 2;
  const std::array<Vec3d, 2> tangents = tangent_basis(lamp.axis);
  const double corner = lamp.outline == LampShape::Outline::disc
                            ? lamp.half_width_rad
                            : std::atan(std::hypot(std::tan(lamp.half_width_rad), std::tan(lamp.half_height_rad)));
  const double reach = corner + 2 * std::numbers::pi / height;
  const auto add = [&](int column, int row, double share) {
    out.pixels.push_back(static_cast<std::size_t>(row * width + column));
    out.radiance.push_back(lamp.radiance * static_cast<float>(share));
  };
  for (int j = 0; j < height; ++j) {
    const double elevation = std::numbers::pi * (0.5 - (j + 0.5) / height);
    if (std::abs(elevation - std::asin(std::clamp(lamp.axis.y, -1.0, 1.0))) > reach) continue;
    for (int i = 0; i < width; ++i) {
      if (dot(vec_of(ref::pixel_direction(i, j, width, height)), lamp.axis) <
          std::cos(std::min(reach, std::numbers::pi)))
        continue;
      int inside = 0;
      for (int s = 0; s < kSamplesPerAxis * kSamplesPerAxis; ++s) {
        const double x = (s % kSamplesPerAxis + 0.5) / kSamplesPerAxis - 0.5,
                     y = (s / kSamplesPerAxis + 0.5) / kSamplesPerAxis - 0.5;
        inside += covers(lamp, tangents, vec_of(ref::pixel_direction(i + x, j + y, width, height))) ? 1 : 0;
      }
      if (inside > 0) add(i, j, inside / static_cast<double>(kSamplesPerAxis * kSamplesPerAxis));
    }
  }
  if (out.pixels.empty()) {
    const ref::V2 at = ref::direction_to_pixel(v3_of(lamp.axis), width, height);
    const int column = static_cast<int>(std::lround(at.x)) % width,
              row = std::min(static_cast<int>(std::lround(at.y)), height - 1);
    add(std::max(column, 0), std::max(row, 0),
        solid_angle(lamp) / ref::pixel_solid_angle(std::max(row, 0), width, height));
  }
  out.irradiance = irradiance_of(out, width);
  return out;
}

void CampaignScene::append_lamp(const LampShape& shape, double factor) {
  lamps_.push_back({shape, rasterized(shape, base_.width)});
  first_.lamps.push_back({shape.axis, factor});
}

/// Each gives 0.2 % to `largest_share` of the irradiance of the rest of the scene.
void CampaignScene::add_random_lamps(int count, double largest_share, extremes::Chance& chance) {
  const double rest = std::numbers::pi * std::max(sim::mean_luminance(base_), 1e-6);
  for (int k = 0; k < count; ++k) {
    LampShape lamp;
    lamp.axis = chance.direction();
    lamp.half_width_rad = lamp.half_height_rad = chance.magnitude(0.1, 20) * kDeg;
    if (chance.below(4) == 0) {
      lamp.outline = LampShape::Outline::rectangle;
      lamp.half_height_rad = chance.magnitude(0.1, 30) * kDeg;
    }
    lamp.radiance = color(chance, rest * chance.magnitude(0.002, largest_share) / solid_angle(lamp));
    append_lamp(lamp, chance.below(2));
  }
}

Result<CampaignScene> CampaignScene::draw(SceneKind kind, extremes::Chance& chance) {
  CampaignScene out;
  out.name_ = to_string(kind);
  if (kind == SceneKind::real) {
    const Result<std::vector<std::string>> paths = all_panoramas();
    if (!paths) return paths.status();
    const std::string& path = (*paths)[static_cast<std::size_t>(chance.below(static_cast<int>(paths->size())))];
    const Result<const RealScene*> real = real_scene(path);
    if (!real) return real.status();
    out.name_ = std::filesystem::path(path).stem().string();
    out.base_ = (*real)->base;
    out.base_irradiance_ = (*real)->irradiance;
    out.lamps_.push_back({std::nullopt, (*real)->lamps});
    out.first_.lamps.push_back({});
    out.add_random_lamps(chance.below(3), 3, chance);
    return out;
  }
  const int width = kWidths[chance.below(4)];
  const extremes::Scene room =
      kind == SceneKind::room ? extremes::room(chance) : extremes::Scene{ambient_of(kind, chance), {}};
  const auto level = kind == SceneKind::windows ? static_cast<float>(1 / chance.magnitude(3, 300)) : 1.0F;
  out.base_ = sim::from_function(width, [&](Vec3d d) { return room.ambient(d) * level; });
  out.base_irradiance_ = irradiance_of(out.base_);
  for (const extremes::Disc& disc : room.discs)
    out.append_lamp({LampShape::Outline::disc, disc.axis, disc.radius_rad, disc.radius_rad, disc.radiance}, 1);
  if (kind == SceneKind::windows)
    for (int k = 1 + chance.below(4); k > 0; --k)
      out.append_lamp({LampShape::Outline::rectangle, chance.direction(), chance.between(3, 30) * kDeg,
                       chance.between(3, 30) * kDeg, color(chance, chance.between(0.3, 2))},
                      1);
  out.add_random_lamps(kind == SceneKind::lamps ? static_cast<int>(chance.magnitude(1, 60)) : 1 + chance.below(3), 10,
                       chance);
  return out;
}

void CampaignScene::set(const LightState& state) {
  panorama_ = base_;
  irradiance_ = base_irradiance_;
  for (std::size_t k = 0; k < lamps_.size(); ++k) {
    Lamp& lamp = lamps_[k];
    const LampState& now = state.lamps[k];
    if (lamp.shape && !(lamp.shape->axis == now.axis)) {
      lamp.shape->axis = now.axis;
      lamp.light = rasterized(*lamp.shape, base_.width);
    }
    if (now.factor == 0) continue;
    for (std::size_t i = 0; i < lamp.light.pixels.size(); ++i)
      for (int c = 0; c < 3; ++c)
        panorama_.rgb[3 * lamp.light.pixels[i] + static_cast<std::size_t>(c)] +=
            lamp.light.radiance[i][c] * static_cast<float>(now.factor);
    for (std::size_t n = 0; n < irradiance_.size(); ++n)
      for (std::size_t c = 0; c < 3; ++c) irradiance_[n][c] += lamp.light.irradiance[n][c] * now.factor;
  }
  if (state.gain == 1) return;
  for (float& v : panorama_.rgb) v *= static_cast<float>(state.gain);
  for (reference::Rgb& e : irradiance_)
    for (double& v : e) v *= state.gain;
}

}  // namespace lightwell::measure
