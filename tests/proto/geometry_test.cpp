#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <lightwell/geometry.hpp>

namespace lightwell {
namespace {

TEST(Normalized, WorksOverTheWholeRangeOfFloat) {
  for (const float s : {1e-38F, 1e-20F, 1.0F, 1e20F, 1e38F}) {
    const Vec3f v = normalized(Vec3f{0.3F * s, -0.4F * s, 0});
    EXPECT_NEAR(v.x, 0.6F, 1e-6F) << s;
    EXPECT_NEAR(v.y, -0.8F, 1e-6F) << s;
  }
}

TEST(Normalized, InvalidInputGivesZero) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  for (const Vec3f v : {Vec3f{}, Vec3f{nan, 1, 0}, Vec3f{0, inf, 0}, Vec3f{1, 0, -inf}})
    EXPECT_EQ(normalized(v), Vec3f{});
}

TEST(Rotate, IsRightHanded) {
  // A rotation by pi/2 about +Y maps +Z to +X; about +X it maps +Y to +Z.
  const Vec3d x = rotate(Quat::about({0, 1, 0}, std::numbers::pi / 2), Vec3d{0, 0, 1});
  EXPECT_NEAR(x.x, 1, 1e-12);
  const Vec3d z = rotate(Quat::about({1, 0, 0}, std::numbers::pi / 2), Vec3d{0, 1, 0});
  EXPECT_NEAR(z.z, 1, 1e-12);
}

TEST(Rotate, ProductAppliesTheRightFactorFirst) {
  const Quat a = Quat::about({0, 1, 0}, 0.7), b = Quat::about({1, 0, 0}, -1.1);
  const Vec3d v{0.2, -0.5, 0.9};
  const Vec3d once = rotate(a * b, v), twice = rotate(a, rotate(b, v));
  EXPECT_NEAR(length(once - twice), 0, 1e-12);
}

TEST(TangentBasis, IsRightHandedAndOrthonormalEverywhere) {
  for (const Vec3d n : {Vec3d{0, 0, 1}, Vec3d{0, 0, -1}, Vec3d{1, 0, 0}, Vec3d{0, -1, 0},
                        normalized(Vec3d{1, 2, -1e-9}), normalized(Vec3d{1e-9, 1e-9, -1})}) {
    const auto [u, v] = tangent_basis(n);
    EXPECT_NEAR(dot(u, v), 0, 1e-12);
    EXPECT_NEAR(dot(u, n), 0, 1e-12);
    EXPECT_NEAR(length(u), 1, 1e-12);
    EXPECT_NEAR(length(cross(u, v) - n), 0, 1e-12);
  }
}

TEST(AngleBetween, IsAccurateForTinyAnglesAndNearPi) {
  EXPECT_NEAR(angle_between(Vec3d{1, 0, 0}, Vec3d{1, 1e-9, 0}), 1e-9, 1e-15);
  EXPECT_NEAR(angle_between(Vec3d{1, 0, 0}, Vec3d{-1, 1e-9, 0}), std::numbers::pi - 1e-9, 1e-12);
}

}  // namespace
}  // namespace lightwell
