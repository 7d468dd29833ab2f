#include <algorithm>
#include <array>
#include <bit>
#include <string>

#include <lightwell/bytes.hpp>
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
  const float x = uv.u * static_cast<float>(edge) - 0.5F, y = uv.v * static_cast<float>(edge) - 0.5F;
  const float left = std::floor(x), top = std::floor(y);
  const float fx = x - left, fy = y - top;
  const int i = static_cast<int>(left), j = static_cast<int>(top);
  const auto at = [&](int di, int dj) {
    const std::array<float, 3> c = rgb9e5_decode(texels[texel_at(edge, i + di, j + dj)]);
    return Radiance{c[0], c[1], c[2]};
  };
  const Radiance c = (at(0, 0) * (1 - fx) + at(1, 0) * fx) * (1 - fy) + (at(0, 1) * (1 - fx) + at(1, 1) * fx) * fy;
  return scaled(c, exponent);
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
  if (map.key != environment_key(map)) return invalid_map("key does not match the content of the map");
  return {};
}

Status problem_of_changes(const EnvironmentMap& map) {
  if (map.exponent != 0) return invalid_map("exponent: not allowed in changes");
  if (map.key_interval_ms != 0) return invalid_map("key_interval_ms: not allowed in changes");
  if (map.runs.size() % 2 != 0) return invalid_map("runs: the number is odd; they are pairs");
  // Canonical form: only the first run may be empty.
  if (map.runs.size() > 1 && std::ranges::find(map.runs.begin() + 1, map.runs.end(), 0U) != map.runs.end())
    return invalid_map("runs: one is empty");
  const RunTotals totals(map.runs);
  if (totals.reach > kMaxEnvironmentTexels) return invalid_map("runs: they exceed the size of any map");
  if (map.texels.size() != totals.changed) return invalid_map("texels: the length does not match the runs");
  return {};
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
  const RunTotals totals(changes.runs);
  if (totals.reach > whole.texels.size() || totals.changed != changes.texels.size()) return false;
  out = whole;
  std::size_t at = 0, from = 0;
  for (std::size_t k = 0; k < changes.runs.size(); ++k) {
    const std::size_t run = changes.runs[k];
    if (k % 2 == 1) {
      std::copy_n(changes.texels.begin() + static_cast<std::ptrdiff_t>(from), run,
                  out.texels.begin() + static_cast<std::ptrdiff_t>(at));
      from += run;
    }
    at += run;
  }
  return true;
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
