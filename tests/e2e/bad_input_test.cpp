// Invalid input causes a clear error and a non-zero exit status, or is replaced and reported once.
#include <cmath>
#include <filesystem>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "e2e/daemon.hpp"
#include "support/panorama_file.hpp"

namespace lightwell::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class BadInputTest : public ::testing::Test {
 protected:
  BadInputTest() { write_exr(folder_.path("room.exr"), room_with_lamp_at_plus_x()); }
  [[nodiscard]] std::string camera() const { return "sim:" + folder_.path("room.exr"); }

  /// Expects that the daemon exits with 1 and one error; returns its stderr.
  std::string refusal(const DaemonOptions& options) {
    Child child(daemon_command(options), options.child);
    EXPECT_EQ(child.wait(), (ExitStatus{1, 0})) << child.err();
    EXPECT_EQ(child.out(), "") << "no listening address may be printed";
    EXPECT_EQ(occurrences(child.err(), "error: "), 1U) << child.err();
    return child.err();
  }

  TempDir folder_;
};

TEST_F(BadInputTest, APortInUseIsNamedWithTheRemedy) {
  Daemon first({.camera = camera()});
  const std::string taken = first.uri().substr(std::string("grpc://").size());
  const std::string said = refusal({.camera = camera(), .listen = taken});
  EXPECT_THAT(said, AllOf(HasSubstr(taken), HasSubstr("in use"), HasSubstr("--listen")));
}

TEST_F(BadInputTest, AMalformedAddressIsNamed) {
  EXPECT_THAT(refusal({.camera = camera(), .listen = "attic"}), HasSubstr("'attic'"));
}

TEST_F(BadInputTest, AnUnknownFieldIsNamedWithFileLineAndTheNearest) {
  const std::string file = folder_.write("probe.textproto", "probe_name: \"attic\"\nestimator {\n  max_light: 4\n}\n");
  const std::string said = refusal({.camera = camera(), .more = {"--config", file}});
  EXPECT_THAT(said, AllOf(HasSubstr(file + ":3"), HasSubstr("max_light"), HasSubstr("'max_lights'")));
}

TEST_F(BadInputTest, AMissingConfigurationIsNamed) {
  EXPECT_THAT(refusal({.camera = camera(), .more = {"--config", "/no/such.textproto"}}),
              HasSubstr("/no/such.textproto"));
}

TEST_F(BadInputTest, AnImpossibleValueOfTheConfigurationIsNamed) {
  const std::string file = folder_.write("probe.textproto", "camera { uri: \"sim:city\" }\nestimator { band: 9 }\n");
  EXPECT_THAT(refusal({.more = {"--config", file}}), AllOf(HasSubstr(file), HasSubstr("estimator.band")));
}

TEST_F(BadInputTest, ABudgetForTheMarkerEstimatorIsRejected) {
  // The marker estimator has no cheaper setting, so a budget would have no effect.
  EXPECT_THAT(refusal({.camera = camera(), .more = {"--body", "any.textproto", "--budget-ms", "5"}}),
              AllOf(HasSubstr("budget_ms"), HasSubstr("marker"), HasSubstr("estimator.marker.decimation")));
}

TEST_F(BadInputTest, AGreyPatchOutsideThePictureIsNamed) {
  const std::string file =
      folder_.write("probe.textproto", "camera { uri: \"sim:city\" }\ngrey_patch { lens: 2 width: 8 height: 8 }\n");
  EXPECT_THAT(refusal({.more = {"--config", file}}), HasSubstr("grey_patch: lens must be 0 to 1"));
}

TEST_F(BadInputTest, AnInvalidMountingIsNamed) {
  const std::string file = folder_.write("room.textproto", "pose { tx: 1 }\n");
  EXPECT_THAT(refusal({.camera = camera(), .more = {"--mounting", file}}),
              AllOf(HasSubstr(file), HasSubstr("qx, qy, qz, qw")));
  EXPECT_THAT(refusal({.camera = camera(), .more = {"--mounting", "/no/such.textproto"}}),
              HasSubstr("/no/such.textproto"));
}

TEST_F(BadInputTest, AnImpossibleCalibrationIsNamedWithLensAndField) {
  const std::string file = folder_.write("rig.textproto",
                                         "lens { width: 160 height: 120 max_angle_deg: 95\n"
                                         "  kannala_brandt { fx: -40 fy: 40 cx: 79.5 cy: 59.5 } }\n");
  EXPECT_THAT(refusal({.camera = camera(), .more = {"--calibration", file}}),
              AllOf(HasSubstr(file), HasSubstr("lens 0"), HasSubstr("fx")));
}

