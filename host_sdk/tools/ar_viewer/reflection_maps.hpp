// Cube maps of the light: irradiance by normal, and radiance for reflections.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "tools/ar_viewer/gl_objects.hpp"
#include "tools/ar_viewer/light_state.hpp"

namespace lightwell::viewer {

/// Unit vector of a texel of an OpenGL cube map (GL_TEXTURE_CUBE_MAP_POSITIVE_X + face); s, t: -1 to 1 across the face.
[[nodiscard]] Vec3f cube_direction(int face, float s, float t);

/// Uploaded only if the light has changed. In the world's axes.
class ReflectionMaps {
 public:
  explicit ReflectionMaps(const ReflectionStyle& style);

  /// Binds the maps to Unit::irradiance and Unit::environment.
  void update(const LightState& light, float exposure);
  /// Uniform environment_levels: index of the last level; 0 if the map has one level that holds the lights.
  [[nodiscard]] float last_level() const { return static_cast<float>(levels_ - 1); }

 private:
  /// What the maps were made from.
  struct Content {
    RadianceSh residual;
    std::vector<Irradiance> lights;
    std::uint32_t map_key = 0;
    std::uint64_t map_sequence = 0;
    Quat map_rotation;
    float presence = 1, exposure = 1;
    friend bool operator==(const Content&, const Content&) = default;
  };
  void fill_irradiance(const LightState& light, float exposure);
  void fill_environment(const LightState& light, float exposure);
  /// Without the lights.
  [[nodiscard]] static Radiance radiance(const LightState& light, const std::optional<EnvironmentView>& map,
                                         Vec3f direction, float roughness);
  /// Radiance of the lights as caps in a texel around `direction` of this angular size, rad.
  [[nodiscard]] static Radiance caps(const LightState& light, Vec3f direction, float texel_rad);

  /// Texels along an edge of the irradiance map: the error of interpolation is below 0.1 % of the mean irradiance.
  static constexpr int kIrradianceEdge = 32;

  ReflectionStyle style_;
  int levels_ = 1;
  int frames_ = 0;
  GlTexture irradiance_map_, environment_map_;
  std::vector<Vec3f> normals_;
  std::vector<Irradiance> irradiances_;
  std::vector<Radiance> texels_;
  std::optional<Content> content_;
};

}  // namespace lightwell::viewer
