#include "reference/harmonics.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <lightwell/harmonics.hpp>
#include <lightwell/lobes.hpp>

#include "reference/vector.hpp"

namespace lightwell {
namespace {

namespace ref = reference;

std::vector<Vec3d> directions() {
  std::vector<Vec3d> out = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  for (const ref::V3& d : ref::fibonacci_normals(200)) out.push_back({d.x, d.y, d.z});
  return out;
}

RadianceSh single(int band, int index) {
  RadianceSh sh;
  sh.band = band;
  sh.c[static_cast<std::size_t>(index)] = {1, 2, -0.5F};
  return sh;
}

TEST(Harmonics, MatchTheOracleInEveryBandIncludingPoles) {
  std::vector<double> y(sh_count(kMaxBasisBand));
  for (const Vec3d& d : directions()) {
    sh_basis(kMaxBasisBand, d, y);
    const std::vector<double> truth = ref::harmonics({d.x, d.y, d.z}, kMaxBasisBand);
    // Tolerance: rounding of two recursions of 16 steps in double.
    for (std::size_t i = 0; i < y.size(); ++i) ASSERT_NEAR(y[i], truth[i], 1e-12) << "function " << i;
  }
}

TEST(Harmonics, FloatStaysWithinTheSpecifiedPrecision) {
  std::vector<float> y(sh_count(kMaxBand));
  for (const Vec3d& d : directions()) {
    sh_basis(kMaxBand, vec_cast<float>(d), y);
    const std::vector<double> truth = ref::harmonics({d.x, d.y, d.z}, kMaxBand);
    // 1e-5 is what proto/README.md promises before the wire; float rounding of the direction alone gives 1e-6.
    for (std::size_t i = 0; i < y.size(); ++i) ASSERT_NEAR(y[i], truth[i], 5e-6) << "function " << i;
  }
}

// Written by hand from proto/README.md, "Spherical harmonics".
TEST(Harmonics, HavePositiveConstantsAndBandOneInTheOrderYzx) {
  std::array<double, 9> y;
  sh_basis(2, Vec3d{1, 0, 0}, y);
  EXPECT_NEAR(y[0], 0.282095, 1e-6);
  EXPECT_NEAR(y[1], 0, 1e-12);
  EXPECT_NEAR(y[2], 0, 1e-12);
  EXPECT_NEAR(y[3], 0.488603, 1e-6);
  EXPECT_NEAR(y[8], 0.546274, 1e-6);
  sh_basis(2, Vec3d{0, 1, 0}, y);
  EXPECT_NEAR(y[1], 0.488603, 1e-6);
  EXPECT_NEAR(y[8], -0.546274, 1e-6);
  sh_basis(2, Vec3d{0, 0, 1}, y);
  EXPECT_NEAR(y[2], 0.488603, 1e-6);
  EXPECT_NEAR(y[6], 2 * 0.315392, 1e-6);
  const double h = std::numbers::sqrt2 / 2;
  sh_basis(2, Vec3d{h, h, 0}, y);
  EXPECT_NEAR(y[4], 1.092548 / 2, 1e-6);
  sh_basis(2, Vec3d{0, h, h}, y);
  EXPECT_NEAR(y[5], 1.092548 / 2, 1e-6);
  sh_basis(2, Vec3d{h, 0, h}, y);
  EXPECT_NEAR(y[7], 1.092548 / 2, 1e-6);
}

TEST(Harmonics, RotationIsCorrectForEveryFunction) {
  const Quat turns[] = {Quat::about({0, 1, 0}, 0.3), Quat::about({1, 0, 0}, -2.5),
                        Quat::about(normalized(Vec3d{1, -2, 3}), 3.1)};
  for (const Quat& q : turns) {
    for (int i = 0; i < sh_count(kMaxBand); ++i) {
      const RadianceSh sh = single(kMaxBand, i);
      const RadianceSh turned = rotated(sh, q);
      for (const Vec3d& d : {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, normalized(Vec3d{-1, 2, 0.5})}) {
        const Radiance before = evaluate(sh, vec_cast<float>(d));
        const Radiance after = evaluate(turned, vec_cast<float>(rotate(q, d)));
        // Tolerance: float evaluation; the quadrature is exact.
        ASSERT_NEAR(before.g, after.g, 2e-5) << "function " << i;
      }
    }
  }
}

TEST(Harmonics, RotationAndItsInverseAreTheIdentity) {
  RadianceSh sh;
  sh.band = 6;
  for (std::size_t i = 0; i < 49; ++i) sh.c[i] = {std::sin(static_cast<float>(i)), 1, std::cos(static_cast<float>(i))};
  const Quat q = Quat::about(normalized(Vec3d{3, 1, 2}), 1.7);
  const RadianceSh back = rotated(rotated(sh, q), q.inverse());
  for (std::size_t i = 0; i < 49; ++i) EXPECT_NEAR(back.c[i].r, sh.c[i].r, 1e-6);
}

TEST(Harmonics, IrradianceScalesEachBandByItsLobe) {
  for (int l = 0; l <= kMaxBand; ++l) {
    for (int m = -l; m <= l; ++m) {
      const RadianceSh sh = single(kMaxBand, sh_index(l, m));
      const IrradianceSh e = irradiance_of(sh);
      const Vec3f n = normalized(Vec3f{0.3F, -0.4F, 0.8F});
      // Per band the lobe of proto/README.md: pi, 2pi/3, pi/4, 0, -pi/24, 0, pi/64.
      const double lobes[] = {1.0, 2.0 / 3, 0.25, 0, -1.0 / 24, 0, 1.0 / 64};
      const double truth = lobes[l] * std::numbers::pi * evaluate(sh, n).r;
      EXPECT_NEAR(evaluate(e, n).r, truth, 1e-5 * std::numbers::pi) << l << " " << m;
    }
  }
}

}  // namespace
}  // namespace lightwell
