#include <algorithm>
#include <array>
#include <bit>
#include <functional>
#include <string>

#include <lightwell/bytes.hpp>
#include <lightwell/descriptor.hpp>
#include <lightwell/environment.hpp>
#include <lightwell/pixel.hpp>

namespace lightwell {
namespace {

/// Index of the texel in column i, row j, each from -1 to edge. Beyond an edge of the square the sphere continues at
/// the same edge with the order of texels reversed, because each side of an octahedral map is folded at its middle.
std::size_t texel_at(int edge, int i, int j) {
  if (i < 0 || i >= edge) {
    i = i < 0 ? -1 - i : 2 * edge - 1 - i;
    j = edge - 1 - j;
  }
  if (j < 0 || j >= edge) {
    j = j < 0 ? -1 - j : 2 * edge - 1 - j;
    i = edge - 1 - i;
  }
  return static_cast<std::size_t>(j) * static_cast<std::size_t>(edge) + static_cast<std::size_t>(i);
}

/// c 2^exponent. In double: 2^-150 is below the range of float, though the product may be within it.
Radiance scaled(Radiance c, int exponent) {
  const double unit = std::ldexp(1.0, exponent);
  const auto times = [unit](float v) { return static_cast<float>(static_cast<double>(v) * unit); };
  return {times(c.r), times(c.g), times(c.b)};
}

Radiance bilinear(std::span<const std::uint32_t> texels, int edge, OctUv uv, int exponent) {
  const auto value = [&](std::size_t texel) {
    const std::array<float, 3> c = rgb9e5_decode(texels[texel]);
    return Radiance{c[0], c[1], c[2]};
  };
  return scaled(corners_around(edge, uv).bilinear(value), exponent);
}

Status invalid_map(const std::string& what) { return invalid_argument("descriptor: environment." + what); }

/// Number of texels over which the runs of changes reach, and how many of them change.
struct RunTotals {
  std::uint64_t reach = 0, changed = 0;

  explicit RunTotals(std::span<const std::uint32_t> runs) {
    for (std::size_t k = 0; k < runs.size(); ++k) {
      reach += runs[k];
      if (k % 2 == 1) changed += runs[k];
    }
  }
};

/// Whether the runs reach no further than `count` texels and change as many as there are in `texels`.
bool fit(std::span<const std::uint32_t> runs, std::span<const std::uint32_t> texels, std::size_t count) {
  const RunTotals totals(runs);
  return totals.reach <= count && totals.changed == texels.size();
}

/// Writes `texels` to those of `out` that the runs change. Requires fit().
void replace_runs(std::span<const std::uint32_t> runs, std::span<const std::uint32_t> texels,
                  std::span<std::uint32_t> out) {
  std::size_t at = 0, from = 0;
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const std::size_t run = runs[k];
    if (k % 2 == 1) {
      std::copy_n(texels.begin() + static_cast<std::ptrdiff_t>(from), run,
                  out.begin() + static_cast<std::ptrdiff_t>(at));
      from += run;
    }
    at += run;
  }
}

/// `name`: of the field with the runs. `limit`: most texels over which they may reach.
Status problem_of_runs(const std::string& name, std::span<const std::uint32_t> runs, std::size_t limit) {
  if (runs.size() % 2 != 0) return invalid_map(name + ": the number is odd; they are pairs");
  // Canonical form: only the first run may be empty.
  if (runs.size() > 1 && std::ranges::find(runs.begin() + 1, runs.end(), 0U) != runs.end())
    return invalid_map(name + ": one is empty");
  if (RunTotals(runs).reach > limit) return invalid_map(name + ": they exceed the size of any map");
  return {};
}

/// `limit`: number of texels of the first level, or of the largest that there can be.
Status problem_of_lights(const EnvironmentMap& map, std::size_t limit) {
  const std::vector<std::uint32_t>& tracks = map.light_tracks;
  if (tracks.size() > kMaxLights) return invalid_map("light_tracks: there are more than 64");
  if (!tracks.empty() && tracks.front() == 0) return invalid_map("light_tracks: 0 is not a track");
  if (std::ranges::adjacent_find(tracks, std::greater_equal<>()) != tracks.end())
    return invalid_map("light_tracks: they must ascend");
  if (const Status s = problem_of_runs("light_runs", map.light_runs, limit); !s.ok()) return s;
  if (!fit(map.light_runs, map.light_texels, limit))
    return invalid_map("light_texels: the length does not match light_runs");
  if (tracks.empty() != map.light_texels.empty()) return invalid_map("light_tracks and light_texels: one is empty");
  return {};
}

Status problem_of_whole(const EnvironmentMap& map) {
  if (map.levels.size() > kMaxEnvironmentLevels) return invalid_map("levels: there are more than 8");
  for (std::size_t k = 0; k < map.levels.size(); ++k) {
    const EnvironmentLevel& level = map.levels[k];
    if (level.edge < 0 || !is_environment_edge(static_cast<std::uint64_t>(level.edge)))
      return invalid_map("levels: an edge must be 8, 16, 32 or 64");
    if (!(level.roughness >= 0 && level.roughness <= 1)) return invalid_map("levels: a roughness must be 0 to 1");
    if (k == 0) continue;
    if (level.edge > map.levels[k - 1].edge) return invalid_map("levels: an edge is larger than the one before");
    if (!(level.roughness > map.levels[k - 1].roughness)) return invalid_map("levels: roughness must increase");
  }
  const std::size_t count = texel_count(map.levels);
  if (count > kMaxEnvironmentTexels) return invalid_map("levels have more than 8192 texels");
  if (map.texels.size() != count) return invalid_map("texels: the length does not match the levels");
  if (map.exponent < kMinEnvironmentExponent || map.exponent > kMaxEnvironmentExponent)
    return invalid_map("exponent is out of range");
  if (!map.runs.empty()) return invalid_map("runs: not allowed in a whole map");
  if (const Status s = problem_of_lights(map, texel_count(std::span(map.levels).first(1))); !s.ok()) return s;
  if (map.key != environment_key(map)) return invalid_map("key does not match the content of the map");
  return {};
}

Status problem_of_changes(const EnvironmentMap& map) {
  if (map.exponent != 0) return invalid_map("exponent: not allowed in changes");
  if (map.key_interval_ms != 0) return invalid_map("key_interval_ms: not allowed in changes");
  if (const Status s = problem_of_runs("runs", map.runs, kMaxEnvironmentTexels); !s.ok()) return s;
  if (!fit(map.runs, map.texels, kMaxEnvironmentTexels))
    return invalid_map("texels: the length does not match the runs");
  return problem_of_lights(map, kMaxEnvironmentEdge * kMaxEnvironmentEdge);
}

}  // namespace

