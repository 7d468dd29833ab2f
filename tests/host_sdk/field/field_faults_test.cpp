// What a light field does with probes that are wrong, and where it cannot know.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/field.hpp>

#include "host_sdk/field/field_scenes.hpp"

namespace lightwell::test {
namespace {

using testing::HasSubstr;

const std::vector<Lamp> kLamps{{{0.4, 2.2, -0.3}}, {{-1.1, 1.9, 0.9}, {1, 2, 4}}};
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

LightField empty_field(const FieldOptions& options = {}) { return std::move(LightField::make(options).value()); }

double bound_at(const LightField& field, Vec3d p) {
  return static_cast<double>(field.at(p, {}).light.descriptor().bound.total);
}

void expect_finite(const LightField& field, Vec3d point) {
  for (const Vec3f normal : {Vec3f{0, 1, 0}, Vec3f{1, 0, 0}, Vec3f{0, -1, 0}}) {
    const auto e = field.irradiance(point, normal, {});
    EXPECT_TRUE(std::isfinite(e.value.r + e.value.g + e.value.b));
    EXPECT_FALSE(std::isnan(e.error_bound));
    const Irradiance whole = field.at(point, {}).light.irradiance(normal).value;
    EXPECT_TRUE(std::isfinite(whole.r + whole.g + whole.b));
  }
}

TEST(LightFieldFaultsTest, WithOneProbeTheBoundGrowsWithTheDistanceUntilItSaysNothing) {
  const LightField field = field_of({.lamps = kLamps}, {{0, 1, 0}});
  EXPECT_TRUE(field.state()->lights.empty());
  double before = bound_at(field, {0, 1, 0});
  EXPECT_NEAR(before, 0.01, 0.002);  // The probe's own.
  for (const double x : {0.1, 0.3, 0.6}) {
    const double bound = bound_at(field, {x, 1, 0});
    EXPECT_GT(bound, before);
    before = bound;
  }
  const FieldAnswer far = field.at({4, 1, 0}, {});
  EXPECT_TRUE(std::isinf(far.light.descriptor().bound.total));
  EXPECT_TRUE(far.light.descriptor().flags.has(Flag::unsure));
  EXPECT_TRUE(far.flags.has(FieldFlag::one_probe));
  EXPECT_TRUE(far.flags.has(FieldFlag::far_from_probes));
  EXPECT_FALSE(field.at({0.1, 1, 0}, {}).flags.has(FieldFlag::far_from_probes));
}

TEST(LightFieldFaultsTest, ProbesSideBySideThatContradictEachOtherAreFlagged) {
  LightField field = empty_field();
  ASSERT_TRUE(field.set("a", sample_at({0, 1, 0}, FieldScene{.ambient = 1}.at({}))).ok());
  ASSERT_TRUE(field.set("b", sample_at({0.2, 1, 0}, FieldScene{.ambient = 5}.at({}))).ok());
  const auto state = field.update({});
  for (const char* name : {"a", "b"}) {
    EXPECT_EQ(probe_named(*state, name).state, FieldProbeState::contradicted);
    EXPECT_THAT(probe_named(*state, name).reason, HasSubstr("another light"));
  }
  const FieldAnswer answer = field.at({0.1, 1, 0}, {});
  EXPECT_TRUE(answer.flags.has(FieldFlag::contradiction));
  EXPECT_TRUE(std::isinf(answer.light.descriptor().bound.total));
  expect_finite(field, {0.1, 1, 0});
  ASSERT_TRUE(field.set("b", sample_at({0.2, 1, 0}, FieldScene{.ambient = 1}.at({}))).ok());
  EXPECT_EQ(field.update({})->probes[0].state, FieldProbeState::used);
}

TEST(LightFieldFaultsTest, RelativeUnitsAreBroughtToTheScaleOfTheOthers) {
  const FieldScene scene{.lamps = kLamps};
  const auto places = four_places();
  LightField field = field_of(scene, places);
  Descriptor dim = scene.at(places[3]);
  dim.units = Units::relative;
  dim.calibration_id = 9;
  for (auto& c : dim.radiance.c) c = c * (1 / 7.0F);
  for (Light& light : dim.lights) light.irradiance = light.irradiance * (1 / 7.0F);
  ASSERT_TRUE(field.set(name_of(3), sample_at(places[3], dim)).ok());
  const auto state = field.update({});
  EXPECT_EQ(probe_named(*state, name_of(3)).state, FieldProbeState::used);
  EXPECT_NEAR(probe_named(*state, name_of(3)).scale, 7, 0.15);  // A prior on the logarithm, of 5.
  EXPECT_EQ(state->units, Units::absolute);
  EXPECT_NEAR(field.irradiance(places[3], {0, 1, 0}, {}).value.g, scene.irradiance(places[3], {0, 1, 0}).g,
              0.03 * scene.irradiance(places[3], {0, 1, 0}).g);
}

TEST(LightFieldFaultsTest, RelativeUnitsWithoutACommonLightAreRefused) {
  const auto places = four_places();
  LightField field = field_of({.lamps = kLamps}, {places[0], places[1], places[2]});
  FieldScene dark{.units = Units::relative};
  Descriptor other = dark.at(places[3]);
  other.calibration_id = 9;
  ASSERT_TRUE(field.set("other", sample_at(places[3], other)).ok());
  const auto state = field.update({});
  EXPECT_EQ(probe_named(*state, "other").state, FieldProbeState::wrong_scale);
  EXPECT_THAT(probe_named(*state, "other").reason, HasSubstr("shares no light"));
}

TEST(LightFieldFaultsTest, AnAbsoluteProbeOfAnotherScaleIsRefusedAndTheOthersStand) {
  const FieldScene scene{.lamps = kLamps};
  const auto places = four_places();
  LightField field = field_of(scene, places);
  Descriptor bright = scene.at(places[2]);
  bright.calibration_id = 9;
  for (auto& c : bright.radiance.c) c = c * 10.0F;
  for (Light& light : bright.lights) light.irradiance = light.irradiance * 10.0F;
  ASSERT_TRUE(field.set(name_of(2), sample_at(places[2], bright)).ok());
  const auto state = field.update({});
  EXPECT_EQ(probe_named(*state, name_of(2)).state, FieldProbeState::wrong_scale);
  EXPECT_THAT(probe_named(*state, name_of(2)).reason, HasSubstr("photometric calibration"));
  EXPECT_EQ(probe_named(*state, name_of(0)).state, FieldProbeState::used);
  const double truth = scene.irradiance({0, 1, 0}, {0, 1, 0}).g;
  EXPECT_NEAR(field.irradiance({0, 1, 0}, {0, 1, 0}, {}).value.g, truth, 0.1 * truth);
}

TEST(LightFieldFaultsTest, WhereNoMajorityTellsWhichScaleIsRightNoBoundIsGiven) {
  const FieldScene scene{.lamps = kLamps};
  LightField field = field_of(scene, {four_places()[0]});
  Descriptor bright = scene.at({1, 1, 0.5});
  bright.calibration_id = 9;
  for (Light& light : bright.lights) light.irradiance = light.irradiance * 10.0F;
  ASSERT_TRUE(field.set("other", sample_at({1, 1, 0.5}, bright)).ok());
  const auto state = field.update({});
  EXPECT_EQ(std::ranges::count(state->probes, FieldProbeState::wrong_scale, &FieldProbe::state), 1);
  EXPECT_EQ(std::ranges::count(state->probes, FieldProbeState::contradicted, &FieldProbe::state), 1);
  EXPECT_TRUE(std::isinf(bound_at(field, {0, 1, 0})));
}

TEST(LightFieldFaultsTest, AProbeWithAWrongPoseIsRefusedAndTheOthersStand) {
  const FieldScene scene{.lamps = kLamps};
  const auto places = four_places();
  LightField field = field_of(scene, places);
  FieldSample wrong = sample_at(places[1], scene.at(places[1]));
  wrong.T_world_probe.pose.rotation = Quat::about({0, 1, 0}, 0.7);  // It says 0.7 rad and stands at 0.
  ASSERT_TRUE(field.set(name_of(1), wrong).ok());
  const auto state = field.update({});
  EXPECT_EQ(probe_named(*state, name_of(1)).state, FieldProbeState::wrong_pose);
  EXPECT_THAT(probe_named(*state, name_of(1)).reason, HasSubstr("check its pose"));
  ASSERT_NE(light_near(*state, kLamps[0].position, 0.01), nullptr);
  const double truth = scene.irradiance({0.5, 1, 0}, {0, 1, 0}).g;
  EXPECT_NEAR(field.irradiance({0.5, 1, 0}, {0, 1, 0}, {}).value.g, truth, 0.02 * truth);
}

TEST(LightFieldFaultsTest, AnUncertainPoseGivesAnUncertainPlace) {
  const FieldScene scene{.lamps = {kLamps[0]}};
  const auto places = four_places();
  const auto with_rotation = [&](double sigma) {
    LightField field = empty_field();
    for (std::size_t k = 0; k < places.size(); ++k) {
      FieldSample sample = sample_at(places[k], scene.at(places[k]));
      for (std::size_t i = 0; i < 3; ++i) sample.T_world_probe.covariance[i][i] = sigma * sigma;
      (void)field.set(name_of(k), sample);
    }
    const auto state = field.update({});
    const FieldLight* const light = light_near(*state, kLamps[0].position);
    return light != nullptr ? std::sqrt(light->position_covariance[0]) : 0;
  };
  EXPECT_GT(with_rotation(0.01), 3 * with_rotation(1e-4));
  EXPECT_LT(with_rotation(0.01), 0.05);
}

TEST(LightFieldFaultsTest, SamplesAgeOut) {
  const FieldScene scene{.lamps = kLamps};
  const auto places = four_places();
  LightField field = empty_field({.max_age = Duration::from_seconds(1), .drop_age = Duration::from_seconds(10)});
  const auto at = [](double s) { return HostTime{} + Duration::from_seconds(s); };
  for (std::size_t k = 0; k < 4; ++k)
    ASSERT_TRUE(field.set(name_of(k), sample_at(places[k], scene.at(places[k]), {}, at(k == 0 ? 100 : 102))).ok());
  auto state = field.update(at(102.5));
  EXPECT_EQ(probe_named(*state, name_of(0)).state, FieldProbeState::stale);
  EXPECT_EQ(probe_named(*state, name_of(1)).state, FieldProbeState::used);
  // Near the old sample the answer is stale; far from it that one hardly counts.
  EXPECT_EQ(field.at(places[0], at(102.5)).light.validity(), Validity::stale);
  EXPECT_EQ(field.at(places[2], at(102.5)).light.validity(), Validity::valid);
  EXPECT_EQ(field.at(places[2], at(102.5)).light.age(), Duration::from_seconds(0.5));
  // Time passes without updates.
  EXPECT_EQ(field.at(places[2], at(104)).light.validity(), Validity::stale);
  state = field.update(at(111));
  EXPECT_EQ(probe_named(*state, name_of(0)).state, FieldProbeState::expired);
  EXPECT_THAT(probe_named(*state, name_of(0)).reason, HasSubstr("11 s old"));
  EXPECT_EQ(field.irradiance(places[0], {0, 1, 0}, at(111)).age, Duration::from_seconds(9));
}

TEST(LightFieldFaultsTest, ASampleFromTheFutureTakesNoPart) {
  LightField field = field_of({.lamps = kLamps}, four_places());
  const HostTime tomorrow = HostTime{} + Duration::from_seconds(86'400);
  ASSERT_TRUE(field.set("fast clock", sample_at({0, 1, 0}, FieldScene{.ambient = 50}.at({}), {}, tomorrow)).ok());
  const auto state = field.update({});
  EXPECT_EQ(probe_named(*state, "fast clock").state, FieldProbeState::wrong_clock);
  EXPECT_THAT(probe_named(*state, "fast clock").reason, HasSubstr("check its clock"));
  EXPECT_LT(field.irradiance({0, 1, 0}, {0, -1, 0}, {}).value.g, 2);
  // Within its uncertainty it counts as now.
  FieldSample uncertain = sample_at({0, 1, 0}, FieldScene{.lamps = kLamps}.at({0, 1, 0}), {}, tomorrow);
  uncertain.time_uncertainty = Duration::from_seconds(90'000);
  ASSERT_TRUE(field.set("fast clock", uncertain).ok());
  EXPECT_NE(probe_named(*field.update({}), "fast clock").state, FieldProbeState::wrong_clock);
}

TEST(LightFieldFaultsTest, AtALightTheAnswerIsFiniteAndFlagged) {
  const LightField field = field_of({.lamps = kLamps}, four_places());
  for (const Vec3d offset : {Vec3d{}, Vec3d{1e-12, 0, 0}, Vec3d{0.01, 0, 0}}) {
    const FieldAnswer answer = field.at(kLamps[0].position + offset, {});
    EXPECT_TRUE(answer.flags.has(FieldFlag::at_light));
    EXPECT_TRUE(std::isinf(answer.light.descriptor().bound.total));
    expect_finite(field, kLamps[0].position + offset);
  }
  EXPECT_FALSE(field.at(kLamps[0].position + Vec3d{0.5, 0, 0}, {}).flags.has(FieldFlag::at_light));
}

TEST(LightFieldFaultsTest, ALampAtAProbesPositionDoesNotSpoilTheOthers) {
  const FieldScene scene{.lamps = kLamps};
  auto places = four_places();
  places.push_back(kLamps[0].position + Vec3d{0.03, 0, 0});
  const LightField field = field_of(scene, places);
  ASSERT_NE(light_near(*field.state(), kLamps[0].position, 0.02), nullptr);
  expect_finite(field, places.back());
  expect_finite(field, kLamps[0].position);
  const double truth = scene.irradiance({0.9, 0.6, -0.8}, {0, 1, 0}).g;
  EXPECT_NEAR(field.irradiance({0.9, 0.6, -0.8}, {0, 1, 0}, {}).value.g, truth, 0.1 * truth);
}

TEST(LightFieldFaultsTest, ProbesAtTheSamePlaceGiveNoDistance) {
  const FieldScene scene{.lamps = kLamps};
  const LightField field = field_of(scene, {{0, 1, 0}, {0, 1, 0}});
  for (const FieldLight& light : field.state()->lights) EXPECT_FALSE(light.placed);
  expect_finite(field, {0, 1, 0});
  expect_finite(field, {0.5, 1, 0});
}

TEST(LightFieldFaultsTest, InputThatIsNotFiniteIsRefusedByName) {
  LightField field = empty_field();
  const Descriptor good = FieldScene{.lamps = kLamps}.at({0, 1, 0});
  const auto refusal = [&](const FieldSample& sample) { return field.set("hall", sample).message(); };
  FieldSample sample = sample_at({0, 1, 0}, good);
  sample.T_world_probe.pose.translation.x = kNan;
  EXPECT_THAT(refusal(sample), HasSubstr("pose of probe hall"));
  sample = sample_at({0, 1, 0}, good);
  sample.T_world_probe.covariance[4][4] = std::numeric_limits<double>::infinity();
  EXPECT_THAT(refusal(sample), HasSubstr("variance is unknown"));
  sample = sample_at({0, 1, 0}, good);
  sample.T_world_probe.pose.rotation = {0, 0, 0, 0};
  EXPECT_THAT(refusal(sample), HasSubstr("pose of probe hall"));
  sample = sample_at({0, 1, 0}, good);
  sample.light.lights[0].irradiance.g = std::numeric_limits<float>::infinity();
  EXPECT_THAT(refusal(sample), HasSubstr("descriptor of probe hall"));
  sample.light.lights.clear();
  sample.light.radiance.c[3].b = static_cast<float>(kNan);
  EXPECT_THAT(refusal(sample), HasSubstr("descriptor of probe hall"));
  EXPECT_FALSE(field.set("", sample_at({0, 1, 0}, good)).ok());
  EXPECT_TRUE(field.update({})->probes.empty());
}

TEST(LightFieldFaultsTest, QueriesThatAreNotFiniteAreInvalid) {
  const LightField field = field_of({.lamps = kLamps}, four_places());
  EXPECT_EQ(field.at({kNan, 0, 0}, {}).light.validity(), Validity::invalid_query);
  EXPECT_EQ(field.irradiance({0, kNan, 0}, {0, 1, 0}, {}).validity, Validity::invalid_query);
  EXPECT_EQ(field.irradiance({0, 1, 0}, {0, 0, 0}, {}).validity, Validity::invalid_query);
  expect_finite(field, {1e9, -1e9, 1e9});
}

TEST(LightFieldFaultsTest, BlackAndNegativeLightIsHarmless) {
  LightField field = empty_field();
  FieldScene dark{.ambient = 0};
  ASSERT_TRUE(field.set("a", sample_at({0, 1, 0}, dark.at({}))).ok());
  Descriptor negative = dark.at({});
  negative.radiance.c[0] = {-1, -1, -1};
  Light light;
  light.direction = {0, 1, 0};
  light.irradiance = {-1, 0, 0};
  negative.lights = {light, light};
  ASSERT_TRUE(field.set("b", sample_at({1, 1, 0}, negative)).ok());
  (void)field.update({});
  expect_finite(field, {0.5, 1, 0});
  EXPECT_TRUE(std::isinf(field.at({0, 1, 0}, {}).light.descriptor().bound.total));
}

TEST(LightFieldFaultsTest, AFieldHasALimitOfProbes) {
  LightField field = empty_field();
  const Descriptor d = FieldScene{}.at({});
  for (std::size_t k = 0; k < kMaxFieldProbes; ++k)
    ASSERT_TRUE(field.set(name_of(k), sample_at({static_cast<double>(k), 1, 0}, d)).ok());
  EXPECT_EQ(field.set("one more", sample_at({0, 1, 1}, d)).code(), StatusCode::resource_exhausted);
  EXPECT_TRUE(field.set(name_of(7), sample_at({0, 1, 1}, d)).ok());
}

TEST(LightFieldFaultsTest, OptionsAreChecked) {
  EXPECT_THAT(LightField::make({.max_age = {}}).status().message(), HasSubstr("max_age"));
  EXPECT_THAT(LightField::make({.drop_age = Duration{1}}).status().message(), HasSubstr("drop_age"));
  EXPECT_THAT(LightField::make({.typical_distance_m = kNan}).status().message(), HasSubstr("typical_distance_m"));
}

TEST(LightFieldFaultsTest, QueriesGoOnWhileProbesAreAddedAndRemoved) {
  const FieldScene scene{.lamps = kLamps};
  const auto places = four_places();
  LightField field = field_of(scene, places);
  const float truth = scene.irradiance({0, 1, 0}, {0, 1, 0}).g;
  std::atomic<bool> done = false;
  std::atomic<int> wrong = 0, queries = 0;
  std::thread reader([&] {
    while (!done) {
      const float e = field.irradiance({0, 1, 0}, {0, 1, 0}, {}).value.g;
      wrong += std::abs(e - truth) < 0.05F * truth ? 0 : 1;
      ++queries;
    }
  });
  for (int round = 0; round < 100 || queries < 100; ++round) {
    const std::size_t k = static_cast<std::size_t>(round) % 4;
    EXPECT_TRUE(field.remove(name_of(k)));
    (void)field.update({});
    EXPECT_TRUE(field.set(name_of(k), sample_at(places[k], scene.at(places[k]))).ok());
    (void)field.update({});
  }
  done = true;
  reader.join();
  EXPECT_EQ(wrong, 0);
}

}  // namespace
}  // namespace lightwell::test
