#include "ar_viewer/reflection_maps.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include <lightwell/cube_map.hpp>

#include "ar_viewer/shader_program.hpp"

namespace lightwell::viewer {
namespace {

/// Edge of the coarsest prefiltered level.
constexpr int kLastEdge = 4;

float coordinate(int i, int edge) { return (static_cast<float>(i) + 0.5F) / static_cast<float>(edge); }

template <class F>
void for_texels(int edge, const F& f) {
  for (int face = 0; face < 6; ++face)
    for (int row = 0; row < edge; ++row)
      for (int column = 0; column < edge; ++column)
        f(cube_direction(face, coordinate(column, edge), coordinate(row, edge)));
}

void upload(int level, int edge, GLenum format, const float* texels) {
  const std::ptrdiff_t face_size = static_cast<std::ptrdiff_t>(edge) * edge * (format == GL_RGB ? 3 : 4);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  for (int face = 0; face < 6; ++face)
    glTexImage2D(GL_TEXTURE_CUBE_MAP_POSITIVE_X + static_cast<GLenum>(face), level, GL_RGB32F, edge, edge, 0, format,
                 GL_FLOAT, texels + face * face_size);
}

}  // namespace

ReflectionMaps::ReflectionMaps(const ReflectionStyle& style) : style_(style) {
  glEnable(GL_TEXTURE_CUBE_MAP_SEAMLESS);
  for_texels(kIrradianceEdge, [this](Vec3f d) { normals_.push_back(d); });
  irradiances_.resize(normals_.size());
  glBindTexture(GL_TEXTURE_CUBE_MAP, irradiance_map_.name());
  set_sampling(GL_TEXTURE_CUBE_MAP, GL_LINEAR, GL_LINEAR, GL_CLAMP_TO_EDGE);
  glBindTexture(GL_TEXTURE_CUBE_MAP, environment_map_.name());
  set_sampling(GL_TEXTURE_CUBE_MAP, GL_LINEAR_MIPMAP_LINEAR, GL_LINEAR, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_MAX_LEVEL, 0);
}

Radiance ReflectionMaps::radiance(const LightState& light, const std::optional<EnvironmentView>& map, Vec3f direction,
                                  float roughness) {
  if (!map) return light.residual.radiance(direction, roughness).value;
  return environment_radiance(map->map, rotate(map->rotation.inverse(), direction), roughness) * light.presence +
         light.mean * (1 - light.presence);
}

void ReflectionMaps::fill_irradiance(const LightState& light, float exposure) {
  (void)light.residual.irradiance(normals_, irradiances_);
  for (Irradiance& e : irradiances_) e = e * exposure;
  upload(0, kIrradianceEdge, GL_RGB, &irradiances_.front().r);
}

void ReflectionMaps::fill_prefiltered(const LightState& light, float exposure) {
  const std::optional<EnvironmentView> map = light.measured.environment();
  int edge = map ? style_.edge : std::min(style_.edge, kHarmonicsEdge);
  levels_ = 1;
  for (int e = edge; e > kLastEdge; e /= 2) ++levels_;
  glTexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_MAX_LEVEL, levels_ - 1);
  for (int level = 0; level < levels_; ++level, edge /= 2) {
    const float roughness = static_cast<float>(level) / static_cast<float>(std::max(levels_ - 1, 1));
    texels_.clear();
    for_texels(edge, [&](Vec3f d) { texels_.push_back(radiance(light, map, d, roughness) * exposure); });
    upload(level, edge, GL_RGB, &texels_.front().r);
  }
}

void ReflectionMaps::fill_cube_map(const LightState& light, float exposure) {
  const CubeMapOptions options{style_.edge, CubeFormat::rgba32f, LightsIncluded::yes, exposure};
  cube_map_.resize(cube_map_bytes(options.edge, options.format));
  (void)cube_map(light.all, options, cube_map_);
  upload(0, style_.edge, GL_RGBA, reinterpret_cast<const float*>(cube_map_.data()));  // NOLINT: rgba32f
}

ReflectionMaps::EnvironmentContent ReflectionMaps::environment_content(const LightState& light, float exposure) const {
  EnvironmentContent now;
  if (const auto map = light.measured.environment()) {
    now.map_key = map->map.key;
    now.map_sequence = map->sequence;
    now.map_rotation = map->rotation;
    if (light.presence < 1) now.mean = light.mean;
  } else {
    now.residual = light.residual.descriptor().radiance;
  }
  if (style_.source == ReflectionSource::cube_map) now.lights = light.all.descriptor().lights;
  now.presence = light.presence;
  now.exposure = exposure;
  return now;
}

void ReflectionMaps::update(const LightState& light, float exposure) {
  glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(Unit::irradiance));
  glBindTexture(GL_TEXTURE_CUBE_MAP, irradiance_map_.name());
  IrradianceContent irradiance{light.residual.descriptor().radiance, exposure};
  if (irradiance_content_ != irradiance) {
    fill_irradiance(light, exposure);
    irradiance_content_ = std::move(irradiance);
  }
  glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(Unit::environment));
  glBindTexture(GL_TEXTURE_CUBE_MAP, environment_map_.name());
  const bool due = style_.source == ReflectionSource::prefiltered || frames_ % style_.every_frames == 0;
  ++frames_;
  if (!due) return;
  EnvironmentContent environment = environment_content(light, exposure);
  if (environment_content_ == environment) return;
  if (style_.source == ReflectionSource::prefiltered)
    fill_prefiltered(light, exposure);
  else
    fill_cube_map(light, exposure);
  environment_content_ = std::move(environment);
}

}  // namespace lightwell::viewer
