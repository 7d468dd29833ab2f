// Prefiltered environment map for reflections: octahedral levels, each prefiltered with one GGX lobe, without the
// lights.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// Octahedral map of the sphere onto the unit square (Cigolle et al. 2014, "A Survey of Efficient Representations for
/// Independent Unit Vectors", listing 1), with the map's centre at +Y and its corners at -Y.
struct OctUv {
  float u = 0, v = 0;
};

namespace detail {
/// Maps the lower half of the octahedron to the outer triangles of the square, and back.
inline void fold_lower_half(float& a, float& b) {
  const float folded_a = (1 - std::abs(b)) * std::copysign(1.0F, a);
  b = (1 - std::abs(a)) * std::copysign(1.0F, b);
  a = folded_a;
}
}  // namespace detail

/// u, v in [0, 1]; u increases with x, v with z. d need not be normalised; zero maps to the centre.
[[nodiscard]] inline OctUv oct_encode(Vec3f d) {
  const float sum = std::abs(d.x) + std::abs(d.y) + std::abs(d.z);
  if (!(sum > 0)) return {0.5F, 0.5F};
  float a = d.x / sum, b = d.z / sum;
  if (d.y < 0) detail::fold_lower_half(a, b);
  return {0.5F * (a + 1), 0.5F * (b + 1)};
}

/// The unit vector at u, v.
[[nodiscard]] inline Vec3f oct_decode(OctUv uv) {
  float a = 2 * uv.u - 1, b = 2 * uv.v - 1;
  const float y = 1 - std::abs(a) - std::abs(b);
  if (y < 0) detail::fold_lower_half(a, b);
  return normalized(Vec3f{a, y, b});
}

/// Limit that leaves room for the rest of a descriptor in a message of 64 KiB.
inline constexpr std::size_t kMaxEnvironmentTexels = 8192;
inline constexpr std::size_t kMaxEnvironmentLevels = 8;
inline constexpr std::size_t kMaxEnvironmentEdge = 64;
/// RGB9E5 itself spans 2^-24 to 2^16; with these exponents a map can hold every finite float radiance.
inline constexpr int kMinEnvironmentExponent = -150, kMaxEnvironmentExponent = 100;

[[nodiscard]] constexpr bool is_environment_edge(std::uint64_t edge) {
  return edge == 8 || edge == 16 || edge == 32 || edge == 64;
}

/// A square of edge x edge texels in the octahedral mapping: column i increases with u, row j with v,
/// texel centres are at (i + 0.5) / edge. Each texel holds radiance(d, roughness) at its centre, without the lights:
/// minus their caps, and zero where a cap is brighter than what is there.
struct EnvironmentLevel {
  int edge = 0;         ///< 8, 16, 32 or 64.
  float roughness = 0;  ///< Perceptual roughness, 0 to 1. At 0 a texel holds the mean over its solid angle.

  friend bool operator==(const EnvironmentLevel&, const EnvironmentLevel&) = default;
};

/// A whole map, or the texels that differ from a whole map, to which changes always refer, never to other changes.
/// Specification: proto/README.md, "The environment map".
struct EnvironmentMap {
  std::uint32_t key = 0;  ///< environment_key() of this whole map, or of the whole map that these changes apply to.
  /// Whole map: its levels in order of increasing roughness, with non-increasing edges. Empty: changes.
  std::vector<EnvironmentLevel> levels;
  int exponent = 0;  ///< Whole map: radiance = texel times 2^exponent, also for the texels of changes to it.
  /// Whole map: longest interval between whole maps, ms. A map older than three intervals is out of date.
  std::uint32_t key_interval_ms = 0;
  /// RGB9E5 (pixel.hpp). Whole map: level by level, rows from the top. Changes: the changed texels in that order.
  std::vector<std::uint32_t> texels;
  /// Changes: run lengths, alternately of unchanged texels and of changed texels (those in `texels`).
  std::vector<std::uint32_t> runs;
  /// Tracks of the lights that texels show better than caps, ascending. The other two say what the first level is with
  /// these lights in it: run lengths, alternately of texels that are as in the map and of those in `light_texels`. They
  /// belong to this moment, also in changes: they do not refer to those of another map. All three are empty or none is.
  std::vector<std::uint32_t> light_tracks, light_runs, light_texels;

