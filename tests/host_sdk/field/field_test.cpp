// What a light field says of lamps that several probes see.
#include <array>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <lightwell/field.hpp>

#include "host_sdk/field/field_scenes.hpp"

namespace lightwell::test {
namespace {

const Lamp kLamp{{0.4, 2.2, -0.3}};

double bound_at(const LightField& field, Vec3d p) {
  return static_cast<double>(field.at(p, {}).light.descriptor().bound.total);
}

void expect_irradiance(const LightField& field, const FieldScene& scene, Vec3d point, double tolerance) {
  for (const Vec3f normal : {Vec3f{0, 1, 0}, Vec3f{1, 0, 0}, Vec3f{-0.6F, 0.8F, 0}, Vec3f{0, 0, 1}, Vec3f{0, -1, 0}}) {
    const Irradiance truth = scene.irradiance(point, normal), said = field.at(point, {}).light.irradiance(normal).value;
    EXPECT_NEAR(said.r, truth.r, tolerance * truth.r);
    EXPECT_NEAR(said.b, truth.b, tolerance * truth.b);
  }
}

TEST(LightFieldTest, PlacesALampThatSeveralProbesSee) {
  const LightField field = field_of({.lamps = {kLamp}}, four_places());
  const auto state = field.state();
  ASSERT_EQ(state->lights.size(), 1U);
  const FieldLight& light = state->lights[0];
  EXPECT_TRUE(light.placed);
  EXPECT_EQ(light.probes, 4U);
  EXPECT_LT(length(light.position - kLamp.position), 1e-3);  // Exact directions, floats.
  // The floor of a direction's deviation, 1 mrad at some 2 m, over four probes.
  EXPECT_NEAR(std::sqrt(light.position_covariance[0]), 1e-3, 1e-3);
  EXPECT_NEAR(light.intensity.r, kLamp.intensity.r, 0.01 * kLamp.intensity.r);
  EXPECT_NEAR(light.radius, kLamp.radius_m, 1e-3);
}

TEST(LightFieldTest, IrradianceIsThatOfTheLampAtAnyPoint) {
  const FieldScene scene{.lamps = {kLamp, {{-1.1, 1.9, 0.9}, {1, 2, 4}}}};
  const LightField field = field_of(scene, four_places());
  for (const Vec3d point : {Vec3d{0, 1, 0}, {0.4, 1.4, -0.3}, {-1, 0.5, 1}, {1.5, 0.2, 1.2}})
    expect_irradiance(field, scene, point, 0.02);
}

TEST(LightFieldTest, DirectionOfALampTurnsAsThePointMoves) {
  const LightField field = field_of({.lamps = {kLamp}}, four_places());
  for (const Vec3d point : {Vec3d{0, 1, 0}, {-0.2, 1.9, -0.4}, {1.8, 0.3, -1}}) {
    const FieldAnswer answer = field.at(point, {});
    ASSERT_TRUE(answer.light.primary_light());
    const Vec3d towards = kLamp.position - point;
    EXPECT_LT(angle_between(vec_cast<double>(answer.light.primary_light()->direction), towards), 2e-3);
    EXPECT_NEAR(answer.light.primary_light()->distance_m, length(towards), 2e-3);
    EXPECT_EQ(answer.light.origin().translation, point);
  }
}

TEST(LightFieldTest, TheSunIsDistantAndTheSameEverywhere) {
  const FieldScene scene{.lamps = {}, .sun = {9, 8, 7}};
  const LightField field = field_of(scene, four_places());
  const auto state = field.state();
  ASSERT_EQ(state->lights.size(), 1U);
  EXPECT_FALSE(state->lights[0].placed);
  EXPECT_LT(angle_between(vec_cast<double>(state->lights[0].direction), scene.towards_sun), 1e-3);
  expect_irradiance(field, scene, {0.5, 0.5, 0.5}, 0.01);
}

TEST(LightFieldTest, AFlatEmitterShinesAlongItsNormal) {
  // Intensity falls with the cosine to its normal, which points down.
  FieldScene scene;
  const Vec3d lamp{0, 2.6, 0};
  LightField field = std::move(LightField::make().value());
  const std::vector<Vec3d> places{{-1.5, 1.2, -1.4}, {1.6, 2.2, -1.2}, {0.2, 0.6, 0.3}, {-0.6, 1.9, 1.6}};
  const auto lit = [&](Vec3d place) {
    const Vec3d to = normalized(lamp - place);
    FieldScene here = scene;
    const auto cosine = static_cast<float>(to.y);
    here.lamps = {{lamp, {4 * cosine, 3 * cosine, 2 * cosine}}};
    return here;
  };
  for (std::size_t k = 0; k < places.size(); ++k)
    ASSERT_TRUE(field.set(name_of(k), sample_at(places[k], lit(places[k]).at(places[k]))).ok());
  const auto state = field.update({});
  ASSERT_EQ(state->lights.size(), 1U);
  EXPECT_LT(state->lights[0].intensity_gradient[1].luminance(), -1.5);
  const Vec3d steep{0.1, 1, 0.1}, grazing{1.7, 2.3, 0.4};
  expect_irradiance(field, lit(steep), steep, 0.1);
  expect_irradiance(field, lit(grazing), grazing, 0.2);
}

TEST(LightFieldTest, AMeasuredDistancePlacesALampThatOneProbeSees) {
  const FieldScene scene{.lamps = {kLamp}};
  Descriptor d = scene.at({0, 1, 0});
  d.lights[0].distance_m = static_cast<float>(length(kLamp.position - Vec3d{0, 1, 0}));
  d.lights[0].distance_sigma_m = 0.01F;
  LightField field = std::move(LightField::make().value());
  ASSERT_TRUE(field.set("marker", sample_at({0, 1, 0}, d)).ok());
  const auto state = field.update({});
  ASSERT_NE(light_near(*state, kLamp.position, 0.01), nullptr);
  expect_irradiance(field, scene, {0.4, 1.4, 0.2}, 0.05);
}

TEST(LightFieldTest, ALampThatOnlyOneProbeSeesStaysWithThatProbe) {
  const auto places = four_places();
  LightField field = std::move(LightField::make().value());
  for (std::size_t k = 0; k < places.size(); ++k) {
    const FieldScene scene{.lamps = k == 0 ? std::vector<Lamp>{kLamp} : std::vector<Lamp>{}};
    ASSERT_TRUE(field.set(name_of(k), sample_at(places[k], scene.at(places[k]))).ok());
  }
  EXPECT_TRUE(field.update({})->lights.empty());
  const float near = field.at(places[0], {}).light.irradiance({0, 1, 0}).value.g;
  const float other = field.at(places[2], {}).light.irradiance({0, 1, 0}).value.g;
  EXPECT_NEAR(near, FieldScene{.lamps = {kLamp}}.irradiance(places[0], {0, 1, 0}).g, 0.01);
  EXPECT_NEAR(other, FieldScene{}.irradiance(places[2], {0, 1, 0}).g, 0.01);
  EXPECT_GT(bound_at(field, {0, 1, 0}), bound_at(field_of({.lamps = {kLamp}}, places), {0, 1, 0}));
}

TEST(LightFieldTest, TwoEqualLampsCloseTogetherStayTwo) {
  const Lamp other{kLamp.position + Vec3d{0.25, 0, 0.05}};
  const FieldScene scene{.lamps = {kLamp, other}};
  const LightField field = field_of(scene, four_places());
  EXPECT_EQ(field.state()->lights.size(), 2U);
  EXPECT_NE(light_near(*field.state(), kLamp.position, 0.01), nullptr);
  EXPECT_NE(light_near(*field.state(), other.position, 0.01), nullptr);
}

TEST(LightFieldTest, EqualLampsThatTwoProbesCannotTellApartAreNotPlacedWrongly) {
  // Probes and lamps are in a plane and mirror images of each other: the four rays meet in four points, two behind each
  // other on the middle line, and irradiances agree with all of them.
  const FieldScene scene{.lamps = {{{-0.3, 2, -2}}, {{0.3, 2, -2}}}};
  const LightField field = field_of(scene, {{-1, 2, 0}, {1, 2, 0}});
  EXPECT_TRUE(field.state()->lights.empty());
  for (const FieldProbe& probe : field.state()->probes) EXPECT_EQ(probe.ambiguous, 2U);
  const auto third = field_of(scene, {{-1, 2, 0}, {1, 2, 0}, {0.3, 0.8, 0.5}});
  EXPECT_EQ(third.state()->lights.size(), 2U);
  EXPECT_NE(light_near(*third.state(), scene.lamps[0].position, 0.01), nullptr);
  EXPECT_NE(light_near(*third.state(), scene.lamps[1].position, 0.01), nullptr);
}

/// Probe 3 does not list the lamp. The other light there is weaker than the lamp would be, or stronger, so that the
/// lamp could be in the harmonics.
void expect_hidden_from_the_last(const Lamp& second) {
  const auto places = four_places();
  LightField field = std::move(LightField::make().value());
  for (std::size_t k = 0; k < places.size(); ++k) {
    const FieldScene scene{.lamps = k == 3 ? std::vector<Lamp>{second} : std::vector<Lamp>{kLamp, second}};
    ASSERT_TRUE(field.set(name_of(k), sample_at(places[k], scene.at(places[k]))).ok());
  }
  const auto state = field.update({});
  ASSERT_NE(light_near(*state, kLamp.position, 0.01), nullptr);
  // At the probe from which it is hidden, it shines as little as that one saw.
  EXPECT_NEAR(field.at(places[3], {}).light.irradiance({0, 1, 0}).value.g,
              FieldScene{.lamps = {second}}.irradiance(places[3], {0, 1, 0}).g, 0.01);
  const Vec3d middle{0, 1.1, 0.4};
  const FieldAnswer between = field.at(middle, {});
  EXPECT_TRUE(between.flags.has(FieldFlag::occlusion_unknown));
  EXPECT_GT(between.light.descriptor().bound.total, 2 * bound_at(field_of({.lamps = {kLamp, second}}, places), middle));
}

TEST(LightFieldTest, ALampHiddenFromAProbeIsPlacedByTheOthersAndIsUncertainBetween) {
  expect_hidden_from_the_last({{-0.5, 2.0, 0.8}, {0.2F, 0.2F, 0.3F}});
  expect_hidden_from_the_last({{-0.5, 2.0, 0.8}, {2, 2, 3}});
}

TEST(LightFieldTest, ALampThatAProbeHasInItsHarmonicsIsTakenOutOfThem) {
  // The last probe lists the second lamp alone; the first one is in its harmonics.
  const FieldScene scene{.lamps = {kLamp, {{-0.5, 2.0, 0.8}, {4, 4, 6}}}};
  const auto places = four_places();
  LightField field = field_of(scene, places);
  Descriptor d = scene.at(places[3]);
  d.radiance.band = 6;
  std::array<float, sh_count(6)> basis;
  sh_basis(6, d.lights[0].direction, basis);
  for (std::size_t i = 0; i < basis.size(); ++i) {
    const Irradiance e = d.lights[0].irradiance * basis[i];
    d.radiance.c[i] += Radiance{e.r, e.g, e.b};
  }
  d.lights.erase(d.lights.begin());
  ASSERT_TRUE(field.set(name_of(3), sample_at(places[3], d)).ok());
  (void)field.update({});
  for (const Vec3d point : {places[3], Vec3d{-1, 0.9, 1.2}, Vec3d{0.2, 1, 0.3}})
    EXPECT_NEAR(field.irradiance(point, {0, 1, 0}, {}).value.g, scene.irradiance(point, {0, 1, 0}).g,
                0.03 * scene.irradiance(point, {0, 1, 0}).g);
}

TEST(LightFieldTest, ALightBehindTheReceiverDoesNotReachIt) {
  const FieldScene scene{.lamps = {kLamp}, .ambient = 0};
  const LightField field = field_of(scene, four_places());
  const Vec3d point{0, 1, 0};
  const Vec3f away = vec_cast<float>(point - kLamp.position);
  EXPECT_NEAR(field.irradiance(point, away, {}).value.g, 0, 1e-4);
  EXPECT_GT(field.irradiance(point, -away, {}).value.g, 0.5);
}

TEST(LightFieldTest, IrradianceIsThatOfTheWholeAnswer) {
  const LightField field = field_of({.lamps = {kLamp}, .sun = {2, 2, 2}}, four_places());
  const std::vector<Vec3d> points{{0, 1, 0}, {1, 0.4, -1}, {-1.5, 1.2, -1.4}};
  std::vector<FieldAnswer> all(points.size());
  ASSERT_TRUE(field.at(points, {}, all));
  EXPECT_FALSE(field.at(std::span(points).first(2), {}, all));
  for (std::size_t i = 0; i < points.size(); ++i)
    for (const Vec3f normal : {Vec3f{0, 1, 0}, Vec3f{0.3F, -0.5F, 2}}) {
      const auto one = field.irradiance(points[i], normal, {});
      EXPECT_NEAR(one.value.r, all[i].light.irradiance(normal).value.r, 1e-4);
      EXPECT_NEAR(one.error_bound, all[i].light.descriptor().bound.total, 1e-5);
      EXPECT_EQ(one.validity, Validity::valid);
    }
}

TEST(LightFieldTest, AtAProbeTheFieldIsThatProbesLight) {
  const FieldScene scene{.lamps = {kLamp}, .sun = {1, 1, 1}};
  const auto places = four_places();
  const LightField field = field_of(scene, places);
  for (const Vec3d& place : places) {
    expect_irradiance(field, scene, place, 0.01);
    EXPECT_LT(field.at(place, {}).nearest_probe_m, 1e-6);
  }
}

TEST(LightFieldTest, ResidualLightIsInterpolatedBetweenProbes) {
  LightField field = std::move(LightField::make().value());
  ASSERT_TRUE(field.set("dark", sample_at({-1, 1, 0}, FieldScene{.ambient = 1}.at({}))).ok());
  ASSERT_TRUE(field.set("bright", sample_at({1, 1, 0}, FieldScene{.ambient = 3}.at({}))).ok());
  (void)field.update({});
  const auto up = [&](double x) { return field.irradiance({x, 1, 0}, {0, 1, 0}, {}).value.g; };
  EXPECT_NEAR(up(0), 2 * up(-1), 0.01 * up(0));
  EXPECT_NEAR(up(1), 3 * up(-1), 0.01 * up(1));
  EXPECT_LT(up(-0.5), up(0));
  EXPECT_LT(up(0), up(0.5));
}

TEST(LightFieldTest, LightsKeepTheirIdentityWhileProbesComeAndGo) {
  const auto places = four_places();
  const FieldScene scene{.lamps = {kLamp, {{-1.1, 1.9, 0.9}, {1, 2, 4}}}};
  LightField field = field_of(scene, places);
  const auto before = field.state();
  const std::uint32_t id = light_near(*before, kLamp.position)->id;
  EXPECT_TRUE(field.remove(name_of(1)));
  EXPECT_FALSE(field.remove(name_of(1)));
  const auto after = field.update({});
  EXPECT_EQ(after->probes.size(), 3U);
  ASSERT_NE(light_near(*after, kLamp.position), nullptr);
  EXPECT_EQ(light_near(*after, kLamp.position)->id, id);
  EXPECT_EQ(light_near(*after, kLamp.position)->probes, 3U);
  for (const std::size_t k : {0U, 2U, 3U}) EXPECT_TRUE(field.remove(name_of(k)));
  (void)field.update({});
  const FieldAnswer none = field.at({0, 1, 0}, {});
  EXPECT_EQ(none.light.validity(), Validity::none);
  EXPECT_TRUE(std::isinf(none.nearest_probe_m));
}

TEST(LightFieldTest, FiftyProbesGiveWhatFourGive) {
  const FieldScene scene{.lamps = {kLamp, {{-1.1, 1.9, 0.9}, {1, 2, 4}}}};
  std::vector<Vec3d> places;
  for (int k = 0; k < 50; ++k) {
    const double a = 2.4 * k, r = 0.3 * std::sqrt(k + 1.0);
    places.push_back({r * std::cos(a), 0.8 + 0.02 * k, r * std::sin(a)});
  }
  const LightField field = field_of(scene, places);
  EXPECT_EQ(field.state()->lights.size(), 2U);
  expect_irradiance(field, scene, {0.1, 0.6, 0.2}, 0.02);
}

}  // namespace
}  // namespace lightwell::test
