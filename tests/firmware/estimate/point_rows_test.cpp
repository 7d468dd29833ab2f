// The projection of point lights equals the oracle's spherical harmonics on every Highway target.
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "estimate/common/cells.hpp"
#include "firmware/estimate/each_target.hpp"
#include "reference/harmonics.hpp"

namespace lightwell::estimate {
namespace {

/// The oracle's harmonics of bands 0 to 6, 8, 10 and 12.
std::vector<double> oracle_row(double x, double y, double z) {
  const std::vector<double> all = reference::harmonics({x, y, z}, 12);
  std::vector<double> out(all.begin(), all.begin() + 49);
  for (const int l : {8, 10, 12}) out.insert(out.end(), all.begin() + l * l, all.begin() + (l + 1) * (l + 1));
  return out;
}

TEST(PointRows, EqualTheOracleInEveryDirection) {
  test::on_each_target([](const char* target) {
    SCOPED_TRACE(target);
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    for (const std::size_t count : {0U, 1U, 2U, 6U, 15U, 16U, 17U, 127U, 128U}) {
      LightPoints points;
      points.count = count;
      double truth[3][kRowCount] = {}, amount[3] = {};
      float got[3][kRowCount];
      for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t i = 0; i < kRowCount; ++i) truth[c][i] = got[c][i] = static_cast<float>(normal(random));
      for (std::size_t k = 0; k < LightPoints::kMaxPoints; ++k) {
        Vec3d d = normalized(Vec3d{normal(random), normal(random), normal(random)});
        if (k < 6)
          d = Vec3d{k / 2 == 0 ? 1.0 : 0, k / 2 == 1 ? 1.0 : 0, k / 2 == 2 ? 1.0 : 0} * (k % 2 == 0 ? 1.0 : -1.0);
        points.x[k] = static_cast<float>(d.x), points.y[k] = static_cast<float>(d.y),
        points.z[k] = static_cast<float>(d.z);
        float* light[] = {&points.r[k], &points.g[k], &points.b[k]};
        for (float* v : light) *v = std::exp(static_cast<float>(normal(random)));
        if (k >= count) {
          // Light beyond `count` must be ignored, even if invalid.
          *light[0] = std::numeric_limits<float>::quiet_NaN(), *light[1] = std::numeric_limits<float>::infinity();
          continue;
        }
        const std::vector<double> row = oracle_row(points.x[k], points.y[k], points.z[k]);
        for (std::size_t c = 0; c < 3; ++c) {
          amount[c] += static_cast<double>(*light[c]);
          for (std::size_t i = 0; i < kRowCount; ++i) truth[c][i] += static_cast<double>(*light[c]) * row[i];
        }
      }
      add_points(points, got);
      // Basis functions of band 12 are at most sqrt(25 / 4 pi) = 1.41; twelve steps of recursion each round to 2^-24.
      for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t i = 0; i < kRowCount; ++i)
          ASSERT_NEAR(got[c][i], truth[c][i], 2e-6 * 1.41 * amount[c] + 4e-7)
              << count << " points, channel " << c << ", number " << i;
    }
  });
}

}  // namespace
}  // namespace lightwell::estimate
