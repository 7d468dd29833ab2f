// From images of a marker at the daemon to the light of its lamp in the SDK.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <lightwell/geometry.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/marker_body.hpp>

#include "calibration/model/camera_model.hpp"
#include "e2e/daemon.hpp"
#include "e2e/light_truth.hpp"
#include "imaging/image_file.hpp"
#include "measure/traced_frames.hpp"

namespace lightwell::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

const std::string kBody = std::string(LIGHTWELL_MARKER_BODIES) + "/dodecahedron_100mm_white.textproto";

/// Path-traced images (an independent renderer) as noisy frames of a webcam.
class MarkerTest : public ::testing::Test {
 protected:
  void SetUp() override { take("grid_straight_white_front_right"); }

  /// Selects the image of the following frames.
  void take(const std::string& name) {
    const auto frames = measure::load_traced_frames(LIGHTWELL_MARKER_FRAMES);
    ASSERT_TRUE(frames.ok()) << frames.status().message();
    const auto frame = std::ranges::find(*frames, name, &measure::TracedFrame::name);
    ASSERT_NE(frame, frames->end()) << name;
    frame_ = *frame;
    const auto body = load_marker_body(kBody);
    ASSERT_TRUE(body.ok()) << body.status().message();
    name_ = body->name;
    const auto picture = measure::TracedPicture::load(LIGHTWELL_MARKER_FRAMES, frame_, *body);
    ASSERT_TRUE(picture.ok()) << picture.status().message();
    measure::TracedSensor webcam;
    webcam.srgb = true;
    seen_.clear();
    for (std::uint64_t number = 0; number < 3; ++number) {
      measure::Shot shot = picture->expose(webcam, number);
      exposure_s_ = shot.frames.front().info.exposure_s;
      seen_.push_back(std::move(shot.pixels.front()));
    }
    calibration_ = folder_.write("webcam.textproto", calibration_to_text(picture->rig_for(webcam)));
  }

  using Pixels = std::vector<std::byte>;

  [[nodiscard]] std::string write_picture(const std::string& name, const Pixels& pixels) const {
    const LensParameters& lens = frame_.rig.lenses.front();
    const Status s = write_png(folder_.path(name), {lens.width, lens.height, PixelFormat::rgb8, pixels});
    EXPECT_TRUE(s.ok()) << s.message();
    return folder_.path(name);
  }

  /// Covers the body by a disc of one colour; its shadow stays visible.
  [[nodiscard]] Pixels covered(Pixels pixels) const {
    const LensParameters& lens = frame_.rig.lenses.front();
    const Pose lens_body = compose(inverse(lens.pose_cv), frame_.probe_body);
    const auto center = CameraModel(lens).project(lens_body.translation);
    EXPECT_TRUE(center);
    // The body's corners are 63 mm from its centre.
    const double radius = 0.07 * std::get<MeiParameters>(lens.model).fx / length(frame_.probe_body.translation);
    for (int y = 0; y < lens.height; ++y)
      for (int x = 0; x < lens.width; ++x)
        if (std::hypot(x - center->x, y - center->y) < radius)
          std::fill_n(pixels.begin() + 3 * (static_cast<std::ptrdiff_t>(y) * lens.width + x), 3, std::byte{120});
    return pixels;
  }

  /// A replay camera that shows these images in a loop.
  [[nodiscard]] std::string camera(std::span<const Pixels> pictures) const {
    std::string list = "file,exposure_s,time_s\n";
    for (std::size_t i = 0; i < pictures.size(); ++i) {
      const std::string name = std::to_string(i) + ".png";
      (void)write_picture(name, pictures[i]);
      list += name + "," + std::to_string(exposure_s_) + "," + std::to_string(static_cast<double>(i) * 0.1) + "\n";
    }
    (void)folder_.write("frames.csv", list);
    return "replay:" + folder_.path("") + "?loop=0";
  }

