// Vectors, rotations and quadrature, against closed forms.
#include <cmath>

#include <gtest/gtest.h>

#include "reference/quadrature.hpp"
#include "reference/rotation.hpp"
#include "reference/test_support.hpp"

namespace lightwell::reference {
namespace {

TEST(Vector, FibonacciNormalsAreUnitAndBalanced) {
  V3 sum{};
  double zz = 0;
  for (const V3& n : fibonacci_normals(2048)) {
    EXPECT_NEAR(length(n), 1, rounding);
    sum = sum + n;
    zz += n.z * n.z;
  }
  // An even set has mean 0 and mean square 1/3 per axis; N points leave about 1/N.
  EXPECT_LT(length(sum) / 2048, 1.0 / 2048);
  EXPECT_NEAR(zz / 2048, 1.0 / 3, 1.0 / 2048);
}

TEST(Vector, SmallAnglesKeepTheirDigits) {
  EXPECT_NEAR(angle_deg({1, 0, 0}, {2, 2e-9, 0}) * pi / 180, 1e-9, 1e-9 * rounding);
  EXPECT_NEAR(angle_deg({0, 0, 1}, {0, 0, -3}), 180, 180 * rounding);
}

TEST(Rotation, IsRightHanded) {
  const M3 quarter = rotation_about({0, 1, 0}, pi / 2);
  EXPECT_LT(distance(rotated(quarter, {0, 0, 1}), {1, 0, 0}), rounding);
  EXPECT_LT(distance(rotated(transposed(quarter), {1, 0, 0}), {0, 0, 1}), rounding);
}

TEST(Quadrature, PolynomialsAndAKinkAtTheEnd) {
  const GaussLegendre rule = gauss_legendre(15);
  double x28 = 0;  // degree 28 <= 2 * 15 - 1: exact
  for (std::size_t i = 0; i < 15; ++i) x28 += rule.weights[i] * std::pow(rule.nodes[i], 28);
  EXPECT_NEAR(x28, 2.0 / 29, rounding);
  // A square root's kink needs refinement, some 20 panels of 1e-12 each.
  EXPECT_NEAR(integrate([](double x) { return std::sqrt(x); }, 0, 1, 1e-12), 2.0 / 3, 1e-11);
}

}  // namespace
}  // namespace lightwell::reference
