// A panorama goes in at the daemon, and its light comes out of the SDK.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "e2e/daemon.hpp"
#include "e2e/light_truth.hpp"

namespace lightwell::test {
namespace {

class LightTest : public ::testing::Test {
 protected:
  LightTest() { write_exr(folder_.path("room.exr"), room_); }

  const PanoramaPixels room_ = room_with_lamp_at_plus_x();
  TempDir folder_;
  Daemon daemon_{{.camera = "sim:" + folder_.path("room.exr")}};
};

TEST_F(LightTest, DescriptorsArriveAndTheirSequenceGrows) {
  const Observer observer(daemon_.uri());
  ASSERT_TRUE(observer.gets(30));
  const std::vector<Descriptor> all = observer.descriptors();
  for (std::size_t i = 1; i < all.size(); ++i) {
    EXPECT_GT(all[i].sequence, all[i - 1].sequence);
    EXPECT_GT(all[i].time.mid_exposure, all[i - 1].time.mid_exposure);
    EXPECT_GE(all[i].time.encoded_after, all[i].time.delivered_after);
  }
  EXPECT_EQ(observer.probe().stats().undecodable, 0U);
}

TEST_F(LightTest, TheLatestIsValidAndYoung) {
  const Observer observer(daemon_.uri());
  ASSERT_TRUE(observer.gets(5));
  const Lighting light = observer.probe().latest();
  EXPECT_EQ(light.validity(), Validity::valid);
  EXPECT_LT(light.age().seconds(), 10);
  EXPECT_FALSE(light.descriptor().flags.any());
  EXPECT_GT(light.descriptor().coverage, 0.999F);
}

TEST_F(LightTest, ALampAtPlusXIsTheLightAtPlusX) {
  const Observer observer(daemon_.uri());
  ASSERT_TRUE(observer.gets(1));
  const std::optional<Light> lamp = observer.probe().latest().primary_light();
  ASSERT_TRUE(lamp);
  EXPECT_LT(angle_between(vec_cast<double>(lamp->direction), Vec3d{1, 0, 0}), 0.5 * kDegree);
  // pi sin² rho L: what a uniform disc gives at normal incidence.
  const double exact = 3.14159265 * std::pow(std::sin(6 * kDegree), 2) * 400;
  EXPECT_NEAR(lamp->irradiance.r, exact, 0.05 * exact);
  EXPECT_NEAR(lamp->irradiance.g / lamp->irradiance.r, 0.95, 0.02);
  EXPECT_NEAR(lamp->angular_radius_rad, 6 * kDegree, 1 * kDegree);
}

TEST_F(LightTest, IrradianceAgreesWithTheOracleWithinItsOwnBound) {
  const LightTruth truth(room_);
  const Observer observer(daemon_.uri());
  ASSERT_TRUE(observer.gets(1));
  const Lighting light = observer.probe().latest();
  const reference::IrradianceError error = truth.error_of(light);
  const double bound = static_cast<double>(light.descriptor().bound.total);
  EXPECT_LE(error.rms, bound);
  EXPECT_LE(error.luminance_weighted, bound);
  EXPECT_LE(error.rms, 0.02) << "the promise for the ideal sensor";
  EXPECT_LT(bound, 0.1) << "a bound that says nothing is no bound";
}

TEST_F(LightTest, TheProbeSaysWhoItIs) {
  const Observer observer(daemon_.uri());
  const ProbeInfo info = observer.probe().info();
  EXPECT_EQ(info.name, "lightwell");
  EXPECT_EQ(info.id, identity_of("lightwell"));
  EXPECT_THAT(info.camera, ::testing::StartsWith("sim:"));
  ASSERT_TRUE(observer.gets(1));
  EXPECT_EQ(observer.probe().latest().descriptor().calibration_id, info.calibration_id);
}

TEST_F(LightTest, AProbeThatWasToldWhereItHangsLightsItsRoom) {
  // It looks the other way: half a turn about up.
  const std::string mounting = folder_.write("mounting.textproto", "pose { qy: 1 tx: 0.5 ty: 2.5 }\n");
  Daemon mounted({.camera = "sim:" + folder_.path("room.exr"), .more = {"--mounting", mounting}});
  const Observer observer(mounted.uri());
  ASSERT_TRUE(observer.gets(1));
  EXPECT_GT(observer.probe().latest().irradiance({1, 0, 0}).value.r,
            4 * observer.probe().latest().irradiance({-1, 0, 0}).value.r);
  const Lighting room = observer.probe().latest_in_world();
  ASSERT_EQ(room.validity(), Validity::valid) << room.reason();
  EXPECT_GT(room.irradiance({-1, 0, 0}).value.r, 4 * room.irradiance({1, 0, 0}).value.r)
      << "the lamp is at the room's -X";
  Child tool(tool_command({"info", mounted.uri(), "--json"}));
  EXPECT_EQ(tool.wait(), (Ending{0, 0})) << tool.err();
  EXPECT_THAT(tool.out(), ::testing::HasSubstr("\"position_m\":[0.5,2.5,0]"));
}

TEST_F(LightTest, TheEstimatorCanBeChangedWhileItRuns) {
  Observer observer(daemon_.uri());
  EstimatorConfig config;
  config.band = 1;
  config.max_lights = 0;
  ASSERT_TRUE(observer.probe().set_estimator(config).ok());
  EXPECT_TRUE(comes_true("descriptors of band 1 without lights come", [&] {
    const Lighting light = observer.probe().latest();
    return light.validity() == Validity::valid && light.descriptor().radiance.band <= 1 && light.lights().empty();
  }));
}

TEST_F(LightTest, ALuxReadingMakesUnitsAbsolute) {
  Observer observer(daemon_.uri());
  ASSERT_TRUE(observer.gets(1));
  ASSERT_EQ(observer.probe().latest().units(), Units::relative);
  const Result<double> factor = observer.probe().report_lux(1000, {0, 1, 0});
  ASSERT_TRUE(factor.ok()) << factor.status().message();
  ASSERT_TRUE(
      comes_true("absolute descriptors come", [&] { return observer.probe().latest().units() == Units::absolute; }));
  EXPECT_NEAR(observer.probe().latest().irradiance({0, 1, 0}).value.luminance(), 1000, 5);
}

}  // namespace
}  // namespace lightwell::test