  [[nodiscard]] DaemonOptions options(std::span<const Pixels> pictures,
                                      std::vector<std::string> more = {"--estimator", "marker", "--body",
                                                                       kBody}) const {
    more.insert(more.end(), {"--calibration", calibration_});
    return {.camera = camera(pictures), .more = std::move(more)};
  }

  /// Expects that the daemon does not start and exits with `code`; returns its stderr.
  std::string refusal(const std::vector<std::string>& more, int code) {
    Child child(daemon_command(options(std::span(seen_).first(1), more)));
    EXPECT_EQ(child.wait(), (ExitStatus{code, 0})) << child.err();
    EXPECT_EQ(child.out(), "") << "no listening address may be printed";
    EXPECT_EQ(occurrences(child.err(), "error: "), 1U) << child.err();
    return child.err();
  }

  TempDir folder_;
  measure::TracedFrame frame_;
  std::string name_, calibration_;
  double exposure_s_ = 0;
  std::vector<Pixels> seen_;
};

TEST_F(MarkerTest, TheLampThatLightsItIsTheStrongestLight) {
  Daemon daemon(options(seen_));
  const Observer observer(daemon.uri());
  ASSERT_TRUE(observer.gets(4)) << daemon.process().err();
  const Lighting light = observer.probe().latest();
  ASSERT_EQ(light.validity(), Validity::valid);
  const std::optional<Light> lamp = light.primary_light();
  ASSERT_TRUE(lamp);
  EXPECT_LT(angle_between(vec_cast<double>(lamp->direction), frame_.lamps.front().direction), 3 * kDegree);
  EXPECT_TRUE(light.descriptor().flags.has(Flag::unseen)) << "half of the body is never seen";
  EXPECT_FALSE(light.descriptor().flags.has(Flag::unsure));
  EXPECT_TRUE(std::isinf(light.descriptor().bound.total)) << "no finite bound holds for unobserved directions";
  EXPECT_EQ(daemon.stop(), (ExitStatus{0, 0})) << daemon.process().err();
  EXPECT_THAT(daemon.process().err(), HasSubstr("looking for " + name_));
}

TEST_F(MarkerTest, ANearLampHasAPositionInTheFrameAskedFor) {
  take("near_turned_white_front_right");
  Daemon daemon(options(seen_));
  const Observer observer(daemon.uri());
  ASSERT_TRUE(observer.gets(1)) << daemon.process().err();
  const Lighting light = observer.probe().latest();
  ASSERT_EQ(light.validity(), Validity::valid);
  const std::optional<Light> lamp = light.primary_light();
  ASSERT_TRUE(lamp);
  const measure::TracedLamp& truth = frame_.lamps.front();
  ASSERT_GT(lamp->distance_m, 0);
  // Three sigma of one frame; the error of the marker's pose (below) is not part of it.
  EXPECT_NEAR(lamp->distance_m, truth.distance_m, 3 * lamp->distance_sigma_m);
  EXPECT_LT(lamp->distance_sigma_m, 0.1 * truth.distance_m);
  constexpr double kMaxPoseError_m = 0.005;
  EXPECT_LT(length(light.origin().translation - frame_.probe_body.translation), kMaxPoseError_m);
  const auto& c = lamp->direction_covariance;
  const double limit =
      3 * std::hypot(lamp->distance_sigma_m, std::sqrt(c[0] + c[2]) * truth.distance_m) + kMaxPoseError_m;
  const std::optional<Vec3d> position = light.position(*lamp);
  ASSERT_TRUE(position);
  EXPECT_LT(length(*position - truth.position), limit);

  const Pose T_world_probe{Quat::about({0, 1, 0}, 1.2), {3, 1, -2}};
  const Lighting world = light.in_world(T_world_probe);
  const std::optional<Vec3d> in_world = world.position(world.lights()[0]);
  ASSERT_TRUE(in_world);
  EXPECT_LT(length(*in_world - transformed(T_world_probe, truth.position)), limit);
}

