#include "estimate/common/cells.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "reference/harmonics.hpp"
#include "reference/vector.hpp"

namespace lightwell::estimate {
namespace {

/// A sphere of `count` points as cells of one pixel each, without those for which `keep` is false.
template <class Keep>
CellGrid grid_of(int count, std::vector<Vec3d>& directions, Keep&& keep) {
  CellGrid grid;
  for (const reference::V3& d : reference::fibonacci_normals(count)) {
    if (!keep(d)) continue;
    directions.push_back({d.x, d.y, d.z});
    const CellGrid::Pixel p{vec_cast<float>(directions.back()), static_cast<float>(4 * std::numbers::pi / count)};
    grid.add_cell(std::span(&p, 1));
  }
  grid.finish();
  return grid;
}

std::vector<CellSum> sums_of(const CellGrid& grid, const std::vector<Vec3d>& directions, auto&& radiance) {
  std::vector<CellSum> sums;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const auto v = static_cast<float>(radiance(directions[i])) * grid.solid_angle(i);
    sums.push_back({v, 2 * v, -v});
  }
  return sums;
}

TEST(CellGrid, ReproducesEveryHarmonic) {
  std::vector<Vec3d> directions;
  const CellGrid grid = grid_of(6000, directions, [](const reference::V3&) { return true; });
  ASSERT_TRUE(grid.whole_sphere());
  for (int i = 0; i < sh_count(kMaxBand); ++i) {
    const auto sums = sums_of(grid, directions, [i](Vec3d d) {
      return reference::harmonics({d.x, d.y, d.z}, kMaxBand)[static_cast<std::size_t>(i)];
    });
    Projection p;
    grid.project(sums, {}, p);
    for (int j = 0; j < sh_count(kMaxBand); ++j) {
      const auto at = static_cast<std::size_t>(j);
      // 1e-5 before the wire (proto/README.md).
      EXPECT_NEAR(p.c[at][0], i == j ? 1 : 0, 1e-5) << i << " " << j;
      EXPECT_NEAR(p.c[at][1], i == j ? 2 : 0, 2e-5) << i << " " << j;
    }
  }
}

TEST(CellGrid, HalfCoverageCountsTheRestAsDark) {
  std::vector<Vec3d> directions;
  const CellGrid grid = grid_of(6000, directions, [](const reference::V3& d) { return d.z > 0; });
  EXPECT_FALSE(grid.whole_sphere());
  EXPECT_NEAR(grid.covered_sr(), 2 * std::numbers::pi, 0.01);
  Projection p;
  grid.project(sums_of(grid, directions, [](Vec3d) { return 1; }), {}, p);
  // Half of the integral of Y_0 = 0.282095 over the sphere.
  EXPECT_NEAR(p.c[0][0], 0.282095 * 2 * std::numbers::pi, 0.003);
}

TEST(CellGrid, UsesTheCentroidOverride) {
  std::vector<Vec3d> directions;
  const CellGrid grid = grid_of(1000, directions, [](const reference::V3&) { return true; });
  std::vector<CellSum> sums(grid.size());
  sums[500] = {1, 1, 1};
  const Vec3d centroid = normalized(directions[500] + Vec3d{0.02, 0.01, 0});
  const CellGrid::CentroidOverride override_of_cell{500, centroid};
  Projection p;
  grid.project(sums, std::span(&override_of_cell, 1), p);
  const auto truth = reference::harmonics({centroid.x, centroid.y, centroid.z}, 1);
  // For a single point, the least-squares fit of a thousand cells differs from the plain sum by 1 %.
  for (std::size_t i = 1; i < 4; ++i) EXPECT_NEAR(p.c[i][0], truth[i], 0.01);
  CellGrid::CentroidOverride none{500, directions[500]};
  Projection q;
  grid.project(sums, std::span(&none, 1), q);
  EXPECT_GT(std::abs(p.c[3][0] - q.c[3][0]) + std::abs(p.c[1][0] - q.c[1][0]), 0.003);
}

TEST(CellGrid, APartOfTheCellsMayHaveACentroidEach) {
  std::vector<Vec3d> directions;
  const CellGrid grid = grid_of(2000, directions, [](const reference::V3&) { return true; });
  std::vector<CellSum> sums(grid.size());
  std::vector<CellGrid::CentroidOverride> overrides;
  constexpr std::uint32_t kFirst = 300, kEnd = kFirst + CellGrid::kMaxCellsInFloat;
  CellGrid::Totals truth{};
  for (std::uint32_t cell = kFirst; cell < kEnd; ++cell) {
    sums[cell] = {1, 0.5F, static_cast<float>(cell % 7)};
    const Vec3d centroid = normalized(directions[cell] + Vec3d{0.01, -0.02, 0.01});
    overrides.push_back({cell, centroid});
    const auto basis = reference::harmonics({centroid.x, centroid.y, centroid.z}, 4);
    for (std::size_t i = 0; i < basis.size(); ++i) {
      truth[0][i] += basis[i];
      truth[1][i] += 0.5 * basis[i];
      truth[2][i] += (cell % 7) * basis[i];
    }
  }
  CellGrid::PartialTotals part;
  grid.add(kFirst, kEnd, sums, overrides, part);
  // Sums in float of 256 terms of up to 6.
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t i = 0; i < 25; ++i) EXPECT_NEAR(part.c[k][i], truth[k][i], 2e-3) << k << " " << i;
}

TEST(CellGrid, WithoutCellsGivesZero) {
  CellGrid grid;
  grid.finish();
  Projection p;
  grid.project({}, {}, p);
  for (const auto& c : p.c) EXPECT_EQ(c[0], 0);
}

}  // namespace
}  // namespace lightwell::estimate
