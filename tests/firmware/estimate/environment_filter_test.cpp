// Environment filter: energy, comparison of each level with the double-precision oracle, and extreme inputs.
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include <lightwell/pixel.hpp>

#include "estimate/common/environment_updates.hpp"
#include "reference/ggx.hpp"
#include "reference/harmonics.hpp"
#include "reference/vector.hpp"

namespace lightwell::estimate {
namespace {

using reference::V3;
using Scene = std::function<double(V3)>;

V3 to_double(Vec3f d) { return {d.x, d.y, d.z}; }
Vec3f to_float(V3 d) { return {static_cast<float>(d.x), static_cast<float>(d.y), static_cast<float>(d.z)}; }

/// Cells evenly distributed over the part of the sphere for which `observed` is true.
struct Cells {
  std::vector<Vec3f> direction;
  std::vector<float> solid_angle;

  explicit Cells(
      int count, const std::function<bool(V3)>& observed = [](V3) { return true; }) {
    for (const V3& d : reference::fibonacci_normals(count)) {
      if (!observed(d)) continue;
      direction.push_back(to_float(d));
      solid_angle.push_back(static_cast<float>(4 * std::numbers::pi / count));
    }
  }
  [[nodiscard]] std::vector<CellSum> sums(const Scene& scene) const {
    std::vector<CellSum> out;
    for (std::size_t c = 0; c < direction.size(); ++c) {
      const double v = scene(to_double(direction[c])) * solid_angle[c];
      out.push_back({static_cast<float>(v), static_cast<float>(v / 2), static_cast<float>(v / 8)});
    }
    return out;
  }
};

/// As many cells as blocks of 1.6 degrees.
const Cells& fine_cells() {
  static const Cells cells(16000);
  return cells;
}

EnvironmentFilter& filter_of(int edge) {
  static std::array<std::unique_ptr<EnvironmentFilter>, 65> made;
  auto& filter = made.at(static_cast<std::size_t>(edge));
  if (!filter) filter = std::make_unique<EnvironmentFilter>(fine_cells().direction, fine_cells().solid_angle, edge);
  return *filter;
}

std::vector<Rgbx> levels_of(int edge, const std::vector<CellSum>& sums) {
  const auto texels = filter_of(edge).run(sums);
  return {texels.begin(), texels.end()};
}

/// Calls f(level, direction of the texel, its value).
template <class F>
void for_texels(std::span<const EnvironmentLevel> levels, std::span<const Rgbx> texels, F&& f) {
  std::size_t at = 0;
  for (const EnvironmentLevel& level : levels)
    for (int j = 0; j < level.edge; ++j)
      for (int i = 0; i < level.edge; ++i) f(level, to_double(texel_direction(level.edge, i, j)), texels[at++]);
}

/// Solid angles of texels, by 64 x 64 parts of each.
std::vector<double> solid_angles(int edge) {
  std::vector<double> out;
  constexpr int kParts = 64;
  for (int j = 0; j < edge; ++j)
    for (int i = 0; i < edge; ++i) {
      double sum = 0;
      for (int v = 0; v < kParts; ++v)
        for (int u = 0; u < kParts; ++u) {
          const double a = 2 * (i + (u + 0.5) / kParts) / edge - 1, b = 2 * (j + (v + 0.5) / kParts) / edge - 1;
          const double x = std::abs(a), z = std::abs(b), y = 1 - x - z;
          // The lower hemisphere is folded over the corners: the octahedron's point is (1 - z, y, 1 - x).
          const double r2 = y >= 0 ? x * x + y * y + z * z : (1 - z) * (1 - z) + y * y + (1 - x) * (1 - x);
          sum += 4.0 / (edge * edge * kParts * kParts) / (r2 * std::sqrt(r2));
        }
      out.push_back(sum);
    }
  return out;
}

/// The GGX mean of a disc of radiance one, by 4000 points of equal solid angle.
double disc_through_lobe(V3 axis, double radius, V3 d, double roughness) {
  const reference::GgxKernel kernel(roughness);
  const auto basis = tangent_basis(Vec3d{axis.x, axis.y, axis.z});
  const double versine = 1 - std::cos(radius);
  constexpr int kPoints = 4000;
  double sum = 0;
  for (int k = 0; k < kPoints; ++k) {
    const double c = 1 - versine * (k + 0.5) / kPoints, s = std::sqrt(1 - c * c), a = 2.399963229728653 * k;
    const auto& [u, v] = basis;
    const V3 p = c * axis + (s * std::cos(a)) * V3{u.x, u.y, u.z} + (s * std::sin(a)) * V3{v.x, v.y, v.z};
    const V3 chord = p - d;
    sum += kernel.at_versine(0.5 * reference::dot(chord, chord));
  }
  return sum * 2 * std::numbers::pi * versine / kPoints;
}

TEST(EnvironmentFilter, LevelsOfEveryEdgeFitIntoAMap) {
  for (const int edge : {8, 16, 32, 64}) {
    const auto levels = environment_levels(edge);
    ASSERT_FALSE(levels.empty());
    EXPECT_EQ(levels.front(), (EnvironmentLevel{edge, 0}));
    EXPECT_EQ(levels.back().roughness, 1);
    EXPECT_LE(texel_count(levels), kMaxEnvironmentTexels);
  }
  for (const int edge : {-8, 0, 1, 12, 128}) EXPECT_TRUE(environment_levels(edge).empty());
}

TEST(EnvironmentFilter, ConstantSphereRemainsConstant) {
  for (const int edge : {8, 16, 32, 64})
    for (const Rgbx& c : levels_of(edge, fine_cells().sums([](V3) { return 1.0; }))) {
      // Tolerance: rounding of a few hundred float weights.
      ASSERT_NEAR(c.v[0], 1, 3e-6) << edge;
      ASSERT_NEAR(c.v[2], 0.125, 4e-7) << edge;
    }
}

TEST(EnvironmentFilter, ConstantSphereOfCoarseCellsRemainsConstant) {
  for (const int count : {6, 100, 1000}) {
    const Cells cells(count);
    EnvironmentFilter filter(cells.direction, cells.solid_angle, 64);
    for (const Rgbx& c : filter.run(cells.sums([](V3) { return 1.0; }))) ASSERT_NEAR(c.v[0], 1, 3e-6) << count;
  }
}

TEST(EnvironmentFilter, ConservesTheEnergyOfEveryCell) {
  // Tolerance: balancing to 1e-6, and rounding of float sums.
  for (const int edge : {8, 32, 64}) {
    const auto sr = solid_angles(edge);
    std::mt19937 random(5);
    for (int run = 0; run < 20; ++run) {
      auto sums = fine_cells().sums([](V3) { return 0.0; });
      double energy = 0;
      for (int k = 0; k < 3; ++k) {
        CellSum& lit = sums[random() % sums.size()];
        lit.r += 1;
        energy += 1;
      }
      const auto texels = levels_of(edge, sums);
      double sum = 0;
      for (std::size_t k = 0; k < sr.size(); ++k) sum += sr[k] * texels[k].v[0];
      EXPECT_NEAR(sum / energy, 1, 1e-3) << edge;
    }
  }
}

TEST(EnvironmentFilter, FillsGapsSmoothly) {
  // A linear gradient in cells of 7 degrees and texels of 3 degrees: the error of a texel is at most half a cell.
  const Cells cells(800);
  EnvironmentFilter filter(cells.direction, cells.solid_angle, 64);
  const double cell = std::sqrt(4 * std::numbers::pi / 800);
  const auto texels = filter.run(cells.sums([](V3 d) { return 2 + d.x; }));
  for_texels(filter.levels().first(1), texels,
             [&](EnvironmentLevel, V3 d, const Rgbx& c) { ASSERT_NEAR(c.v[0], 2 + d.x, 0.5 * cell); });
}

TEST(EnvironmentFilter, UnobservedDirectionsAreDark) {
  const Cells cells(16000, [](V3 d) { return d.y > 0; });
  EnvironmentFilter filter(cells.direction, cells.solid_angle, 32);
  const auto sums = cells.sums([](V3) { return 1.0; });
  const auto texels = filter.run(sums);
  // Within a texel of the boundary both values are possible; lobes extend across it.
  for_texels(filter.levels().first(1), texels, [](EnvironmentLevel, V3 d, const Rgbx& c) {
    if (d.y > 0.15) {
      EXPECT_NEAR(c.v[0], 1, 1e-3) << d.y;
    } else if (d.y < -0.15) {
      EXPECT_EQ(c.v[0], 0) << d.y;
    }
  });
  const auto sr = solid_angles(32);
  double energy = 0, sum = 0;
  for (const CellSum& s : sums) energy += s.r;
  for (std::size_t k = 0; k < sr.size(); ++k) sum += sr[k] * texels[k].v[0];
  EXPECT_NEAR(sum / energy, 1, 1e-3);
  // The lobe of roughness 1 is the cosine: straight up it contains only light, along the boundary half of it.
  for_texels(filter.levels().last(1), std::span(texels).last(texel_count(filter.levels().last(1))),
             [](EnvironmentLevel, V3 d, const Rgbx& c) { EXPECT_NEAR(c.v[0], 0.5 * (1 + d.y), 0.02); });
}

TEST(EnvironmentFilter, WithoutObservationsIsDark) {
  EnvironmentFilter filter({}, {}, 16);
  for (const Rgbx& c : filter.run({})) EXPECT_EQ(c.v[0], 0);
  const Cells cells(500);
  EnvironmentFilter unfed(cells.direction, cells.solid_angle, 16);
  for (const Rgbx& c : unfed.run({})) EXPECT_EQ(c.v[0], 0);
}

TEST(EnvironmentFilter, HarmonicsAreMultipliedByTheLobeCoefficients) {
  for (const int edge : {8, 16, 32, 64}) {
    for (int l = 1; l <= 4; ++l) {
      const int index = l * l + l / 2;
      const auto y = [=](V3 d) { return reference::harmonics(d, l)[static_cast<std::size_t>(index)]; };
      const auto texels = levels_of(edge, fine_cells().sums([&](V3 d) { return 2 + y(d); }));
      for_texels(filter_of(edge).levels(), texels, [&](EnvironmentLevel level, V3 d, const Rgbx& c) {
        const double k = level.roughness > 0 ? reference::ggx_legendre(level.roughness, l).back() : 1;
        // A box of side h attenuates a band by l(l+1) h²/24 and shifts its centroid. The boxes are texels of the grid
        // from which lobes are integrated; for level 0 its own texels. Cells of 1.6 degrees add 0.004 l.
        const double h = level.roughness > 0 ? 4.7 / std::min(2 * edge, 64) : 4.7 / edge;
        ASSERT_NEAR(c.v[0], 2 + k * y(d), 0.2 * l * (l + 1) * h * h / 4 + 0.004 * l)
            << "edge " << edge << " band " << l << " roughness " << level.roughness;
      });
    }
  }
}

TEST(EnvironmentFilter, DiscsAtSpecialPositionsEqualTheOracle) {
  // The poles (+Y: middle of the square, -Y: its corners), middles of its sides, of its diagonals and of octants.
  const std::vector<V3> places = {{0, 1, 0},  {0, -1, 0}, {1, 0, 0},  {0, 0, -1},     {1, 0, 1},
                                  {1, -1, 0}, {0, -1, 1}, {1, 1, -1}, {-1, -1, -0.9}, {0.01, -1, 0.02}};
  const double radius = 0.2;
  for (const int edge : {16, 32, 64}) {
    for (const V3& place : places) {
      const V3 axis = reference::normalised(place);
      // An edge as soft as a cell, so that the result does not depend on which centres are inside.
      const auto sums = fine_cells().sums([&](V3 d) {
        const double angle = reference::angle_deg(d, axis) * std::numbers::pi / 180;
        return std::clamp(0.5 + (radius - angle) / 0.028, 0.0, 1.0);
      });
      const auto texels = levels_of(edge, sums);
      std::vector<double> worst(8), peak(8);
      std::size_t level_at = 0;
      EnvironmentLevel now = filter_of(edge).levels()[0];
      for_texels(filter_of(edge).levels(), texels, [&](EnvironmentLevel level, V3 d, const Rgbx& c) {
        if (!(level == now)) {
          ++level_at;
          now = level;
        }
        if (!(level.roughness > 0)) return;
        const double wanted = disc_through_lobe(axis, radius, d, level.roughness);
        worst[level_at] = std::max(worst[level_at], std::abs(c.v[0] - wanted));
        peak[level_at] = std::max(peak[level_at], wanted);
      });
      for (std::size_t k = 1; k < filter_of(edge).levels().size(); ++k) {
        const float roughness = filter_of(edge).levels()[k].roughness;
        // Texels of the grid from which lobes are integrated are boxes of up to 4.7/edge rad (edge at most 64), which
        // widen a lobe of 2 roughness² rad in proportion to the square of their ratio. In the flank of a lobe, texels
        // are up to a fifth as wide as the flank: 2 % of the peak.
        const double ratio = 4.7 / std::min(2 * edge, 64) / (2 * roughness * roughness);
        EXPECT_LE(worst[k] / peak[k], 0.025 + 0.1 * ratio * ratio)
            << "edge " << edge << " roughness " << roughness << " at " << place.x << " " << place.y << " " << place.z;
      }
    }
  }
}

TEST(EnvironmentFilter, IsLinearFrom1em8To1e8) {
  const auto scene = [](V3 d) { return 1 + d.x + 20 * (d.y > 0.9); };
  const auto one = levels_of(32, fine_cells().sums(scene));
  for (const double scale : {1e-8, 1e-4, 1e4, 1e8}) {
    const auto scaled = levels_of(32, fine_cells().sums([&](V3 d) { return scale * scene(d); }));
    for (std::size_t k = 0; k < one.size(); ++k)
      ASSERT_NEAR(scaled[k].v[0] / scale, one[k].v[0], 1e-5 * one[k].v[0] + 1e-6) << scale;
  }
  for (const Rgbx& c : levels_of(32, fine_cells().sums([](V3) { return 0.0; }))) ASSERT_EQ(c.v[0], 0);
}

TEST(EnvironmentFilter, TheFirstLevelWithLightsIsTheSumOfBoth) {
  for (const int edge : {8, 32, 64}) {
    EnvironmentFilter& filter = filter_of(edge);
    // Pixels see a part of the sphere. There a cap that is brighter than its region leaves less than nothing.
    std::vector<Rgbx> measured(filter.grid().texels()), added(measured.size());
    for (std::size_t k = 0; k < measured.size(); ++k) {
      measured[k].v = {3, 2, -1, k % 64 < 32 ? 1.0F : 0.0F};
      added[k].v = {10, 0, 1.5F, 0};
    }
    const std::vector<Rgbx> without = [&] {
      const auto texels = filter.run(fine_cells().sums([](V3) { return 1.0; }), measured);
      return std::vector<Rgbx>(texels.begin(), texels.end());
    }();
    const auto with = filter.first_level_with(added);
    ASSERT_EQ(with.size(), texel_count(filter.levels().first(1)));
    for (std::size_t k = 0; k < with.size(); ++k) {
      const double share = (static_cast<double>(without[k].v[0]) - 1) / 2;  // Of measured texels in this one.
      EXPECT_NEAR(with[k].v[0], without[k].v[0] + 10 * share, 0.01) << edge;
      EXPECT_EQ(with[k].v[1], without[k].v[1]);
      if (share > 0.999) {
        EXPECT_EQ(without[k].v[2], 0);
        EXPECT_NEAR(with[k].v[2], 0.5, 1e-5);
      }
    }
  }
}

TEST(EnvironmentFilter, InvalidSumsAreDarkAndDoNotSpread) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  const auto clean = levels_of(16, fine_cells().sums([](V3) { return 1.0; }));
  for (const float bad : {nan, inf, -inf, -1.0F, -1e38F, 3e38F}) {
    auto sums = fine_cells().sums([](V3) { return 1.0; });
    for (std::size_t c = 0; c < sums.size(); c += 501) sums[c].g = bad;
    const auto texels = levels_of(16, sums);
    for (std::size_t k = 0; k < texels.size(); ++k) {
      ASSERT_TRUE(texels[k].v[1] >= 0 && texels[k].v[1] <= clean[k].v[1] * 1.00001F) << bad;
      ASSERT_EQ(texels[k].v[0], clean[k].v[0]);
    }
    for (CellSum& s : sums) s = {bad, bad, bad};
    for (const Rgbx& c : levels_of(16, sums)) ASSERT_EQ(c.v[0], 0);
  }
  // Invalid cells.
  std::vector<Vec3f> directions = fine_cells().direction;
  std::vector<float> solid_angles = fine_cells().solid_angle;
  directions.insert(directions.end(), {{0, 0, 0}, {nan, 0, 1}, {1, 0, 0}, {1, 0, 0}, {1, 0, 0}});
  solid_angles.insert(solid_angles.end(), {1, 1, 0, -1, nan});
  EnvironmentFilter filter(directions, solid_angles, 16);
  auto sums = fine_cells().sums([](V3) { return 1.0; });
  sums.resize(directions.size(), {1, 1, 1});
  for (const Rgbx& c : filter.run(sums)) ASSERT_NEAR(c.v[0], 1, 3e-6);
}

}  // namespace
}  // namespace lightwell::estimate
