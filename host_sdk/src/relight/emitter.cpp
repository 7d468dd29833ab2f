#include "relight/emitter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

namespace lightwell::relight {
namespace {

bool is_irradiance(const Irradiance& e) { return std::isfinite(e.r + e.g + e.b) && e.r >= 0 && e.g >= 0 && e.b >= 0; }

Vec3f towards(Vec3f from, Vec3f to, float& distance) {
  const Vec3f gap = to - from;
  distance = length(gap);
  return distance > 0 ? gap * (1 / distance) : Vec3f{};
}

float falloff(float distance) {
  const float limited = std::max(distance, kMinDistance_m);
  return 1 / (limited * limited);
}

RgbFactor mean_of(RgbFactor a, RgbFactor b, RgbFactor c, RgbFactor d) { return 0.25F * (a + b + c + d); }

}  // namespace

Incident incident(const BasisLight& light, Vec3f at) {
  if (light.distance == LightDistance::distant)
    return {vec_cast<float>(normalized(light.place)), std::numeric_limits<float>::infinity(), light.irradiance};
  Incident out;
  out.towards = towards(at, vec_cast<float>(light.place), out.distance);
  out.irradiance = light.irradiance * falloff(out.distance);
  return out;
}

Status validate(const BasisLight& light, const std::string& name) {
  if (!is_finite(light.place) || length(light.place) > 1e9)
    return invalid_argument(name + ": place is not finite or above 1e9");
  if (light.distance == LightDistance::distant && !(length(normalized(light.place)) > 0))
    return invalid_argument(name + ": the direction of a distant light is zero");
  if (!is_irradiance(light.irradiance)) return invalid_argument(name + ": irradiance is negative or not finite");
  return {};
}

Status validate(const PatternLight& light, const std::string& name) {
  const Quat& q = light.T_world_light.rotation;
  if (!is_finite(light.T_world_light.translation) || length(light.T_world_light.translation) > 1e9 ||
      !(std::abs(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1) < 1e-6))
    return invalid_argument(name + ": T_world_light is not finite, or its rotation no unit quaternion");
  if (!(light.field_of_view_rad > 0 && light.field_of_view_rad < std::numbers::pi))
    return invalid_argument(name + ": field_of_view_rad is " + std::to_string(light.field_of_view_rad) +
                            ", it must be above 0 and below pi");
  if (light.columns < 1 || light.rows < 1 || light.columns > RelightCamera::kMaxSide ||
      light.rows > RelightCamera::kMaxSide)
    return invalid_argument(name + ": its picture must have 1 to 4096 columns and rows");
  if (Status status = check_size(name + ": picture", light.picture.size(),
                                 static_cast<std::size_t>(light.columns) * static_cast<std::size_t>(light.rows));
      !status.ok())
    return status;
  for (const RgbFactor& t : light.picture)
    if (!std::isfinite(t.r + t.g + t.b) || std::min({t.r, t.g, t.b}) < 0)
      return invalid_argument(name + ": a transmittance is negative or not finite");
  if (!is_irradiance(light.irradiance)) return invalid_argument(name + ": irradiance is negative or not finite");
  return {};
}

Status validate(std::span<const BasisLight> basis, std::span<const PatternLight> patterns) {
  if (basis.empty()) return invalid_argument("there is no basis light");
  if (basis.size() > AlphaMaps::kMaxLights || patterns.size() > AlphaMaps::kMaxPatterns)
    return {StatusCode::resource_exhausted, "at most 256 basis lights and 64 patterns are possible, these are " +
                                                std::to_string(basis.size()) + " and " +
                                                std::to_string(patterns.size())};
  for (std::size_t i = 0; i < basis.size(); ++i)
    if (Status status = validate(basis[i], "basis light " + std::to_string(i)); !status.ok()) return status;
  for (std::size_t i = 0; i < patterns.size(); ++i)
    if (Status status = validate(patterns[i], "pattern " + std::to_string(i)); !status.ok()) return status;
  return {};
}

PatternSampler::PatternSampler(const PatternLight& light)
    : position_(vec_cast<float>(light.T_world_light.translation)),
      right_(rotate(light.T_world_light.rotation, Vec3f{1, 0, 0})),
      up_(rotate(light.T_world_light.rotation, Vec3f{0, 1, 0})),
      back_(rotate(light.T_world_light.rotation, Vec3f{0, 0, 1})),
      scale_(static_cast<float>(0.5 * light.columns / std::tan(0.5 * light.field_of_view_rad))),
      irradiance_(light.irradiance) {
  levels_.push_back({light.columns, light.rows, {light.picture.begin(), light.picture.end()}});
  while (levels_.back().columns > 1 || levels_.back().rows > 1) {
    const Level& fine = levels_.back();
    Level coarse{(fine.columns + 1) / 2, (fine.rows + 1) / 2, {}};
    const auto texel = [&](int column, int row) {
      // Outside of the picture it is black, as in bilinear().
      return column < fine.columns && row < fine.rows
                 ? fine.texels[static_cast<std::size_t>(row * fine.columns + column)]
                 : RgbFactor{};
    };
    for (int row = 0; row < coarse.rows; ++row)
      for (int column = 0; column < coarse.columns; ++column)
        coarse.texels.push_back(mean_of(texel(2 * column, 2 * row), texel(2 * column + 1, 2 * row),
                                        texel(2 * column, 2 * row + 1), texel(2 * column + 1, 2 * row + 1)));
    levels_.push_back(std::move(coarse));
  }
}

Vec3f PatternSampler::project(Vec3f point) const {
  const Vec3f gap = point - position_;
  const float depth = -dot(gap, back_);
  if (!(depth > 0)) return {};
  const float k = scale_ / depth;
  return {0.5F * static_cast<float>(levels_[0].columns) + k * dot(gap, right_),
          0.5F * static_cast<float>(levels_[0].rows) - k * dot(gap, up_), depth};
}

RgbFactor PatternSampler::bilinear(float x, float y, std::size_t level) const {
  const Level& from = levels_[level];
  const float shrink = 1 / static_cast<float>(std::size_t{1} << level);
  const float u = x * shrink - 0.5F, v = y * shrink - 0.5F;
  if (!(u > -1 && v > -1 && u < static_cast<float>(from.columns) && v < static_cast<float>(from.rows))) return {};
  const int column = static_cast<int>(std::floor(u)), row = static_cast<int>(std::floor(v));
  const float a = u - static_cast<float>(column), b = v - static_cast<float>(row);
  const auto texel = [&](int i, int j) {
    return i >= 0 && j >= 0 && i < from.columns && j < from.rows
               ? from.texels[static_cast<std::size_t>(j * from.columns + i)]
               : RgbFactor{};
  };
  return (texel(column, row) * (1 - a) + texel(column + 1, row) * a) * (1 - b) +
         (texel(column, row + 1) * (1 - a) + texel(column + 1, row + 1) * a) * b;
}

std::size_t PatternSampler::level_of(float texels) const {
  if (!(texels > 1)) return 0;
  // Infinite at the light itself.
  return std::min(static_cast<std::size_t>(std::log2(std::min(texels, 65536.0F))), levels_.size() - 1);
}

Incident PatternSampler::incident(Vec3f point, RgbFactor transmittance) const {
  Incident out;
  out.towards = towards(point, position_, out.distance);
  const float k = falloff(out.distance);
  out.irradiance = {k * transmittance.r * irradiance_.r, k * transmittance.g * irradiance_.g,
                    k * transmittance.b * irradiance_.b};
  return out;
}

Incident PatternSampler::at_point(Vec3f point, float width) const {
  const Vec3f at = project(point);
  if (!(at.z > 0)) return incident(point, {});
  return incident(point, bilinear(at.x, at.y, level_of(width * scale_ / at.z)));
}

Incident PatternSampler::at_pixel(const SubjectData& subject, std::size_t pixel) const {
  const Vec3f& point = subject.positions[pixel];
  const Vec3f at = project(point);
  if (!(at.z > 0)) return incident(point, {});
  // The step of the picture from this pixel to its neighbours: the smaller one of those on the same surface, so that
  // edges of the subject do not blur the pattern.
  const auto columns = static_cast<std::size_t>(subject.camera.columns);
  const std::size_t column = pixel % columns;
  const auto step = [&](bool before, bool after, std::size_t stride) {
    Vec3f least;
    float least_length = std::numeric_limits<float>::infinity();
    const auto consider = [&](std::size_t neighbour, float sign) {
      if (!subject.same_surface(pixel, neighbour)) return;
      const Vec3f there = project(subject.positions[neighbour]);
      if (!(there.z > 0)) return;
      const Vec3f d{sign * (there.x - at.x), sign * (there.y - at.y), 0};
      if (const float squared = dot(d, d); squared < least_length) least_length = squared, least = d;
    };
    if (before) consider(pixel - stride, -1);
    if (after) consider(pixel + stride, 1);
    return least;
  };
  const Vec3f across = step(column > 0, column + 1 < columns, 1);
  const Vec3f down = step(pixel >= columns, pixel + columns < subject.depth.size(), columns);
  // Four samples, each of half the width: parallelograms are filtered as such.
  const float width = 0.5F * std::sqrt(std::max(dot(across, across), dot(down, down)));
  const std::size_t level = level_of(width);
  if (width < 0.25F) return incident(point, bilinear(at.x, at.y, level));
  const auto sample = [&](float s, float t) {
    const Vec3f there = at + across * s + down * t;
    return bilinear(there.x, there.y, level);
  };
  return incident(point,
                  mean_of(sample(-0.25F, -0.25F), sample(0.25F, -0.25F), sample(-0.25F, 0.25F), sample(0.25F, 0.25F)));
}

}  // namespace lightwell::relight
