// Shadows from silhouettes, against closed forms: the silhouette of the ball is a disc of radius 10/11.
#include <cmath>
#include <limits>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/object_shadow.hpp>

#include "host_sdk/image_object/matte_ball.hpp"

namespace lightwell::test {
namespace {

using testing::HasSubstr;

constexpr ObjectEncoderOptions kCoarse{0.06F, 0.2F, 0.03F};
constexpr double kRadius = 1 / 1.1;

ObjectShadowCaster caster_of(const Ball& ball) {
  const auto object = ImageObject::from_bytes(file_of(ball, kCoarse));
  EXPECT_TRUE(object.ok());
  auto caster = ObjectShadowCaster::make(*object);
  EXPECT_TRUE(caster.ok()) << caster.status().message();
  return *caster;
}

/// The ground below the object: +Z of the plane is +Y of the object, +Y of the plane is -Z.
ObjectShadowPlane ground(double side = 8, int texels = 160) {
  return {{Quat::about({1, 0, 0}, -std::numbers::pi / 2), {0, -kRadius, 0}}, side, side, texels, texels};
}

std::vector<LightRatio> cast(const ObjectShadowCaster& caster, const std::vector<ObjectLight>& lights,
                             const ObjectShadowPlane& plane) {
  std::vector<LightRatio> out(static_cast<std::size_t>(plane.columns * plane.rows));
  const auto done = caster.cast(lights, plane, out);
  EXPECT_TRUE(done.ok()) << done.status().message();
  return out;
}

/// The texel at x, z of the object's frame.
const LightRatio& at(const std::vector<LightRatio>& ratios, const ObjectShadowPlane& plane, double x, double z) {
  const int column = static_cast<int>((x / plane.width_m + 0.5) * plane.columns);
  const int row = static_cast<int>((z / plane.height_m + 0.5) * plane.rows);
  return ratios[static_cast<std::size_t>(row * plane.columns + column)];
}

double shadow_area(const std::vector<LightRatio>& ratios, const ObjectShadowPlane& plane) {
  double sum = 0;
  for (const LightRatio& r : ratios) sum += 1 - static_cast<double>(r.g);
  return sum * plane.width_m * plane.height_m / (plane.columns * plane.rows);
}

ObjectLight light(Vec3f direction, float radius = 0, Irradiance e = {1, 1, 1}) { return {direction, e, radius}; }

TEST(ObjectShadow, LiesBehindTheObjectAsSeenFromTheLight) {
  const ObjectShadowPlane plane = ground();
  // From the camera's side at 45 degrees: the disc's height is the shadow's length.
  const auto ratios = cast(caster_of(Ball(3)), {light({0, 1, 1})}, plane);
  EXPECT_EQ(at(ratios, plane, 0, -kRadius).g, 0);
  EXPECT_EQ(at(ratios, plane, 0, -0.1).g, 0);
  EXPECT_EQ(at(ratios, plane, 0, -2 * kRadius + 0.1).g, 0);
  EXPECT_EQ(at(ratios, plane, 0, -2 * kRadius - 0.1).g, 1);
  EXPECT_EQ(at(ratios, plane, 0, 0.2).g, 1);
  EXPECT_EQ(at(ratios, plane, kRadius + 0.1, -kRadius).g, 1);
  EXPECT_EQ(at(ratios, plane, kRadius - 0.1, -kRadius).g, 0);
}

TEST(ObjectShadow, HasTheProjectedAreaOfTheSilhouette) {
  for (const double elevation : {0.5, 0.9, 1.2}) {
    const ObjectShadowPlane plane = ground(8, 400);
    const Vec3f towards{static_cast<float>(0.1 * std::cos(elevation)), static_cast<float>(std::sin(elevation)),
                        static_cast<float>(std::sqrt(0.99) * std::cos(elevation))};
    const double expected = std::numbers::pi * kRadius * kRadius / std::tan(elevation);
    EXPECT_NEAR(shadow_area(cast(caster_of(Ball(3)), {light(towards)}, plane), plane), expected, 0.03 * expected);
  }
}

TEST(ObjectShadow, OfALargeLightHasAPenumbra) {
  const ObjectShadowPlane plane = ground();
  const auto hard = cast(caster_of(Ball(3)), {light({0, 1, 1})}, plane);
  const auto soft = cast(caster_of(Ball(3)), {light({0, 1, 1}, 0.1F)}, plane);
  int partly_hard = 0, partly_soft = 0;
  for (std::size_t i = 0; i < hard.size(); ++i) {
    partly_hard += hard[i].g > 0.02F && hard[i].g < 0.98F;
    partly_soft += soft[i].g > 0.02F && soft[i].g < 0.98F;
  }
  EXPECT_EQ(partly_hard, 0);
  EXPECT_GT(partly_soft, 200);
  // The farther from the object, the wider: the contact stays dark.
  EXPECT_LT(at(soft, plane, 0, -0.3).g, 0.05F);
  EXPECT_NEAR(at(soft, plane, 0, -2 * kRadius).g, 0.5, 0.2);
}

TEST(ObjectShadow, AddsLightsByTheirIrradianceOfThePlane) {
  const ObjectShadowPlane plane = ground();
  const auto both = cast(caster_of(Ball(3)), {light({0, 1, 1}, 0, {3, 1, 0}), light({0, 1, -1}, 0, {1, 1, 2})}, plane);
  const LightRatio& behind = at(both, plane, 0, -kRadius);
  EXPECT_NEAR(behind.r, 0.25, 1e-6);
  EXPECT_NEAR(behind.g, 0.5, 1e-6);
  EXPECT_NEAR(behind.b, 1, 1e-6);
}

TEST(ObjectShadow, OfLightsBelowThePlaneOrWithoutIrradianceIsNone) {
  const ObjectShadowPlane plane = ground();
  std::vector<LightRatio> out(static_cast<std::size_t>(plane.columns * plane.rows));
  const std::vector<ObjectLight> lights = {light({0, -1, 1}), light({0, 1, 1}, 0, {})};
  const auto done = caster_of(Ball(3)).cast(lights, plane, out);
  ASSERT_TRUE(done.ok());
  EXPECT_EQ(done->lights, 0);
  for (const LightRatio& r : out) EXPECT_EQ(r, (LightRatio{1, 1, 1}));
}

TEST(ObjectShadow, OfALightBesideTheViewsSaysHowFarTheirSilhouettesAre) {
  const ObjectShadowPlane plane = ground();
  std::vector<LightRatio> out(static_cast<std::size_t>(plane.columns * plane.rows));
  const ObjectShadowCaster caster = caster_of(Ball(3));
  const auto apart = [&](Vec3f direction) {
    const std::vector<ObjectLight> lights = {light(direction)};
    return caster.cast(lights, plane, out)->outside_rad;
  };
  EXPECT_NEAR(apart({0, 1, 1}), 0, 1e-6);
  EXPECT_NEAR(apart({0, 1, -1}), 0, 1e-6);  // The mirrored silhouette.
  EXPECT_NEAR(apart({1, 1, 0}), std::numbers::pi / 2, 1e-6);
}

TEST(ObjectShadow, FromBehindIsThatOfTheMirroredSilhouette) {
  Ball ball(3);
  // The right half of the ball alone.
  for (int p = 0; p < Ball::kSide * Ball::kSide; ++p)
    if (p % Ball::kSide < Ball::kSide / 2) ball.coverage[static_cast<std::size_t>(p)] = 0;
  const ObjectShadowPlane plane = ground();
  const ObjectShadowCaster caster = caster_of(ball);
  // Right of the camera is +X, from either side.
  const auto front = cast(caster, {light({0, 1, 1})}, plane), back = cast(caster, {light({0, 1, -1})}, plane);
  EXPECT_EQ(at(front, plane, 0.5, -kRadius).g, 0);
  EXPECT_EQ(at(front, plane, -0.5, -kRadius).g, 1);
  EXPECT_EQ(at(back, plane, 0.5, kRadius).g, 0);
  EXPECT_EQ(at(back, plane, -0.5, kRadius).g, 1);
}

TEST(ObjectShadow, FromTheZenithIsFinite) {
  const ObjectShadowPlane plane = ground();
  for (const LightRatio& r : cast(caster_of(Ball(3)), {light({0, 1, 0}, 0.2F)}, plane))
    EXPECT_TRUE(r.g >= 0 && r.g <= 1);
}

TEST(ObjectShadow, RefusesWhatItCannotCast) {
  const ObjectShadowCaster caster = caster_of(Ball(3));
  const auto refusal = [&](const std::vector<ObjectLight>& lights, const ObjectShadowPlane& plane, std::size_t texels) {
    std::vector<LightRatio> out(texels, {7, 7, 7});
    const auto done = caster.cast(lights, plane, out);
    EXPECT_EQ(done.status().code(), StatusCode::invalid_argument);
    for (const LightRatio& r : out) EXPECT_EQ(r, (LightRatio{7, 7, 7}));
    return done.status().message();
  };
  const ObjectShadowPlane plane = ground(8, 4);
  EXPECT_THAT(refusal({light({0, 0, 0})}, plane, 16), HasSubstr("light 0 has a direction that is zero"));
  EXPECT_THAT(refusal({light({0, 1, 0}, -1)}, plane, 16), HasSubstr("angular radius"));
  EXPECT_THAT(refusal({light({0, 1, 0})}, plane, 15), HasSubstr("15 ratios for 4 x 4"));
  ObjectShadowPlane bad = plane;
  bad.width_m = 0;
  EXPECT_THAT(refusal({}, bad, 16), HasSubstr("width_m"));
  bad = plane;
  bad.T_object_plane.translation.x = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refusal({}, bad, 16), HasSubstr("T_object_plane"));
  bad = plane;
  bad.rows = 5000;
  EXPECT_THAT(refusal({}, bad, 16), HasSubstr("rows"));
}

}  // namespace
}  // namespace lightwell::test
