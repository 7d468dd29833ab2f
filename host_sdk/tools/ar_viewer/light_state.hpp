// The light of one frame, as the shading uses it.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include <lightwell/lighting.hpp>

#include "ar_viewer/scene.hpp"

namespace lightwell::viewer {

/// Lights with a shadow map of their own. Weaker ones are added to the harmonics as caps.
inline constexpr std::size_t kMaxShadedLights = 8;

/// A discrete light in the world.
struct ShadedLight {
  Vec3f direction;                ///< Unit, towards it from the origin of the light.
  Irradiance irradiance;          ///< At normal incidence at the origin.
  float angular_radius_rad = 0;   ///< At the origin.
  std::optional<Vec3d> position;  ///< Of a near light, m.
  float distance_m = 0;           ///< From the origin; 0 without a position.
  bool shown_in_mirror = false;   ///< By texels of the map instead of a cap (EnvironmentView::mirror).
};

/// In the world. Without the discrete lights `residual` answers irradiance() and radiance().
struct LightState {
  Shading shading = Shading::off;   ///< off also if there is no light to show.
  std::vector<ShadedLight> lights;  ///< Strongest first, at most kMaxShadedLights.
  Lighting residual;
  Lighting all;  ///< With the lights, for cube_map().
  /// With full shading the light as it came; reflections take its environment(), or else residual.radiance().
  Lighting measured;
  /// Of the map's levels, the roughness up to which reflections are the first one alone, and that from which it has no
  /// share. Caps of lights shown_in_mirror have the share of the other levels.
  std::array<float, 2> first_level{0, 1};
  Radiance mean;       ///< Of all light over the sphere.
  float presence = 1;  ///< 0 to 1: what is left of stale light; the rest of the map is `mean`.
  Pose T_world_origin;
};

/// 1 for light that is not stale; else falls from 1 to 0 in fade_s after it became stale, seconds_stale ago. Either is
/// in s.
[[nodiscard]] float stale_presence(Validity validity, double seconds_stale, double fade_s);

/// `world`: the lighting in the world (Lighting::in_world).
[[nodiscard]] LightState make_light_state(const Lighting& world, Shading shading, float presence = 1);

/// Harmonics of the same radiance in all directions.
[[nodiscard]] RadianceSh uniform_radiance(Radiance radiance);

/// Mean radiance over the sphere of all light.
[[nodiscard]] Radiance mean_radiance(const Descriptor& descriptor);

}  // namespace lightwell::viewer
