// Cube maps of the light: irradiance by normal, and radiance for reflections.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "ar_viewer/environment_pass.hpp"
#include "ar_viewer/gl_objects.hpp"
#include "ar_viewer/light_state.hpp"

namespace lightwell::viewer {

/// Made anew only if the light has changed. In the world's axes.
class ReflectionMaps {
 public:
  /// Errors of EnvironmentPass::make().
  [[nodiscard]] static Result<ReflectionMaps> make(const ReflectionStyle& style);

  /// The queries of the SDK.
  void query(const LightState& light, float exposure);
  /// Uploads and draws what query() of the same light found changed, and binds the maps to Unit::irradiance and
  /// Unit::environment.
  void draw(const LightState& light);
  /// Another source of reflections; the next query() makes its maps.
  void set_style(const ReflectionStyle& style);
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
    bool map_shows_lights = false;
    RadianceSh residual;
    std::vector<Light> lights;
    Radiance mean;
    float presence = 1, exposure = 1;
    friend bool operator==(const EnvironmentContent&, const EnvironmentContent&) = default;
  };
  explicit ReflectionMaps(EnvironmentPass pass);
  [[nodiscard]] EnvironmentContent environment_content(const LightState& light, float exposure) const;
  void query_irradiance(const LightState& light, float exposure);
  void query_harmonics(const LightState& light, float exposure);
  void query_cube_map(const LightState& light, float exposure);
  void draw_environment(const LightState& light);
  /// Edge of level 0 of the prefiltered map.
  [[nodiscard]] int prefiltered_edge(const LightState& light) const;

  /// Texels along an edge of the irradiance map: the error of interpolation is below 0.1 % of the mean irradiance.
  static constexpr int kIrradianceEdge = 32;
  /// Of level 0 where the harmonics stand for a map: their bands need no more.
  static constexpr int kHarmonicsEdge = 32;

  ReflectionStyle style_;
  EnvironmentPass pass_;
  int levels_ = 1;
  int frames_ = 0;
  bool irradiance_changed_ = false, environment_changed_ = false;
  GlTexture irradiance_map_, environment_map_;
  std::vector<Vec3f> normals_;
  std::vector<Irradiance> irradiances_;
  std::vector<Radiance> texels_;  ///< Of the harmonics, level by level.
  std::vector<std::byte> cube_map_;
  std::optional<IrradianceContent> irradiance_content_;
  std::optional<EnvironmentContent> environment_content_;
};

}  // namespace lightwell::viewer
