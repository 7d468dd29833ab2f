// From a panorama at the daemon to its light in the SDK.
#include <atomic>
#include <thread>

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

TEST_F(LightTest, ALampAtPlusXGivesALightAtPlusX) {
  const Observer observer(daemon_.uri());
  ASSERT_TRUE(observer.gets(1));
  const std::optional<Light> lamp = observer.probe().latest().primary_light();
  ASSERT_TRUE(lamp);
  EXPECT_LT(angle_between(vec_cast<double>(lamp->direction), Vec3d{1, 0, 0}), 0.5 * kDegree);
  // Irradiance of a uniform disc at normal incidence: pi sin² rho L.
  const double exact = 3.14159265 * std::pow(std::sin(6 * kDegree), 2) * 400;
  EXPECT_NEAR(lamp->irradiance.r, exact, 0.05 * exact);
  EXPECT_NEAR(lamp->irradiance.g / lamp->irradiance.r, 0.95, 0.02);
  EXPECT_NEAR(lamp->angular_radius_rad, 6 * kDegree, 1 * kDegree);
}

TEST_F(LightTest, TheErrorOfIrradianceIsWithinTheBound) {
  const LightTruth truth(room_);
  const Observer observer(daemon_.uri());
  ASSERT_TRUE(observer.gets(1));
  const Lighting light = observer.probe().latest();
  const reference::IrradianceError error = truth.error_of(light);
  const double bound = static_cast<double>(light.descriptor().bound.total);
  EXPECT_LE(error.rms, bound);
  EXPECT_LE(error.luminance_weighted, bound);
  EXPECT_LE(error.rms, 0.02) << "the promise for the ideal sensor";
  EXPECT_LT(bound, 0.1) << "the bound must be tight enough to be useful";
}

TEST_F(LightTest, ReportsItsIdentity) {
  const Observer observer(daemon_.uri());
  const ProbeInfo info = observer.probe().info();
  EXPECT_EQ(info.name, "lightwell");
  EXPECT_EQ(info.id, fnv1a_32("lightwell"));
  EXPECT_THAT(info.camera, ::testing::StartsWith("sim:"));
  ASSERT_TRUE(observer.gets(1));
  EXPECT_EQ(observer.probe().latest().descriptor().calibration_id, info.calibration_id);
}

TEST_F(LightTest, WithAMountingLightIsAvailableInTheRoomsFrame) {
  // The mounting is a rotation by 180 degrees about the up axis.
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
  EXPECT_EQ(tool.wait(), (ExitStatus{0, 0})) << tool.err();
  EXPECT_THAT(tool.out(), ::testing::HasSubstr("\"position_m\":[0.5,2.5,0.0]"));
}

TEST_F(LightTest, TheEstimatorCanBeChangedWhileItRuns) {
  Observer observer(daemon_.uri());
  EstimatorConfig config;
  config.band = 1;
  config.max_lights = 0;
  ASSERT_TRUE(observer.probe().set_estimator(config).ok());
  EXPECT_TRUE(becomes_true("descriptors of band 1 without lights arrive", [&] {
    const Lighting light = observer.probe().latest();
    return light.validity() == Validity::valid && light.descriptor().radiance.band <= 1 && light.lights().empty();
  }));
}