TEST_F(BadInputTest, ANonMonotonicCalibrationIsRejected) {
  const std::string file = folder_.write("rig.textproto",
                                         "lens { width: 160 height: 120 max_angle_deg: 95\n"
                                         "  kannala_brandt { fx: 40 fy: 40 cx: 79.5 cy: 59.5 k1: -0.5 } }\n");
  EXPECT_THAT(refusal({.camera = camera(), .more = {"--calibration", file}}), HasSubstr("stops growing"));
}

TEST_F(BadInputTest, ACalibrationOfAnotherCameraIsRejectedWithBothSizes) {
  const std::string file = folder_.write("rig.textproto",
                                         "lens { width: 320 height: 240 max_angle_deg: 95\n"
                                         "  kannala_brandt { fx: 70 fy: 70 cx: 159.5 cy: 119.5 } }\n");
  EXPECT_THAT(refusal({.camera = camera(), .more = {"--calibration", file}}),
              AllOf(HasSubstr("1 x 320x240"), HasSubstr("2 x 160x120")));
}

TEST_F(BadInputTest, AMissingPanoramaIsNamed) {
  EXPECT_THAT(refusal({.camera = "sim:/no/such/room.exr"}), HasSubstr("/no/such/room.exr"));
}

TEST_F(BadInputTest, AMisspeltSceneNamesTheNearest) {
  EXPECT_THAT(refusal({.camera = "sim:forrest"}), HasSubstr("'forest'"));
}

TEST_F(BadInputTest, AnUnknownCameraNamesTheNearest) {
  EXPECT_THAT(refusal({.camera = "smi:city"}), HasSubstr("'sim'"));
}

TEST_F(BadInputTest, ATruncatedPanoramaIsNamed) {
  const std::string file = folder_.path("room.exr");
  for (const double share : {0.9, 0.5, 0.01}) {
    write_exr(file, room_with_lamp_at_plus_x());
    const auto whole = static_cast<double>(std::filesystem::file_size(file));
    std::filesystem::resize_file(file, static_cast<std::uintmax_t>(share * whole));
    EXPECT_THAT(refusal({.camera = camera()}), HasSubstr(file));
  }
}

TEST_F(BadInputTest, AnInvalidRecordingIsNamed) {
  const std::string file = folder_.write("frames.lwrec", "no recording at all");
  EXPECT_THAT(refusal({.camera = "replay:" + file}), HasSubstr(file));
}

TEST_F(BadInputTest, ARecordingThatCannotBeWrittenIsNamed) {
  EXPECT_THAT(refusal({.camera = camera(), .more = {"--record", "/no/such/folder/x.lwrec"}}),
              HasSubstr("/no/such/folder/x.lwrec"));
}

TEST_F(BadInputTest, WrongUsageIsExitTwo) {
  for (const std::vector<std::string>& wrong : std::vector<std::vector<std::string>>{
           {"--sise", "160x120"}, {"--size", "large"}, {"--size", "8x8"}, {"--name", ""}}) {
    DaemonOptions options{.camera = camera(), .more = wrong};
    if (wrong.front() == "--name") options.camera = "";
    Child child(daemon_command(options));
    EXPECT_EQ(child.wait(), (ExitStatus{2, 0})) << wrong.front() << " " << wrong.back();
  }
}

TEST_F(BadInputTest, InvalidRadiancesAreReplacedCountedAndReportedOnce) {
  PanoramaPixels room = room_with_lamp_at_plus_x();
  const float inf = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < 5; ++i) room.rgb[i] = std::nanf("");
  for (std::size_t i = 600; i < 607; ++i) room.rgb[i] = -3;
  for (std::size_t i = 900; i < 902; ++i) room.rgb[i] = inf;
  write_exr(folder_.path("room.exr"), room);
  Daemon daemon({.camera = camera()});
  const Observer observer(daemon.uri());
  ASSERT_TRUE(observer.gets(40)) << "long enough for a second report";
  EXPECT_EQ(daemon.stop(), (ExitStatus{0, 0}));
  const std::string said = daemon.process().err();
  EXPECT_EQ(occurrences(said, "replaced 5 NaN, 2 infinite, 7 negative values"), 1U) << said;
  EXPECT_EQ(occurrences(said, "NaN"), 1U) << said;
  for (const Descriptor& d : observer.descriptors())
    ASSERT_TRUE(std::isfinite(d.radiance.c[0].g) && std::isfinite(d.bound.total));
}

TEST_F(BadInputTest, AValidPanoramaIsNotReported) {
  Daemon daemon({.camera = camera()});
  (void)daemon.uri();
  EXPECT_THAT(daemon.process().err(), Not(HasSubstr("replaced")));
}

TEST_F(BadInputTest, CheckReportsSuccessWithoutRunning) {
  Child child(daemon_command({.camera = camera(), .more = {"--check"}}));
  EXPECT_EQ(child.wait(), (ExitStatus{0, 0})) << child.err();
  EXPECT_THAT(child.out(), HasSubstr("all is well"));
}

}  // namespace
}  // namespace lightwell::test
