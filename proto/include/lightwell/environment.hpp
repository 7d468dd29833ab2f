// The prefiltered map for reflections: radiance over octahedral squares, one GGX lobe a level, lights left out.
//   EnvironmentLevel, EnvironmentMap   a whole map, or what changed since a whole one
//   texel_count, environment_key       what a whole map is recognised by
//   apply_changes                        a whole map with changes applied
//   texel_direction, texel_radiance    one texel
//   environment_radiance               what a map says of a direction and a roughness
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>

namespace lightwell {

/// More would not leave room for the rest of a message of 64 KiB.
inline constexpr std::size_t kMaxEnvironmentTexels = 8192;
inline constexpr std::size_t kMaxEnvironmentLevels = 8;
/// RGB9E5 spans 2^-24 to 2^16 by itself; with these every finite radiance is a float on either side.
inline constexpr int kMinEnvironmentExponent = -150, kMaxEnvironmentExponent = 100;

[[nodiscard]] constexpr bool is_environment_edge(std::uint64_t edge) {
  return edge == 8 || edge == 16 || edge == 32 || edge == 64;
}

/// A square of edge x edge texels, octahedral as in octahedral.hpp: column i grows with u, row j with v, texel centres
/// at (i + 0.5) / edge. Each texel holds radiance(d, roughness) at its centre, without the lights.
struct EnvironmentLevel {
  int edge = 0;         ///< 8, 16, 32 or 64.
  float roughness = 0;  ///< Perceptual, 0 to 1. At 0 a texel is the mean over its solid angle.

  friend bool operator==(const EnvironmentLevel&, const EnvironmentLevel&) = default;
};

/// A whole map, or the texels that differ from a whole one. Changes always refer to a whole map and never to other
/// changes, so that a reader may miss any message: with the whole map it understands every change to it.
struct EnvironmentMap {
  /// environment_key() of the whole map that this is, or that this changes. Never 0. Made of content: what bears the
  /// same key is the same map, from whichever run of a probe it came.
  std::uint32_t key = 0;
  /// Of a whole map, by rising roughness, edges never growing. Empty: changes.
  std::vector<EnvironmentLevel> levels;
  int exponent = 0;  ///< Of a whole map: radiance is the texel times 2^exponent, in changes to it too.
  /// Of a whole map: another whole one comes at least so often. A map older than three such intervals is no more.
  std::uint32_t key_interval_ms = 0;
  /// RGB9E5 (pixel.hpp). Whole: level after level, rows from the top. Changes: the changed texels in that order.
  std::vector<std::uint32_t> texels;
  /// Of changes: how many texels are as in the whole map, how many follow in `texels`, and so on in turns.
  std::vector<std::uint32_t> runs;

  [[nodiscard]] bool whole() const { return !levels.empty(); }
  friend bool operator==(const EnvironmentMap&, const EnvironmentMap&) = default;
};

[[nodiscard]] constexpr std::size_t texel_count(std::span<const EnvironmentLevel> levels) {
  std::size_t count = 0;
  for (const EnvironmentLevel& level : levels)
    count += static_cast<std::size_t>(level.edge) * static_cast<std::size_t>(level.edge);
  return count;
}

/// CRC-32C over what a whole map says: exponent, then edge and roughness (as IEEE 754 bits) of each level, then the
/// texels, every number in four bytes, little-endian. 1 where that is 0.
[[nodiscard]] std::uint32_t environment_key(const EnvironmentMap& whole);

/// Into `out`, whose memory is used again: `whole` with `changes`. Its key stays that of `whole`. False, and `out` is
/// untouched, where the changes are to another map or reach beyond this one. `out` may be neither of the two.
[[nodiscard]] bool apply_changes(const EnvironmentMap& whole, const EnvironmentMap& changes, EnvironmentMap& out);

/// Unit, towards the centre of column i, row j of a level.
[[nodiscard]] Vec3f texel_direction(int edge, int i, int j);

/// The radiance that a texel stands for: cd/m² by luminance where units are absolute.
[[nodiscard]] Radiance texel_radiance(std::uint32_t texel, int exponent);

/// radiance(d, r) without the lights, in the map's frame: bilinear between the centres of four texels, over the
/// square's edges as the sphere goes on there, and linear in roughness between the two levels around it; beyond the
/// first and the last level it is that level's. Zero for a map that is not whole and for a direction that is zero or
/// not finite.
[[nodiscard]] Radiance environment_radiance(const EnvironmentMap& whole, Vec3f direction, float perceptual_roughness);

}  // namespace lightwell
