// Discrete directions of a hemisphere, as evenly spread as a triangular lattice allows. Jachnik, Newcombe & Davison
// 2012, "Real-Time Surface Light-field Capture for Augmentation of Planar Specular Surfaces", section 4.1 and figure 1.
//
// Frame: that of a plane, +Z along its normal. theta is the angle from +Z, phi the azimuth from +X to +Y.
#pragma once

#include <algorithm>
#include <array>
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
  /// horizon are treated as on the horizon with the same azimuth; zero and NaN give the pole.
  [[nodiscard]] Interpolation interpolate(Vec3f direction) const;
  /// The node of the same lattice triangle with the largest weight: the nearest one within half a triangle's side.
  [[nodiscard]] std::uint32_t nearest(Vec3f direction) const;

 private:
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
/// atan2(y, x) in quarter turns, 0 to 4, for finite arguments that are not both zero. Error: 3e-6 quarter turns
/// (minimax polynomial of degree 11 for atan on [0, 1]). Several times as fast as the library's function.
[[nodiscard]] inline float quarter_turns(float y, float x) {
  const float ax = std::abs(x), ay = std::abs(y), low = std::min(ax, ay), high = std::max(ax, ay);
  const float t = low / high, t2 = t * t;
  float a = -0.01172120F;
  a = a * t2 + 0.05265332F;
  a = a * t2 - 0.11643287F;
  a = a * t2 + 0.19354346F;
  a = a * t2 - 0.33262347F;
  a = (a * t2 + 0.99997726F) * t * (2 / std::numbers::pi_v<float>);
  a = ay > ax ? 1 - a : a;
  a = x < 0 ? 2 - a : a;
  return y < 0 ? 4 - a : a;
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

inline HemisphereGrid::Interpolation HemisphereGrid::interpolate(Vec3f d) const {
  const float ring = std::sqrt(d.x * d.x + d.y * d.y);
  // Also false for NaN.
  if (!(ring > 0) || !(std::abs(d.z) < std::numeric_limits<float>::infinity())) return {{0, 0, 0}, {1, 0, 0}};
  const float row = std::min(detail::quarter_turns(ring, std::max(d.z, 0.0F)), 1.0F) * static_cast<float>(levels_);
  const float turn = detail::quarter_turns(d.y, d.x);
  const int quarter = std::min(static_cast<int>(turn), 3);
  const float column = std::min(turn - static_cast<float>(quarter), 1.0F) * row;
  // In the last row the triangle above it is used.
  const int i = std::min(static_cast<int>(row), levels_ - 1), j = std::min(static_cast<int>(column), i);
  const float fi = row - static_cast<float>(i), fj = std::min(column - static_cast<float>(j), 1.0F);
  const auto node = [quarter](int level, int along) {
    if (level == 0) return std::uint32_t{0};
    int index = quarter * level + along;
    if (index >= 4 * level) index -= 4 * level;
    return static_cast<std::uint32_t>(first_of(level)) + static_cast<std::uint32_t>(index);
  };
  if (fj <= fi) return {{node(i, j), node(i + 1, j), node(i + 1, j + 1)}, {1 - fi, fi - fj, fj}};
  const int next = std::min(j + 1, i);
  return {{node(i, j), node(i, next), node(i + 1, j + 1)}, {1 - fj, fj - fi, fi}};
}

inline std::uint32_t HemisphereGrid::nearest(Vec3f d) const {
  const Interpolation at = interpolate(d);
  const auto best = std::max_element(at.weight.begin(), at.weight.end()) - at.weight.begin();
  return at.node[static_cast<std::size_t>(best)];
}

}  // namespace lightwell
