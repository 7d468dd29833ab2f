#include "tools/ar_viewer/reflection_maps.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <lightwell/cap.hpp>

#include "tools/ar_viewer/shader_program.hpp"

namespace lightwell::viewer {
namespace {

/// Edge of the coarsest prefiltered level.
constexpr int kLastEdge = 4;

float coordinate(int i, int edge) { return (2 * static_cast<float>(i) + 1) / static_cast<float>(edge) - 1; }

template <class F>
void for_texels(int edge, const F& f) {
  for (int face = 0; face < 6; ++face)
    for (int row = 0; row < edge; ++row)
      for (int column = 0; column < edge; ++column)
        f(cube_direction(face, coordinate(column, edge), coordinate(row, edge)));
}

void upload(int level, int edge, const float* texels) {
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  for (int face = 0; face < 6; ++face)
    glTexImage2D(GL_TEXTURE_CUBE_MAP_POSITIVE_X + static_cast<GLenum>(face), level, GL_RGB32F, edge, edge, 0, GL_RGB,
                 GL_FLOAT, texels + 3 * static_cast<std::ptrdiff_t>(face) * edge * edge);
}

void set_filters(GLenum minification) {
  glTexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_MIN_FILTER, static_cast<GLint>(minification));
  glTexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  for (const GLenum side : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R})
    glTexParameteri(GL_TEXTURE_CUBE_MAP, side, GL_CLAMP_TO_EDGE);
}

}  // namespace

Vec3f cube_direction(int face, float s, float t) {
  // OpenGL 3.3, table 3.19.
  const std::array<Vec3f, 6> d = {Vec3f{1, -t, -s}, {-1, -t, s}, {s, 1, t}, {s, -1, -t}, {s, -t, 1}, {-s, -t, -1}};
  return normalized(d[static_cast<std::size_t>(face)]);
}

ReflectionMaps::ReflectionMaps(const ReflectionStyle& style) : style_(style) {
  if (style.source == ReflectionSource::prefiltered)
    for (int edge = style.edge; edge > kLastEdge; edge /= 2) ++levels_;
  glEnable(GL_TEXTURE_CUBE_MAP_SEAMLESS);
  for_texels(kIrradianceEdge, [this](Vec3f d) { normals_.push_back(d); });
  irradiances_.resize(normals_.size());
  glBindTexture(GL_TEXTURE_CUBE_MAP, irradiance_map_.name());
  set_filters(GL_LINEAR);
  glBindTexture(GL_TEXTURE_CUBE_MAP, environment_map_.name());
  set_filters(GL_LINEAR_MIPMAP_LINEAR);
  glTexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_MAX_LEVEL, levels_ - 1);
}

Radiance ReflectionMaps::radiance(const LightState& light, const std::optional<EnvironmentView>& map, Vec3f direction,
                                  float roughness) {
  if (!map) return light.residual.radiance(direction, roughness).value;
  return environment_radiance(map->map, rotate(map->rotation.inverse(), direction), roughness) * light.presence +
         light.mean * (1 - light.presence);
}

Radiance ReflectionMaps::caps(const LightState& light, Vec3f direction, float texel_rad) {
  Radiance sum;
  for (const ShadedLight& each : light.lights) {
    // A cap narrower than a texel is spread over it.
    const float radius = std::max(each.angular_radius_rad, 0.5F * texel_rad);
    const float share = std::clamp((radius - angle_between(direction, each.direction)) / texel_rad + 0.5F, 0.0F, 1.0F);
    const Radiance uniform{each.irradiance.r, each.irradiance.g, each.irradiance.b};
    sum += uniform * (share / static_cast<float>(cap_vector_irradiance(static_cast<double>(radius))));
  }
  return sum;
}

void ReflectionMaps::fill_irradiance(const LightState& light, float exposure) {
  (void)light.residual.irradiance(normals_, irradiances_);
  for (Irradiance& e : irradiances_) e = e * exposure;
  upload(0, kIrradianceEdge, &irradiances_.front().r);
}

void ReflectionMaps::fill_environment(const LightState& light, float exposure) {
  const std::optional<EnvironmentView> map = light.measured.environment();
  for (int level = 0, edge = style_.edge; level < levels_; ++level, edge /= 2) {
    const float roughness = levels_ > 1 ? static_cast<float>(level) / static_cast<float>(levels_ - 1) : 0;
    texels_.clear();
    for_texels(edge, [&](Vec3f d) {
      Radiance texel = radiance(light, map, d, roughness);
      if (style_.source == ReflectionSource::cube_map)
        texel += caps(light, d, std::numbers::pi_v<float> / 2 / static_cast<float>(edge));
      texels_.push_back(texel * exposure);
    });
    upload(level, edge, &texels_.front().r);
  }
}

void ReflectionMaps::update(const LightState& light, float exposure) {
  glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(Unit::irradiance));
  glBindTexture(GL_TEXTURE_CUBE_MAP, irradiance_map_.name());
  Content now;
  now.residual = light.residual.descriptor().radiance;
  for (const ShadedLight& each : light.lights) now.lights.push_back(each.irradiance);
  if (const auto map = light.measured.environment()) {
    now.map_key = map->map.key;
    now.map_sequence = map->sequence;
    now.map_rotation = map->rotation;
  }
  now.presence = light.presence;
  now.exposure = exposure;
  const bool changed = content_ != now;
  if (changed) fill_irradiance(light, exposure);
  glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(Unit::environment));
  glBindTexture(GL_TEXTURE_CUBE_MAP, environment_map_.name());
  const bool due = style_.source == ReflectionSource::prefiltered || frames_ % style_.every_frames == 0;
  ++frames_;
  if (changed && due) fill_environment(light, exposure);
  if (due) content_ = std::move(now);
}

}  // namespace lightwell::viewer
