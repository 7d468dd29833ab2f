// Discrete directions of a hemisphere, as evenly spread as a triangular lattice allows. Jachnik, Newcombe & Davison
// 2012, "Real-Time Surface Light-field Capture for Augmentation of Planar Specular Surfaces", section 4.1 and figure 1.
//
// Frame: that of a plane, +Z along its normal. theta is the angle from +Z, phi the azimuth from +X to +Y.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>

#include <lightwell/geometry.hpp>

namespace lightwell {

/// Levels i = 0 to n at theta = i pi / (2 n). Level 0 is one node; level i has 4 i nodes at phi = 2 pi j / (4 i). (The
/// paper prints phi = 2 pi j / i; only 4 i gives its figure 1 and its 7,321 nodes for n = 60.) In each quarter of phi
/// the nodes are a triangular lattice with i + 1 nodes in row i, as on one face of a subdivided octahedron.
class HemisphereGrid {
 public:
  static constexpr int kMaxLevels = 512;

  /// `levels` is clamped to 1 to kMaxLevels.
  explicit HemisphereGrid(int levels = 60) : levels_(std::clamp(levels, 1, kMaxLevels)) {}

  [[nodiscard]] int levels() const { return levels_; }
  /// 1 + 2 n (n + 1).
  [[nodiscard]] std::size_t size() const {
    const auto n = static_cast<std::size_t>(levels_);
    return 1 + 2 * n * (n + 1);
  }
  /// Angle between successive levels, rad. Neighbours of a level are one spacing apart at the horizon, and
  /// pi / 2 spacings near the pole.
  [[nodiscard]] double spacing_rad() const { return std::numbers::pi / (2 * levels_); }

  /// Index of the first node of a level; levels() + 1 gives size().
  [[nodiscard]] static std::size_t first_of(int level) {
    const auto i = static_cast<std::size_t>(level);
    return level == 0 ? 0 : 1 + 2 * i * (i - 1);
  }
  [[nodiscard]] static int nodes_of(int level) { return level == 0 ? 1 : 4 * level; }
  [[nodiscard]] int level_of(std::size_t node) const;

  /// The node of a level whose azimuth is nearest to that of `node`. `level`: 0 to levels().
  [[nodiscard]] std::size_t on_level(std::size_t node, int level) const;

  /// Unit vector of a node.
  [[nodiscard]] Vec3d direction(std::size_t node) const;
  /// Solid angle of the directions that are nearer to the level and the azimuth of this node than to others, sr. All
  /// nodes together have 2 pi.
  [[nodiscard]] double solid_angle(std::size_t node) const;

  /// Three nodes of a lattice triangle around a direction, with barycentric weights, which sum to one.
  struct Interpolation {
    std::array<std::uint32_t, 3> node{};
    std::array<float, 3> weight{};
  };
  /// `direction` need not be normalised. Linear in theta and, within a level, in phi; continuous. Around the pole the
  /// arcs between nodes are cut short, by 0.3 spacings on level 1 and 0.3 / i on level i. Directions below the
  /// horizon are treated as on the horizon with the same azimuth; zero, infinite and NaN give the pole.
  [[nodiscard]] Interpolation interpolate(Vec3f direction) const;
  /// The node of the same lattice triangle with the largest weight: the nearest one within half a triangle's side.
  [[nodiscard]] std::uint32_t nearest(Vec3f direction) const;

 private:
  /// The lattice triangle around a direction: corners `along` rows `level` of a quarter of phi, and their weights.
  struct Triangle {
    float quarter;
    float level[3], along[3], weight[3];
  };
  [[nodiscard]] Triangle triangle(float x, float y, float height) const;
  [[nodiscard]] static std::uint32_t node_at(float quarter, float level, float along);

