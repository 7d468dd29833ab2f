// A light field as a grid of Unity's light probes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include <lightwell/field.hpp>
#include <lightwell/result.hpp>

namespace lightwell::tool {

/// Largest number of points of a grid: 40 MB of JSON, which an engine's parser takes whole, and 7 to 20 s.
inline constexpr std::size_t kMaxGridPoints = 100'000;

/// Points of an axis-aligned box, both ends included.
struct PointGrid {
  Vec3d from, to;                         ///< Corners, m, world; to >= from.
  std::array<std::uint32_t, 3> counts{};  ///< Along x, y, z; 1 where from and to are the same.

  /// Equal steps of at most `spacing_m`. invalid_argument for a coordinate that is not finite or beyond 1000 km, a
  /// corner `to` below `from`, or a spacing that is not positive; resource_exhausted beyond kMaxGridPoints.
  [[nodiscard]] static Result<PointGrid> with_spacing(Vec3d from, Vec3d to, double spacing_m);

  [[nodiscard]] std::size_t size() const { return std::size_t{counts[0]} * counts[1] * counts[2]; }
};

/// Where the file holds the lights that the field has found.
enum class GridLights : std::uint8_t {
  in_harmonics,  ///< All light is in the harmonics.
  /// Lights of the file, for the engine to shade and shadow: distant ones, and placed ones that shine evenly
  /// (is_even()). The harmonics are without these.
  apart,
};

/// Whether its radiant intensity differs between directions by at most a tenth: a point light stands for it.
[[nodiscard]] bool is_even(const FieldLight& light);

/// Writes the field at each point of the grid in Unity's axes and convention of SphericalHarmonicsL2 (to_unity()), as
/// JSON; its keys: README. A point without an estimate, or at a light (FieldFlag::at_light), has validity 0 and zeros.
/// Call it from the thread that updates the field. failed_precondition without a probe in the field; unavailable where
/// the file cannot be written.
[[nodiscard]] Status write_field_grid(const LightField& field, HostTime now, const PointGrid& grid, GridLights lights,
                                      const std::string& path);

}  // namespace lightwell::tool
