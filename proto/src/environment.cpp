#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include <lightwell/checksum.hpp>
#include <lightwell/environment.hpp>
#include <lightwell/octahedral.hpp>
#include <lightwell/pixel.hpp>

namespace lightwell {
namespace {

/// CRC-32C of 32-bit numbers in little-endian byte order, buffered.
class Checksum {
 public:
  void add(std::uint32_t v) {
    for (int k = 0; k < 4; ++k) bytes_[used_++] = static_cast<std::byte>(v >> (8 * k) & 255U);
    if (used_ == bytes_.size()) flush();
  }
  [[nodiscard]] std::uint32_t value() {
    flush();
    return crc_;
  }

 private:
  void flush() {
    crc_ = crc32c(std::span(bytes_).first(used_), crc_);
    used_ = 0;
  }
  std::array<std::byte, 1024> bytes_{};
  std::size_t used_ = 0;
  std::uint32_t crc_ = 0;
};

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

Radiance bilinear(std::span<const std::uint32_t> texels, int edge, OctUv uv, int exponent) {
  const float x = uv.u * static_cast<float>(edge) - 0.5F, y = uv.v * static_cast<float>(edge) - 0.5F;
  const float left = std::floor(x), top = std::floor(y);
  const float fx = x - left, fy = y - top;
  const int i = static_cast<int>(left), j = static_cast<int>(top);
  const auto at = [&](int di, int dj) { return texel_radiance(texels[texel_at(edge, i + di, j + dj)], exponent); };
  return (at(0, 0) * (1 - fx) + at(1, 0) * fx) * (1 - fy) + (at(0, 1) * (1 - fx) + at(1, 1) * fx) * fy;
}

}  // namespace

std::uint32_t environment_key(const EnvironmentMap& whole) {
  Checksum sum;
  sum.add(static_cast<std::uint32_t>(whole.exponent));
  for (const EnvironmentLevel& level : whole.levels) {
    sum.add(static_cast<std::uint32_t>(level.edge));
    sum.add(std::bit_cast<std::uint32_t>(level.roughness));
  }
  for (const std::uint32_t texel : whole.texels) sum.add(texel);
  const std::uint32_t crc = sum.value();
  return crc == 0 ? 1 : crc;
}

bool apply_changes(const EnvironmentMap& whole, const EnvironmentMap& changes, EnvironmentMap& out) {
  if (!whole.whole() || changes.whole() || changes.key != whole.key) return false;
  std::uint64_t reach = 0, taken = 0;
  for (std::size_t k = 0; k < changes.runs.size(); ++k) {
    reach += changes.runs[k];
    if (k % 2 == 1) taken += changes.runs[k];
  }
  if (reach > whole.texels.size() || taken != changes.texels.size()) return false;
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
  // In double: 2^-150 is below the range of float, though the product may be within it.
  const double unit = std::ldexp(1.0, exponent);
  return {static_cast<float>(c[0] * unit), static_cast<float>(c[1] * unit), static_cast<float>(c[2] * unit)};
}

Radiance environment_radiance(const EnvironmentMap& whole, Vec3f direction, float perceptual_roughness) {
  const Vec3f d = normalized(direction);
  if (!whole.whole() || d == Vec3f{}) return {};
  const OctUv uv = oct_encode(d);
  const auto& levels = whole.levels;
  // The negated comparison selects the last level for NaN.
  std::size_t upper = 0, offset = 0, lower_offset = 0;
  const auto texels_of = [&](std::size_t k) { return texel_count(std::span(levels).subspan(k, 1)); };
  while (upper + 1 < levels.size() && !(perceptual_roughness <= levels[upper].roughness)) {
    lower_offset = offset;
    offset += texels_of(upper);
    ++upper;
  }
  const std::span<const std::uint32_t> texels = whole.texels;
  const auto value = [&](std::size_t k, std::size_t from) {
    return bilinear(texels.subspan(from, texels_of(k)), levels[k].edge, uv, whole.exponent);
  };
  if (upper == 0 || !(perceptual_roughness < levels[upper].roughness)) return value(upper, offset);
  const float low = levels[upper - 1].roughness, high = levels[upper].roughness;
  const float f = (perceptual_roughness - low) / (high - low);
  return value(upper - 1, lower_offset) * (1 - f) + value(upper, offset) * f;
}

}  // namespace lightwell
