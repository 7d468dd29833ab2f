// Lighting: invalid queries, age, and rotation.
#include <cmath>
#include <limits>
#include <type_traits>

#include <gtest/gtest.h>

#include <lightwell/lighting.hpp>

#include "host_sdk/scenes.hpp"

namespace lightwell {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kMax = std::numeric_limits<float>::max();
constexpr float kTiny = std::numeric_limits<float>::denorm_min();

/// A descriptor with all bands, a point light and a window.
Descriptor mixed_scene() {
  Descriptor descriptor = test::constant_scene({3, 2, 1});
  descriptor.radiance.band = 4;
  for (int i = 1; i < sh_count(4); ++i) {
    const float v = std::sin(static_cast<float>(i));
    descriptor.radiance.c[static_cast<std::size_t>(i)] = {v, 0.5F * v, -v};
  }
  descriptor.lights = {test::light({0.2F, 0.9F, -0.3F}, {8, 7, 6}, 0, 1),
                       test::light({-0.7F, 0.1F, 0.6F}, {4, 4, 5}, 0.6F, 2)};
  descriptor.lights[0].direction_covariance = {4e-6F, 1e-6F, 2e-6F};
  descriptor.bound.total = 0.02F;
  descriptor.flags.set(Flag::clipped);
  return descriptor;
}

template <class T>
bool finite(const Rgb<T>& v) {
  return std::isfinite(v.r) && std::isfinite(v.g) && std::isfinite(v.b);
}

template <class T>
void expect_near(const Rgb<T>& a, const Rgb<T>& b, double tolerance) {
  EXPECT_NEAR(a.r, b.r, tolerance);
  EXPECT_NEAR(a.g, b.g, tolerance);
  EXPECT_NEAR(a.b, b.b, tolerance);
}

TEST(LightingQuery, InvalidDirectionsAreFlagged) {
  const Lighting lighting = Lighting::of(mixed_scene());
  for (const Vec3f bad :
       {Vec3f{}, Vec3f{kNan, 0, 1}, Vec3f{0, kInf, 0}, Vec3f{-kInf, kInf, 1}, Vec3f{kNan, kNan, kNan}}) {
    const Answer<Irradiance> e = lighting.irradiance(bad);
    EXPECT_EQ(e.validity, Validity::invalid_query);
    EXPECT_EQ(e.value, Irradiance{});
    for (const float roughness : {0.0F, 0.4F}) {
      const Answer<Radiance> l = lighting.radiance(bad, roughness);
      EXPECT_EQ(l.validity, Validity::invalid_query);
      EXPECT_EQ(l.value, Radiance{});
    }
  }
}

TEST(LightingQuery, LengthDoesNotMatter) {
  const Lighting lighting = Lighting::of(mixed_scene());
  const Irradiance unit = lighting.irradiance({1, 0, 0}).value;
  for (const float length : {kTiny, 1e-30F, 0.5F, 7.0F, 1e30F, kMax}) {
    const Answer<Irradiance> e = lighting.irradiance({length, 0, 0});
    EXPECT_EQ(e.validity, Validity::valid);
    expect_near(e.value, unit, 1e-5);
    EXPECT_TRUE(finite(lighting.radiance({0, length, 0}, 0.3F).value));
  }
}

TEST(LightingQuery, RoughnessIsClampedOrRejected) {
  const Lighting lighting = Lighting::of(mixed_scene());
  const Vec3f d{0.1F, 1, 0.2F};
  for (const float bad : {kNan, kInf, -kInf}) EXPECT_EQ(lighting.radiance(d, bad).validity, Validity::invalid_query);
  expect_near(lighting.radiance(d, 5).value, lighting.radiance(d, 1).value, 0);
  expect_near(lighting.radiance(d, kTiny).value, lighting.radiance(d, 0.02F).value, 0);
  expect_near(lighting.radiance(d, -1).value, lighting.radiance(d, 0).value, 0);
}

TEST(LightingQuery, MirrorExcludesLightsAndSaysSo) {
  const Lighting lighting = Lighting::of(test::one_light({0, 1, 0}, {1, 1, 1}, 0.3F));
  const Answer<Radiance> mirror = lighting.radiance({0, 1, 0}, 0);
  EXPECT_EQ(mirror.lights, LightsIncluded::no);
  EXPECT_EQ(mirror.validity, Validity::valid);
  EXPECT_EQ(mirror.value, Radiance{});
  const Answer<Radiance> rough = lighting.radiance({0, 1, 0}, 0.3F);
  EXPECT_EQ(rough.lights, LightsIncluded::yes);
  EXPECT_GT(rough.value.r, 0.1F);
}

TEST(LightingQuery, AnswersHaveValidityAndErrorBound) {
  const Lighting lighting = Lighting::of(mixed_scene(), {100'000'000}, {250'000'000});
  const Answer<Irradiance> e = lighting.irradiance({0, 1, 0});
  EXPECT_EQ(e.validity, Validity::valid);
  EXPECT_EQ(e.age.ns, 100'000'000);
  EXPECT_FLOAT_EQ(e.error_bound, 0.02F);
  EXPECT_TRUE(e.flags.has(Flag::clipped));
  EXPECT_TRUE(lighting.reason().empty());
}

TEST(LightingQuery, OldLightIsStaleButUsable) {
  const Lighting fresh = Lighting::of(mixed_scene(), {250'000'000}, {250'000'000});
  EXPECT_EQ(fresh.validity(), Validity::valid);
  const Lighting stale = Lighting::of(mixed_scene(), {312'000'000}, {250'000'000});
  EXPECT_EQ(stale.validity(), Validity::stale);
  EXPECT_NE(stale.reason().find("312 ms"), std::string::npos) << stale.reason();
  EXPECT_EQ(stale.irradiance({0, 1, 0}).validity, Validity::stale);
  EXPECT_EQ(stale.irradiance({0, 1, 0}).value, fresh.irradiance({0, 1, 0}).value);
}

TEST(LightingQuery, EmptyLightingGivesZero) {
  const Lighting nothing;
  EXPECT_EQ(nothing.validity(), Validity::none);
  EXPECT_FALSE(nothing.reason().empty());
  EXPECT_EQ(nothing.irradiance({0, 1, 0}).validity, Validity::none);
  EXPECT_EQ(nothing.irradiance({0, 1, 0}).value, Irradiance{});
  EXPECT_EQ(nothing.radiance({0, 1, 0}, 0.5F).validity, Validity::none);
  EXPECT_TRUE(nothing.lights().empty());
  EXPECT_FALSE(nothing.primary_light());
  EXPECT_EQ(nothing.encoded_bytes(), 0U);
  EXPECT_EQ(nothing.rotated({}).validity(), Validity::none);
}

TEST(LightingQuery, StrongestLightIsThePrimary) {
  const Lighting lighting = Lighting::of(mixed_scene());
  ASSERT_EQ(lighting.lights().size(), 2U);
  ASSERT_TRUE(lighting.primary_light());
  EXPECT_EQ(lighting.primary_light()->track, 1U);
  EXPECT_EQ(lighting.units(), Units::absolute);
}

TEST(LightingQuery, CopiesShareOneState) {
  const Lighting lighting = Lighting::of(mixed_scene());
  const Lighting copy = lighting;  // NOLINT(performance-unnecessary-copy-initialization)
  EXPECT_EQ(&copy.descriptor(), &lighting.descriptor());
  static_assert(std::is_nothrow_move_constructible_v<Lighting>);
}

TEST(LightingQuery, RotatedRotatesEveryQuery) {
  const Lighting lighting = Lighting::of(mixed_scene());
  for (const Vec3f axis : test::directions()) {
    const Quat q = Quat::about(normalized(vec_cast<double>(axis)), 1.1);
    const Lighting turned = lighting.rotated(q);
    EXPECT_EQ(turned.validity(), Validity::valid);
    for (const Vec3f d : test::directions()) {
      const Vec3f turned_d = rotate(q, d);
      // Sums of about 20 whose parts went through one more rotation in single precision.
      expect_near(turned.irradiance(turned_d).value, lighting.irradiance(d).value, 2e-4);
      expect_near(turned.radiance(turned_d, 0).value, lighting.radiance(d, 0).value, 2e-4);
      expect_near(turned.radiance(turned_d, 0.7F).value, lighting.radiance(d, 0.7F).value, 2e-4);
    }
  }
}

TEST(LightingQuery, RotationByNinetyDegreesAboutUpMapsRightToForward) {
  // By hand: right-handed about +Y by 90° takes +X to -Z.
  const Lighting lighting = Lighting::of(test::one_light({1, 0, 0}, {1, 1, 1}));
  const Lighting turned = lighting.rotated(Quat::about({0, 1, 0}, 1.5707963267948966));
  EXPECT_NEAR(turned.lights()[0].direction.z, -1, 1e-6);
  EXPECT_NEAR(turned.irradiance({0, 0, -1}).value.r, 1, 1e-6);
}

TEST(LightingQuery, RotatedTransportsTheCovariance) {
  const Lighting lighting = Lighting::of(mixed_scene());
  const auto world = [](const Light& l, Vec3d axis) {
    const auto basis = tangent_basis(vec_cast<double>(l.direction));
    const double u = dot(basis[0], axis), v = dot(basis[1], axis);
    const auto& c = l.direction_covariance;
    return static_cast<double>(c[0]) * u * u + 2 * static_cast<double>(c[1]) * u * v +
           static_cast<double>(c[2]) * v * v;
  };
  for (const Vec3f turn_axis : test::directions()) {
    const Quat q = Quat::about(normalized(vec_cast<double>(turn_axis)), 2.3);
    const Lighting turned = lighting.rotated(q);
    for (const Vec3f axis : test::directions()) {
      const Vec3d a = vec_cast<double>(axis);
      // Variances of 4e-6, off by the direction's rounding.
      EXPECT_NEAR(world(turned.lights()[0], rotate(q, a)), world(lighting.lights()[0], a), 1e-11);
    }
  }
}

TEST(LightingQuery, InvalidRotationIsFlagged) {
  const Lighting lighting = Lighting::of(mixed_scene());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  for (const Quat bad : {Quat{0, 0, 0, 0}, Quat{nan, 0, 0, 1}, Quat{0, inf, 0, 1}}) {
    const Lighting turned = lighting.rotated(bad);
    EXPECT_EQ(turned.validity(), Validity::invalid_query);
    EXPECT_FALSE(turned.reason().empty());
    EXPECT_EQ(turned.irradiance({0, 1, 0}).value, Irradiance{});
    EXPECT_EQ(turned.irradiance({0, 1, 0}).validity, Validity::invalid_query);
  }
  // Length does not matter.
  const Lighting doubled = lighting.rotated({0, 2, 0, 2});
  const Lighting unit = lighting.rotated(Quat::about({0, 1, 0}, 1.5707963267948966));
  expect_near(doubled.irradiance({1, 2, 3}).value, unit.irradiance({1, 2, 3}).value, 1e-5);
}

}  // namespace
}  // namespace lightwell