TEST_F(MarkerTest, IrradianceAgreesWithTheTruthWhereNormalsFaceTheCamera) {
  Daemon daemon(options(seen_));
  const Observer observer(daemon.uri());
  ASSERT_TRUE(observer.gets(1)) << daemon.process().err();
  const Lighting light = observer.probe().latest();
  const Vec3d to_camera = normalized(frame_.probe_body.translation * -1.0);
  std::vector<Vec3d> normals;
  for (int i = 0; i < 500; ++i)
    if (const Vec3d n = fibonacci_direction(i, 500); dot(n, to_camera) >= 0.5) normals.push_back(n);
  const auto truth = measure::true_irradiance(frame_, normals);
  double squares = 0, errors = 0;
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const double expected = truth[i][1], answer = light.irradiance(vec_cast<float>(normals[i])).value.g;
    squares += expected * expected, errors += (answer - expected) * (answer - expected);
  }
  ASSERT_GT(squares, 0);
  EXPECT_LT(std::sqrt(errors / squares), 0.1);
}

TEST_F(MarkerTest, AnUnobservableLampBehindTheBodyIsFlagged) {
  take("air_turned_white_behind");
  Daemon daemon(options(seen_));
  const Observer observer(daemon.uri());
  ASSERT_TRUE(observer.gets(1)) << daemon.process().err();
  const Lighting light = observer.probe().latest();
  ASSERT_EQ(light.validity(), Validity::valid);
  EXPECT_TRUE(light.descriptor().flags.has(Flag::unsure)) << "no visible face is lit, and there is no table";
  EXPECT_FALSE(light.descriptor().flags.has(Flag::newer));
}

TEST_F(MarkerTest, ACoveredBodyGivesNoDescriptor) {
  Daemon daemon(options(std::vector<Pixels>{seen_[0], covered(seen_[1])}));
  const Observer observer(daemon.uri());
  ASSERT_TRUE(observer.gets(4)) << daemon.process().err();
  // The covered body is in the second image of the loop.
  for (const Descriptor& d : observer.descriptors()) EXPECT_EQ(d.sequence % 2, 0U);
  EXPECT_TRUE(
      becomes_true("the frames without a body are counted", [&] { return observer.counters().estimates_failed > 0; }));
}

TEST_F(MarkerTest, WithoutItsBodyThereIsNoLightAndTheReasonIsLoggedOnce) {
  Daemon daemon(options(std::vector<Pixels>{covered(seen_[0])}));
  const Observer observer(daemon.uri());
  ASSERT_TRUE(becomes_true("failures are counted", [&] { return observer.counters().estimates_failed >= 10; }))
      << daemon.process().err();
  EXPECT_EQ(observer.counters().estimates, 0U);
  EXPECT_EQ(observer.count(), 0U);
  EXPECT_EQ(observer.probe().latest().validity(), Validity::none);
  EXPECT_TRUE(becomes_true("the log says why", [&] {
    return occurrences(daemon.process().err(), "no pose of the body '" + name_ + "'") > 0;
  })) << daemon.process().err();
  EXPECT_EQ(daemon.stop(), (ExitStatus{0, 0}));
  EXPECT_EQ(occurrences(daemon.process().err(), "no pose of the body"), 1U) << daemon.process().err();
}

TEST_F(MarkerTest, ABodyPathIsRelativeToTheConfigurationFile) {
  std::filesystem::copy_file(kBody, folder_.path("body.textproto"));
  const std::string file = folder_.write("probe.textproto", "marker { body_file: \"body.textproto\" }\n");
  Daemon daemon(options(seen_, {"--config", file}));
  const Observer observer(daemon.uri());
  EXPECT_TRUE(observer.gets(1)) << daemon.process().err();
}