  int levels_;
};

/// Position of a direction of the hemisphere on the unit disc by stereographic projection: (r, alpha) =
/// (tan(theta / 2), phi), eq. 2 of the paper. `direction` is a unit vector with z >= 0.
struct DiscPoint {
  double x = 0, y = 0;
};
[[nodiscard]] inline DiscPoint stereographic(Vec3d direction) {
  const double scale = 1 / (1 + direction.z);
  return {direction.x * scale, direction.y * scale};
}
/// The inverse: a unit vector with z >= 0 for points of the unit disc.
[[nodiscard]] inline Vec3d from_stereographic(DiscPoint p) {
  const double square = p.x * p.x + p.y * p.y, scale = 1 / (1 + square);
  return {2 * p.x * scale, 2 * p.y * scale, (1 - square) * scale};
}

namespace detail {
/// atan2(y, x) in quarter turns, 0 to 1, for finite arguments of at least 0 that are not both zero. Error: 3e-6 quarter
/// turns (minimax polynomial of degree 11 for atan on [0, 1]). Several times as fast as the library's function.
[[nodiscard]] inline float quarter_turn(float y, float x) {
  const float low = y < x ? y : x, high = x < y ? y : x;
  const float t = low / high, t2 = t * t;
  float a = -0.01172120F;
  a = a * t2 + 0.05265332F;
  a = a * t2 - 0.11643287F;
  a = a * t2 + 0.19354346F;
  a = a * t2 - 0.33262347F;
  a = (a * t2 + 0.99997726F) * t * (2 / std::numbers::pi_v<float>);
  const float complement = 1 - a;
  return y > x ? complement : a;
}
}  // namespace detail

inline int HemisphereGrid::level_of(std::size_t node) const {
  if (node == 0) return 0;
  // first_of(i) = 1 + 2 i (i - 1) <= node.
  auto level = static_cast<int>((1 + std::sqrt(1 + 2 * (static_cast<double>(node) - 1))) / 2);
  while (level > 1 && first_of(level) > node) --level;
  while (level < levels_ && first_of(level + 1) <= node) ++level;
  return level;
}

inline std::size_t HemisphereGrid::on_level(std::size_t node, int level) const {
  const int from = level_of(node), count = nodes_of(level);
  const double turn = static_cast<double>(node - first_of(from)) / nodes_of(from);
  return first_of(level) + static_cast<std::size_t>(static_cast<int>(std::lround(turn * count)) % count);
}

inline Vec3d HemisphereGrid::direction(std::size_t node) const {
  const int level = level_of(node);
  if (level == 0) return {0, 0, 1};
  const double theta = level * spacing_rad();
  const double phi = std::numbers::pi / 2 * static_cast<double>(node - first_of(level)) / level;
  // At the horizon cos(pi / 2) would be 6e-17.
  const double z = level == levels_ ? 0 : std::cos(theta), ring = std::sin(theta);
  return {ring * std::cos(phi), ring * std::sin(phi), z};
}

inline double HemisphereGrid::solid_angle(std::size_t node) const {
  const int level = level_of(node);
  const double low = std::max(0.0, (level - 0.5) * spacing_rad());
  const double high = std::min(std::numbers::pi / 2, (level + 0.5) * spacing_rad());
  // cos(low) - cos(high) as a product, without cancellation near the pole.
  const double band = 4 * std::numbers::pi * std::sin((low + high) / 2) * std::sin((high - low) / 2);
  return band / nodes_of(level);
}

// Without branches and calls, so that loops over directions vectorise (with -fno-math-errno and -fno-trapping-math).
// Indices are whole numbers in floats, exact below 2^24.
inline HemisphereGrid::Triangle HemisphereGrid::triangle(float x, float y, float height) const {
  const auto smaller = [](float a, float b) { return a < b ? a : b; };
  // 0 for NaN.
  const auto positive = [](float v) { return v > 0 ? v : 0.0F; };
  const auto whole = [](float v) { return static_cast<float>(static_cast<int>(v)); };
  const auto levels = static_cast<float>(levels_);
  const float ring = std::sqrt(x * x + y * y);
  // 0, or NaN where a component is infinite or NaN.
  const float invalid = 0 * (ring + height);
  const float theta = detail::quarter_turn(ring, height) + invalid, row = smaller(positive(theta), 1) * levels;
  // Quarter by the signs, which also defines it for zeros.
  const auto x_bits = std::bit_cast<std::int32_t>(x), y_bits = std::bit_cast<std::int32_t>(y);
  const auto quarter = static_cast<float>((x_bits >> 31 & 1) ^ (y_bits >> 31 & 3));
  const float steep = detail::quarter_turn(std::abs(y), std::abs(x)), flat = 1 - steep;
  const float column = positive((x_bits ^ y_bits) < 0 ? flat : steep) * row;
  // In the last row the triangle above it is used.
  const float i = smaller(whole(row), levels - 1), j = smaller(whole(column), i);
  const float fi = row - i, fj = smaller(column - j, 1);
  // Never above (i, i), because column <= row: the corner between the other two is in row i + 1, or after j in row i.
  const float down = fj <= fi ? 1.0F : 0.0F, larger = fi < fj ? fj : fi, least = smaller(fi, fj);
  return {quarter, {i, i + down, i + 1}, {j, j + 1 - down, j + 1}, {1 - larger, larger - least, least}};
}

inline std::uint32_t HemisphereGrid::node_at(float quarter, float level, float along) {
  const float index = quarter * level + along, wrapped = index >= 4 * level ? index - 4 * level : index;
  const float node = 1 + 2 * level * (level - 1) + wrapped;
  return static_cast<std::uint32_t>(static_cast<std::int32_t>(level > 0 ? node : 0.0F));
}

inline HemisphereGrid::Interpolation HemisphereGrid::interpolate(Vec3f d) const {
  const Triangle t = triangle(d.x, d.y, d.z > 0 ? d.z : d.z * 0);
  return {{node_at(t.quarter, t.level[0], t.along[0]), node_at(t.quarter, t.level[1], t.along[1]),
           node_at(t.quarter, t.level[2], t.along[2])},
          {t.weight[0], t.weight[1], t.weight[2]}};
}

inline std::uint32_t HemisphereGrid::nearest(Vec3f d) const {
  const Triangle t = triangle(d.x, d.y, d.z > 0 ? d.z : d.z * 0);
  const bool second = t.weight[1] > t.weight[0];
  const float weight = second ? t.weight[1] : t.weight[0];
  const float level = second ? t.level[1] : t.level[0], along = second ? t.along[1] : t.along[0];
  const bool third = t.weight[2] > weight;
  return node_at(t.quarter, third ? t.level[2] : level, third ? t.along[2] : along);
}

}  // namespace lightwell
