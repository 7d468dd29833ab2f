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

int levels_from(int edge) {
  int levels = 1;
  for (int e = edge; e > kLastEdge; e /= 2) ++levels;
  return levels;
}

float roughness_of(int level, int levels) {
  return static_cast<float>(level) / static_cast<float>(std::max(levels - 1, 1));
}

/// Returns the texels after those of this level. nullptr: memory that is drawn to later.
const float* upload(int level, int edge, GLenum format, const float* texels) {
  const std::ptrdiff_t face_size = static_cast<std::ptrdiff_t>(edge) * edge * (format == GL_RGB ? 3 : 4);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  for (GLenum face = 0; face < 6; ++face) {
    glTexImage2D(GL_TEXTURE_CUBE_MAP_POSITIVE_X + face, level, GL_RGBA32F, edge, edge, 0, format, GL_FLOAT, texels);
    if (texels != nullptr) texels += face_size;
  }
  return texels;
}

/// Of the cube map that is bound.
void set_last_level(int level) { glTexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_MAX_LEVEL, level); }

void activate(Unit unit, const GlTexture& cube) {
  glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
  glBindTexture(GL_TEXTURE_CUBE_MAP, cube.name());
}

}  // namespace

ReflectionMaps::ReflectionMaps(EnvironmentPass pass) : pass_(std::move(pass)) {
  glEnable(GL_TEXTURE_CUBE_MAP_SEAMLESS);
  for_texels(kIrradianceEdge, [this](Vec3f d) { normals_.push_back(d); });
  irradiances_.resize(normals_.size());
  glBindTexture(GL_TEXTURE_CUBE_MAP, irradiance_map_.name());
  set_sampling(GL_TEXTURE_CUBE_MAP, GL_LINEAR, GL_LINEAR, GL_CLAMP_TO_EDGE);
  glBindTexture(GL_TEXTURE_CUBE_MAP, environment_map_.name());
  set_sampling(GL_TEXTURE_CUBE_MAP, GL_LINEAR_MIPMAP_LINEAR, GL_LINEAR, GL_CLAMP_TO_EDGE);
}

Result<ReflectionMaps> ReflectionMaps::make(const ReflectionStyle& style) {
  Result<EnvironmentPass> pass = EnvironmentPass::make();
  if (!pass.ok()) return pass.status();
  ReflectionMaps maps(std::move(*pass));
  maps.style_ = style;
  return maps;
}

void ReflectionMaps::set_style(const ReflectionStyle& style) {
  style_ = style;
  frames_ = 0;
  environment_content_.reset();
}

int ReflectionMaps::prefiltered_edge(const LightState& light) const {
  return light.measured.environment() ? style_.edge : std::min(style_.edge, kHarmonicsEdge);
}

void ReflectionMaps::query_irradiance(const LightState& light, float exposure) {
  (void)light.residual.irradiance(normals_, irradiances_);
  for (Irradiance& e : irradiances_) e = e * exposure;
}

void ReflectionMaps::query_harmonics(const LightState& light, float exposure) {
  const int edge = prefiltered_edge(light), levels = levels_from(edge);
  texels_.clear();
  for (int level = 0; level < levels; ++level)
    for_texels(edge >> level, [&](Vec3f d) {
      texels_.push_back(light.residual.radiance(d, roughness_of(level, levels)).value * exposure);
    });
}

void ReflectionMaps::query_cube_map(const LightState& light, float exposure) {
  const CubeMapOptions options{style_.edge, CubeFormat::rgba32f, LightsIncluded::yes, exposure};
  cube_map_.resize(cube_map_bytes(options.edge, options.format));
  (void)cube_map(light.all, options, cube_map_);
}

ReflectionMaps::EnvironmentContent ReflectionMaps::environment_content(const LightState& light, float exposure) const {
  EnvironmentContent now;
  if (const auto map = light.measured.environment()) {
    now.map_key = map->map.key;
    now.map_sequence = map->sequence;
    now.map_rotation = map->rotation;
    now.map_shows_lights = &map->mirror != &map->map;
    if (light.presence < 1) now.mean = light.mean;
  } else {
    now.residual = light.residual.descriptor().radiance;
  }
  if (style_.source == ReflectionSource::cube_map) now.lights = light.all.descriptor().lights;
  now.presence = light.presence;
  now.exposure = exposure;
  return now;
}

void ReflectionMaps::query(const LightState& light, float exposure) {
  IrradianceContent irradiance{light.residual.descriptor().radiance, exposure};
  if (irradiance_content_ != irradiance) {
    query_irradiance(light, exposure);
    irradiance_content_ = std::move(irradiance);
    irradiance_changed_ = true;
  }
  const bool due = style_.source == ReflectionSource::prefiltered || frames_ % style_.every_frames == 0;
  ++frames_;
  if (!due) return;
  EnvironmentContent environment = environment_content(light, exposure);
  if (environment_content_ == environment) return;
  if (style_.source == ReflectionSource::cube_map)
    query_cube_map(light, exposure);
  else if (!light.measured.environment())
    query_harmonics(light, exposure);
  environment_content_ = std::move(environment);
  environment_changed_ = true;
}

void ReflectionMaps::draw_environment(const LightState& light) {
  levels_ = 1;
  if (style_.source == ReflectionSource::cube_map) {
    activate(Unit::environment, environment_map_);
    upload(0, style_.edge, GL_RGBA, reinterpret_cast<const float*>(cube_map_.data()));  // NOLINT: rgba32f
  } else {
    const int edge = prefiltered_edge(light);
    levels_ = levels_from(edge);
    const std::optional<EnvironmentView> map = light.measured.environment();
    const float exposure = environment_content_->exposure;
    if (map) pass_.upload(*map, {exposure * light.presence, light.mean * (exposure * (1 - light.presence))});
    const float* texels = map ? nullptr : &texels_.front().r;
    activate(Unit::environment, environment_map_);
    for (int level = 0; level < levels_; ++level) texels = upload(level, edge >> level, GL_RGB, texels);
    // Levels after the first can be drawn to when all are there (OpenGL 3.3, 4.4.4: mipmap cube complete).
    set_last_level(levels_ - 1);
    for (int level = 0; map && level < levels_; ++level)
      pass_.draw(map->map, environment_map_.name(), level, edge >> level, roughness_of(level, levels_));
  }
  activate(Unit::environment, environment_map_);
  set_last_level(levels_ - 1);
}

void ReflectionMaps::draw(const LightState& light) {
  activate(Unit::irradiance, irradiance_map_);
  if (std::exchange(irradiance_changed_, false)) upload(0, kIrradianceEdge, GL_RGB, &irradiances_.front().r);
  if (std::exchange(environment_changed_, false)) draw_environment(light);
  activate(Unit::environment, environment_map_);
}

}  // namespace lightwell::viewer
