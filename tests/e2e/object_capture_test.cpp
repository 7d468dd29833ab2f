// From photographs of a turntable with a marker on it to the description of the capture: lightwell-estimate for each
// photograph, then lightwell-object describe.
#include <cmath>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <lightwell/calibration.hpp>
#include <lightwell/marker_body.hpp>

#include "imaging/image_file.hpp"
#include "reference/marker/marker_exposure.hpp"
#include "reference/marker/marker_picture.hpp"
#include "reference/marker/marker_scene.hpp"
#include "support/child.hpp"
#include "support/temp_dir.hpp"

namespace lightwell::test {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180;
const std::string kBody = LIGHTWELL_MARKER_BODIES "/dodecahedron_100mm_grey.textproto";

/// The axis of the turntable is 0.9 m before the camera, which is level; the marker stands 0.12 m off it.
constexpr int kColumns = 640, kRows = 480;
constexpr double kFocalPx = 800, kDistance = 0.9;
const Vec3d kMarker{0.1, 0, 0.066};
const std::vector<double> kTurns{0, 35 * kDegree, 100 * kDegree};
/// From the middle of the turntable, in the frame of the rig.
const std::vector<Vec3d> kLamps{{0.9, 0.7, 0.6}, {-0.8, 0.5, 0.9}, {0.1, 1.1, 0.8}};

class ObjectCapture : public ::testing::Test {
 protected:
  [[nodiscard]] std::string estimate(std::size_t view, std::size_t light) const {
    return folder_.path("v" + std::to_string(view) + "_l" + std::to_string(light) + ".json");
  }

  void photograph() {
    const auto body = load_marker_body(kBody);
    ASSERT_TRUE(body.ok()) << body.status().message();
    const LensParameters lens = reference::pinhole_lens(kColumns, kRows, kFocalPx);
    RigParameters rig{{lens}};
    rig.lenses[0].photometry.response.kind = ResponseCurve::Kind::srgb;
    const std::string calibration = folder_.write("camera.textproto", calibration_to_text(rig));
    const reference::MarkerCamera camera(lens);
    const Vec3d middle{0, 0, -kDistance};
    for (std::size_t v = 0; v < kTurns.size(); ++v)
      for (std::size_t l = 0; l < kLamps.size(); ++l) {
        reference::MarkerScene scene;
        scene.body = *body;
        const Quat turn = Quat::about({0, 1, 0}, kTurns[v]);
        scene.probe_body = {turn * Quat::about({0, 1, 0}, 0.4), middle + rotate(turn, kMarker)};
        scene.lamps = {reference::NearLamp{middle + kLamps[l], {1, 1, 1}, 0.02}};
        scene.ambient.sh[0] = {0.1, 0.1, 0.1};
        reference::ExposureOptions exposure;
        exposure.full_scale = 0.4;
        exposure.srgb = true;
        const auto exposed = reference::expose(reference::render(scene, camera, {}), exposure);
        Image image;
        image.width = kColumns;
        image.height = kRows;
        for (const std::uint8_t code : exposed.rgb) image.data.push_back(std::byte{code});
        const std::string picture = folder_.path("v" + std::to_string(v) + "_l" + std::to_string(l) + ".png");
        ASSERT_TRUE(write_png(picture, image).ok());
        Child tool(
            {LIGHTWELL_ESTIMATE, "--calibration", calibration, "--body", kBody, picture, "--json", estimate(v, l)});
        ASSERT_EQ(tool.wait(), (ExitStatus{0, 0})) << tool.err();
      }
  }

  [[nodiscard]] std::vector<std::string> describe() const {
    return {LIGHTWELL_OBJECT,       "describe",    folder_.path(""),         "--pictures",
            "v{view}_l{light}.png", "--estimates", "v{view}_l{light}.json",  "--coverage",
            "mask{view}.png",       "--focal-px",  std::to_string(kFocalPx), "--json"};
  }

  TempDir folder_;
};

TEST_F(ObjectCapture, IsDescribedFromAMarkerInThePhotographs) {
  photograph();
  std::filesystem::remove(estimate(1, 2));  // As if the marker had not been found.
  Child tool(describe());
  ASSERT_EQ(tool.wait(), (ExitStatus{0, 0})) << tool.err();
  const json said = json::parse(tool.out());
  EXPECT_EQ(said.at("photographs"), 9);
  EXPECT_EQ(said.at("without_marker"), 1);
  EXPECT_LT(said.at("tilt_deg"), 0.5);

  std::ifstream file(folder_.path("object.json"));
  const json object = json::parse(file);
  EXPECT_EQ(object.at("pictures"), "v{view}_l{light}.png");
  // The README's figures, about twice what is measured. A light's direction in one view is within some 3 degrees, but
  // the rays of three views meet closer to it.
  for (std::size_t v = 0; v < kTurns.size(); ++v)
    EXPECT_NEAR(object.at("turns_deg")[v].get<double>() * kDegree, kTurns[v], 0.3 * kDegree);
  EXPECT_NEAR(object.at("camera_distance_m").get<double>(), kDistance, 0.01 * kDistance);
  EXPECT_NEAR(object.at("half_width_m").get<double>(), kDistance * kColumns / 2 / kFocalPx, 0.01);
  for (std::size_t l = 0; l < kLamps.size(); ++l) {
    const auto p = object.at("light_positions_m")[l].get<std::vector<double>>();
    EXPECT_LT(angle_between(Vec3d{p[0], p[1], p[2]}, kLamps[l]), 0.6 * kDegree);
  }

  Child again(describe());
  EXPECT_EQ(again.wait(), (ExitStatus{4, 0}));
  EXPECT_THAT(again.err(), HasSubstr("remove it to have it written anew"));
}

TEST_F(ObjectCapture, NamesThePictureOrTheEstimateThatIsMissingOrWrong) {
  Child nothing(describe());
  EXPECT_EQ(nothing.wait(), (ExitStatus{4, 0}));
  EXPECT_THAT(nothing.err(), HasSubstr("v0_l0.png does not exist"));
  folder_.write("v0_l0.png", "");
  folder_.write("v0_l0.json", "{\"wireVersion\": 1, \"lights\": 7}");
  Child wrong(describe());
  EXPECT_EQ(wrong.wait(), (ExitStatus{4, 0}));
  EXPECT_THAT(wrong.err(), HasSubstr("v0_l0.json"));
}

}  // namespace
}  // namespace lightwell::test