TEST_F(LightTest, TwoClientsChangeDifferentFieldsAndBothHold) {
  Observer one(daemon_.uri()), other(daemon_.uri());
  const Result<EstimatorConfig> before = one.probe().estimator_config();
  ASSERT_TRUE(before.ok()) << before.status().message();
  EXPECT_EQ(*before, EstimatorConfig{});
  EXPECT_EQ(*one.probe().estimator_kind(), EstimatorKind::panorama);
  ASSERT_TRUE(one.probe().change_estimator({.panorama = {.unseen = UnseenFill::mirror}}).ok());

  constexpr int kChanges = 200;
  std::atomic<int> wrong{0};
  std::thread lights([&] {
    for (int i = 0; i < kChanges; ++i)
      if (!other.probe().change_estimator({.max_lights = i % 65}).ok() ||
          other.probe().estimator_config()->max_lights != i % 65)
        ++wrong;
  });
  for (int i = 0; i < kChanges; ++i)
    if (!one.probe().change_estimator({.panorama = {.epsilon = 0.001 * i}}).ok() ||
        one.probe().estimator_config()->panorama.epsilon != 0.001 * i)
      ++wrong;
  lights.join();
  EXPECT_EQ(wrong, 0) << "no other client changes these fields";

  EstimatorConfig expected;
  expected.max_lights = (kChanges - 1) % 65;
  expected.panorama.epsilon = 0.001 * (kChanges - 1);
  expected.panorama.unseen = UnseenFill::mirror;
  EXPECT_EQ(*one.probe().estimator_config(), expected);
  EXPECT_EQ(*other.probe().estimator_config(), expected);
}

TEST_F(LightTest, TheToolReadsTheConfigurationAndChangesAFieldOfIt) {
  const auto run = [&](std::vector<std::string> arguments) {
    Child tool(tool_command(std::move(arguments)));
    const ExitStatus status = tool.wait();
    EXPECT_EQ(status.signal, 0);
    return std::pair{status.code, tool.out() + tool.err()};
  };
  const std::string& uri = daemon_.uri();
  EXPECT_EQ(run({"config", "set", uri, "setting=fast", "panorama.epsilon=0.0123456789"}).first, 0);
  EXPECT_EQ(run({"config", "set", uri, "max_lights=3"}).first, 0);
  const auto [former, note] = run({"config", "set", uri, "panorama.unseen=none"});
  EXPECT_EQ(former, 0);
  EXPECT_THAT(note, ::testing::HasSubstr("is now called 'panorama.unseen_fill'"));
  EXPECT_EQ(
      run({"config", "get", uri, "--json"}),
      (std::pair{
          0, std::string("{\"estimator\":\"panorama\",\"band\":6,\"max_lights\":3,\"setting\":\"fast\","
                         "\"panorama.light_threshold\":6,\"panorama.epsilon\":0.0123456789,"
                         "\"panorama.radiance_epsilon\":0,\"panorama.unseen_fill\":\"none\","
                         "\"panorama.smoothing\":\"one_euro\",\"panorama.environment_edge\":0,"
                         "\"panorama.environment_rate\":5,\"panorama.interleave\":1,\"panorama.max_bytes\":0}\n")}));
  const auto [code, text] = run({"config", "get", uri});
  EXPECT_EQ(code, 0);
  EXPECT_THAT(text, ::testing::StartsWith("# estimator: panorama\nband=6\nmax_lights=3\n"));

  // If one of several fields is invalid, none is set; the probe rejects options of another estimator.
  const auto [refused, reason] = run({"config", "set", uri, "band=2", "marker.max_faces=3"});
  EXPECT_EQ(refused, 2) << reason;
  EXPECT_THAT(reason, ::testing::HasSubstr("marker.max_faces"));
  EXPECT_THAT(run({"config", "get", uri}).second, ::testing::HasSubstr("band=6\n"));
}

TEST_F(LightTest, ALuxReadingMakesUnitsAbsolute) {
  Observer observer(daemon_.uri());
  ASSERT_TRUE(observer.gets(1));
  ASSERT_EQ(observer.probe().latest().units(), Units::relative);
  const Result<double> factor = observer.probe().report_lux(1000, {0, 1, 0});
  ASSERT_TRUE(factor.ok()) << factor.status().message();
  ASSERT_TRUE(becomes_true("absolute descriptors arrive",
                           [&] { return observer.probe().latest().units() == Units::absolute; }));
  EXPECT_NEAR(observer.probe().latest().irradiance({0, 1, 0}).value.luminance(), 1000, 5);
}

}  // namespace
}  // namespace lightwell::test
