// Interpolation between light positions, by direction.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include <lightwell/geometry.hpp>

namespace lightwell::image_object {

/// On an arc two on either side. More would widen the edges of shadows.
inline constexpr std::size_t kMaxNeighbours = 4;

/// Weights of captured lights that sum to 1.
struct LightWeights {
  struct Entry {
    std::size_t light = 0;
    double weight = 0;
  };
  std::array<Entry, kMaxNeighbours> entries{};
  std::size_t count = 0;
  double outside_rad = 0;  ///< Angle to the nearest captured light.
};

/// The captured light whose direction is nearest. Directions are unit vectors, at least one.
[[nodiscard]] LightWeights nearest_light(std::span<const Vec3f> directions, Vec3d towards);

/// Weights of the nearest captured lights: multiquadric interpolation over their directions (Hardy 1971), which is
/// exact at each of them. A direction outside of their hull is first replaced by the nearest one inside, on an edge or
/// a triangle of three of them, so that nothing is extrapolated. Equal directions among the lights are allowed.
[[nodiscard]] LightWeights smooth_lights(std::span<const Vec3f> directions, Vec3d towards);

}  // namespace lightwell::image_object