Status environment_problem(const EnvironmentMap& map) {
  if (map.key == 0) return invalid_map("key is 0");
  return map.whole() ? problem_of_whole(map) : problem_of_changes(map);
}

std::uint32_t environment_key(const EnvironmentMap& whole) {
  std::uint32_t crc = 0;
  const auto add = [&](std::uint32_t number) {
    std::array<std::byte, 4> bytes;
    put_le(bytes.data(), number);
    crc = crc32c(bytes, crc);
  };
  add(static_cast<std::uint32_t>(whole.exponent));
  for (const EnvironmentLevel& level : whole.levels) {
    add(static_cast<std::uint32_t>(level.edge));
    add(std::bit_cast<std::uint32_t>(level.roughness));
  }
  for (const std::uint32_t texel : whole.texels) add(texel);
  return crc == 0 ? 1 : crc;
}

bool apply_changes(const EnvironmentMap& whole, const EnvironmentMap& changes, EnvironmentMap& out) {
  if (!whole.whole() || changes.whole() || changes.key != whole.key) return false;
  if (!fit(changes.runs, changes.texels, whole.texels.size()) ||
      !fit(changes.light_runs, changes.light_texels, texel_count(std::span(whole.levels).first(1))))
    return false;
  out = whole;
  replace_runs(changes.runs, changes.texels, out.texels);
  out.light_tracks = changes.light_tracks;
  out.light_runs = changes.light_runs;
  out.light_texels = changes.light_texels;
  return true;
}

EnvironmentMap first_level_with_lights(const EnvironmentMap& whole) {
  EnvironmentMap out;
  if (!whole.whole()) return out;
  out.levels = {whole.levels.front()};
  out.exponent = whole.exponent;
  out.texels.assign(whole.texels.begin(), whole.texels.begin() + static_cast<std::ptrdiff_t>(texel_count(out.levels)));
  if (fit(whole.light_runs, whole.light_texels, out.texels.size()))
    replace_runs(whole.light_runs, whole.light_texels, out.texels);
  return out;
}

TexelCorners corners_around(int edge, OctUv uv) {
  const float x = uv.u * static_cast<float>(edge) - 0.5F, y = uv.v * static_cast<float>(edge) - 0.5F;
  const float left = std::floor(x), top = std::floor(y);
  const int i = static_cast<int>(left), j = static_cast<int>(top);
  return {{texel_at(edge, i, j), texel_at(edge, i + 1, j), texel_at(edge, i, j + 1), texel_at(edge, i + 1, j + 1)},
          x - left,
          y - top};
}

Vec3f texel_direction(int edge, int i, int j) {
  const auto n = static_cast<float>(edge);
  return oct_decode({(static_cast<float>(i) + 0.5F) / n, (static_cast<float>(j) + 0.5F) / n});
}

Radiance texel_radiance(std::uint32_t texel, int exponent) {
  const std::array<float, 3> c = rgb9e5_decode(texel);
  return scaled({c[0], c[1], c[2]}, exponent);
}

EnvironmentLevelPair levels_around(std::span<const EnvironmentLevel> levels, float perceptual_roughness) {
  // The negated comparisons select the last level for NaN.
  std::size_t upper = 0;
  while (upper + 1 < levels.size() && !(perceptual_roughness <= levels[upper].roughness)) ++upper;
  if (upper == 0 || !(perceptual_roughness < levels[upper].roughness)) return {upper, upper, 0};
  const float low = levels[upper - 1].roughness, high = levels[upper].roughness;
  return {upper - 1, upper, (perceptual_roughness - low) / (high - low)};
}

float first_level_share(std::span<const EnvironmentLevel> levels, float perceptual_roughness) {
  const EnvironmentLevelPair pair = levels_around(levels, perceptual_roughness);
  if (pair.lower != 0) return 0;
  return pair.upper == 0 ? 1 : 1 - pair.upper_share;
}

Radiance environment_radiance(const EnvironmentMap& whole, Vec3f direction, float perceptual_roughness) {
  const Vec3f d = normalized(direction);
  if (!whole.whole() || d == Vec3f{}) return {};
  const OctUv uv = oct_encode(d);
  const std::span levels(whole.levels);
  const EnvironmentLevelPair pair = levels_around(levels, perceptual_roughness);
  const auto value = [&](std::size_t k) {
    return bilinear(std::span(whole.texels).subspan(texel_count(levels.first(k)), texel_count(levels.subspan(k, 1))),
                    levels[k].edge, uv, whole.exponent);
  };
  if (pair.lower == pair.upper) return value(pair.upper);
  return value(pair.lower) * (1 - pair.upper_share) + value(pair.upper) * pair.upper_share;
}

}  // namespace lightwell