TEST_F(MarkerTest, CheckReadsTheBodyWithoutRunning) {
  DaemonOptions checked = options(seen_);
  checked.more.push_back("--check");
  Child child(daemon_command(checked));
  EXPECT_EQ(child.wait(), (ExitStatus{0, 0})) << child.err();
  EXPECT_THAT(child.out(), HasSubstr("all is well"));
}

TEST_F(MarkerTest, TheErrorForAMissingBodySaysHowToGetOne) {
  EXPECT_THAT(refusal({"--estimator", "marker"}, 2),
              AllOf(HasSubstr("--body"), HasSubstr("lightwell-calibrate marker-sheet")));
}

TEST_F(MarkerTest, AnUnreadableBodyFileIsNamed) {
  EXPECT_THAT(refusal({"--body", "/no/such/body.textproto"}, 1), HasSubstr("/no/such/body.textproto"));
}

TEST_F(MarkerTest, AnUnknownFieldOfABodyIsNamedWithFileLineAndTheNearest) {
  const std::string file =
      folder_.write("body.textproto", "name: \"mine\"\ntag_family: \"tag36h11\"\ntag_size: 0.024\n");
  EXPECT_THAT(refusal({"--body", file}, 1),
              AllOf(HasSubstr(file + ":3"), HasSubstr("tag_size"), HasSubstr("'tag_size_m'")));
}

TEST_F(MarkerTest, AGreyPatchTogetherWithAMarkerIsRejected) {
  const std::string file = folder_.write("probe.textproto", "grey_patch { width: 8 height: 8 }\n");
  EXPECT_THAT(refusal({"--config", file, "--body", kBody}, 2), AllOf(HasSubstr("grey_patch"), HasSubstr("marker")));
}

/// Waits for a run of lightwell-estimate and checks its exit code.
Child& run(Child& tool, int code) {
  EXPECT_EQ(tool.wait(), (ExitStatus{code, 0})) << tool.err();
  return tool;
}

TEST_F(MarkerTest, TheToolEstimatesTheLightFromOneImage) {
  Child tool({LIGHTWELL_ESTIMATE, "--calibration", calibration_, "--body", kBody, "--exposure-s",
              std::to_string(exposure_s_), write_picture("picture.png", seen_[0]), "--json", "-"});
  google::protobuf::Struct answer;
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(run(tool, 0).out(), &answer).ok()) << tool.out();
  const auto& fields = answer.fields();
  ASSERT_TRUE(fields.contains("lights") && fields.contains("flags")) << tool.out();
  const auto& lights = fields.at("lights").list_value().values();
  ASSERT_FALSE(lights.empty()) << tool.out();
  const auto& direction = lights[0].struct_value().fields().at("direction").list_value().values();
  ASSERT_EQ(direction.size(), 3) << tool.out();
  const Vec3d towards{direction[0].number_value(), direction[1].number_value(), direction[2].number_value()};
  EXPECT_LT(angle_between(normalized(towards), frame_.lamps.front().direction), 3 * kDegree);
  EXPECT_THAT(tool.out(), AllOf(HasSubstr("FLAG_UNSEEN"), Not(HasSubstr("FLAG_UNSURE"))));
}

TEST_F(MarkerTest, TheToolReportsAnImageWithoutABody) {
  const std::string picture = write_picture("picture.png", covered(seen_[0]));
  Child tool({LIGHTWELL_ESTIMATE, "--calibration", calibration_, "--body", kBody, picture, "--json", "-"});
  EXPECT_THAT(run(tool, 1).err(), HasSubstr("no pose of the body '" + name_ + "'"));
  EXPECT_EQ(tool.out(), "");
}

TEST_F(MarkerTest, TheToolNeedsACalibrationForABody) {
  Child tool({LIGHTWELL_ESTIMATE, "--equirect", "room.exr", "--body", kBody, "--json", "-"});
  EXPECT_THAT(run(tool, 2).err(), HasSubstr("--body needs --calibration"));
}

}  // namespace
}  // namespace lightwell::test
