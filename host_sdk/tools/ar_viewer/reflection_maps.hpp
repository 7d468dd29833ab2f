// Cube maps of the light: irradiance by normal, and radiance for reflections.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "ar_viewer/gl_objects.hpp"
#include "ar_viewer/light_state.hpp"

namespace lightwell::viewer {

/// Uploaded only if the light has changed. In the world's axes.
class ReflectionMaps {
 public:
  explicit ReflectionMaps(const ReflectionStyle& style);

  /// Binds the maps to Unit::irradiance and Unit::environment.
  void update(const LightState& light, float exposure);
  /// Uniform environment_levels: index of the last level; 0 if the map has one level that holds the lights.
  [[nodiscard]] float last_level() const { return static_cast<float>(levels_ - 1); }

 private:
  /// What the irradiance map was made from.
  struct IrradianceContent {
    RadianceSh residual;
    float exposure = 1;
    friend bool operator==(const IrradianceContent&, const IrradianceContent&) = default;
  };
  /// What the other one was made from: the probe's map or, without one, the harmonics; the lights where they are in it.
  struct EnvironmentContent {
    std::uint32_t map_key = 0;
    std::uint64_t map_sequence = 0;
    Quat map_rotation;
    RadianceSh residual;
    std::vector<Light> lights;
    Radiance mean;
    float presence = 1, exposure = 1;
    friend bool operator==(const EnvironmentContent&, const EnvironmentContent&) = default;
  };
  [[nodiscard]] EnvironmentContent environment_content(const LightState& light, float exposure) const;
  void fill_irradiance(const LightState& light, float exposure);
  void fill_prefiltered(const LightState& light, float exposure);
  void fill_cube_map(const LightState& light, float exposure);
  /// Without the lights.
  [[nodiscard]] static Radiance radiance(const LightState& light, const std::optional<EnvironmentView>& map,
                                         Vec3f direction, float roughness);

  /// Texels along an edge of the irradiance map: the error of interpolation is below 0.1 % of the mean irradiance.
  static constexpr int kIrradianceEdge = 32;
  /// Of level 0 where the harmonics stand for a map: their bands need no more.
  static constexpr int kHarmonicsEdge = 32;

  ReflectionStyle style_;
  int levels_ = 1;
  int frames_ = 0;
  GlTexture irradiance_map_, environment_map_;
  std::vector<Vec3f> normals_;
  std::vector<Irradiance> irradiances_;
  std::vector<Radiance> texels_;
  std::vector<std::byte> cube_map_;
  std::optional<IrradianceContent> irradiance_content_;
  std::optional<EnvironmentContent> environment_content_;
};

}  // namespace lightwell::viewer