  [[nodiscard]] bool whole() const { return !levels.empty(); }
  friend bool operator==(const EnvironmentMap&, const EnvironmentMap&) = default;
};

[[nodiscard]] constexpr std::size_t texel_count(std::span<const EnvironmentLevel> levels) {
  std::size_t count = 0;
  for (const EnvironmentLevel& level : levels)
    count += static_cast<std::size_t>(level.edge) * static_cast<std::size_t>(level.edge);
  return count;
}

/// invalid_argument, naming the field, for a map that violates the specification. Checked when encoding and decoding.
[[nodiscard]] Status environment_problem(const EnvironmentMap& map);

/// A hash of the content of a whole map, never 0.
[[nodiscard]] std::uint32_t environment_key(const EnvironmentMap& whole);

/// Writes `whole` with `changes` applied into `out`, whose memory is reused; the key stays that of `whole`, the lights
/// in the first level are those of `changes`. Returns false and leaves `out` unchanged if the changes belong to another
/// map or exceed the size of this one. `out` must not alias either argument.
[[nodiscard]] bool apply_changes(const EnvironmentMap& whole, const EnvironmentMap& changes, EnvironmentMap& out);

/// The first level of a whole map with the lights of `light_tracks` in it, as a map of one level without a key.
[[nodiscard]] EnvironmentMap first_level_with_lights(const EnvironmentMap& whole);

/// The two levels between which a roughness is: radiance = (1 - upper_share) * of `lower` + upper_share * of `upper`.
/// One level, twice, where the roughness is outside of those of the map or NaN.
struct EnvironmentLevelPair {
  std::size_t lower = 0, upper = 0;  ///< Indices of levels.
  float upper_share = 0;
};
/// `levels`: of a whole map, not empty.
[[nodiscard]] EnvironmentLevelPair levels_around(std::span<const EnvironmentLevel> levels, float perceptual_roughness);

/// Share of the first level in radiance(d, r): 1 up to its roughness, 0 from that of the second. `levels`: not empty.
[[nodiscard]] float first_level_share(std::span<const EnvironmentLevel> levels, float perceptual_roughness);

/// Four texels around a place on the square, numbered within their level, left before right and upper before lower, and
/// how far the place is from the first to the second and from the first to the third, 0 to 1. Across an edge of the
/// square the neighbours are the adjacent texels on the sphere.
struct TexelCorners {
  std::array<std::size_t, 4> texel;
  float fx, fy;

  /// Interpolates `value(texel)` bilinearly.
  template <class Value>
  [[nodiscard]] auto bilinear(const Value& value) const {
    return (value(texel[0]) * (1 - fx) + value(texel[1]) * fx) * (1 - fy) +
           (value(texel[2]) * (1 - fx) + value(texel[3]) * fx) * fy;
  }
};
[[nodiscard]] TexelCorners corners_around(int edge, OctUv uv);

/// Unit vector towards the centre of the texel in column i, row j of a level with this edge.
[[nodiscard]] Vec3f texel_direction(int edge, int i, int j);

/// The radiance of a texel; its luminance is in cd/m² if units are absolute.
[[nodiscard]] Radiance texel_radiance(std::uint32_t texel, int exponent);

/// radiance(d, r) without the lights, in the map's frame. Bilinear interpolation between the centres of four texels,
/// across the edges of the square to the adjacent texels on the sphere; linear interpolation in roughness between two
/// levels, clamped to the first and the last level. Zero for a map that is not whole and for a direction that is zero
/// or not finite.
[[nodiscard]] Radiance environment_radiance(const EnvironmentMap& whole, Vec3f direction, float perceptual_roughness);

}  // namespace lightwell
