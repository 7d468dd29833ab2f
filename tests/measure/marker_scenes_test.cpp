#include "measure/marker_scenes.hpp"

#include <cmath>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "calibration/model/camera_model.hpp"
#include "measure/direction_error.hpp"
#include "support/temp_dir.hpp"

namespace lightwell::measure {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

// Two normals; one lamp behind the body, a shadow of 30 % of the body's square on a plain table.
const std::string kHead = R"({"normals":[[0,0,2],[0,0.6,0.8]]})";
const std::string kScene = R"({"name":"dev/0003","body":"cube_60mm_grey","size_px":100,"defect":"","frame":0,)"
                           R"("width":200,"height":150,"focal_px":800,"center_px":[120.5,60.25],)"
                           R"("T_camera_body":{"q_xyzw":[0,0,0,1],"t_m":[0,0,-1]},"shot_noise":1e-4,)"
                           R"("read_noise":0.002,"vignetting":[-0.1,0,0],"gain_rgb":[0.5,1,2],)"
                           R"("lamps":[{"direction":[0,0.6,-0.8],"azimuth_deg":170}],)"
                           R"("irradiance_rgb":[[2,3,4],[1,1,1]],)"
                           R"("faces":[{"cosine":0.9,"strongest_share":0.7},{"cosine":0.1,"strongest_share":0.9},)"
                           R"({"cosine":0.5,"strongest_share":0.5}],)"
                           R"("shadow_px":3000,"shadow_depth":0.5,"table":{"kind":"wood","contrast":0.05}})";

std::string with(const std::string& what, const std::string& instead) {
  std::string text = kScene;
  const auto at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), instead);
}

Result<std::vector<MarkerScene>> loaded(const std::string& lines) {
  const test::TempDir folder;
  folder.write("dev.jsonl", lines);
  return load_marker_scenes(folder.path(""), "dev");
}

MarkerScene scene(const std::string& line = kScene) {
  auto scenes = loaded(kHead + "\n" + line + "\n");
  EXPECT_TRUE(scenes) << scenes.status().message();
  return scenes ? scenes->at(0) : MarkerScene{};
}

TEST(MarkerScenes, HaveTheRigAndTheTruthInTheUnitsOfThePicture) {
  const MarkerScene s = scene();
  EXPECT_EQ(s.name, "dev/0003");
  EXPECT_EQ(s.body, "cube_60mm_grey");
  EXPECT_EQ(s.table, "wood");
  const LensParameters& lens = s.rig.lenses.at(0);
  EXPECT_EQ(lens.photometry.response.kind, ResponseCurve::Kind::srgb);
  EXPECT_EQ(lens.photometry.vignetting[0], -0.1);
  // A point 0.1 m to the right and 0.05 m above, 1 m away: 80 px to the right and 40 px up.
  const auto pixel = CameraModel(lens).project(transformed(inverse(lens.pose_cv), {0.1, 0.05, -1}));
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x, 200.5, 1e-9);
  EXPECT_NEAR(pixel->y, 20.25, 1e-9);
  ASSERT_EQ(s.normals.size(), 2U);
  EXPECT_NEAR(length(s.normals[0]), 1, 1e-12);
  EXPECT_EQ(s.irradiance[0], (std::array<double, 3>{1, 3, 8}));
}

TEST(MarkerScenes, FramesOfASequenceReportTheirExposure) {
  std::string brighter = with(R"("frame":0)", R"("frame":1)");
  brighter.replace(brighter.find("[0.5,1,2]"), 9, "[1,2,4]");
  const auto scenes = loaded(kHead + "\n" + kScene + "\n" + brighter + "\n" + kScene + "\n");
  ASSERT_TRUE(scenes) << scenes.status().message();
  EXPECT_EQ(scenes->at(0).exposure_s, 1);
  EXPECT_EQ(scenes->at(1).exposure_s, 2);
  EXPECT_EQ(scenes->at(1).irradiance, scenes->at(0).irradiance) << "the same light";
  EXPECT_EQ(scenes->at(2).exposure_s, 1) << "another sequence";
}

TEST(MarkerScenes, ClassesFollowFacesLampShadowAndTable) {
  EXPECT_EQ(scene().scene_class, SceneClass::shadow_behind);
  // A second face that is not seen at a grazing angle.
  EXPECT_EQ(scene(with(R"("cosine":0.1)", R"("cosine":0.3)")).scene_class, SceneClass::lit_faces);
  EXPECT_EQ(scene(with(R"("azimuth_deg":170)", R"("azimuth_deg":-80)")).scene_class, SceneClass::other);
  EXPECT_EQ(scene(with(R"("shadow_px":3000)", R"("shadow_px":900)")).scene_class, SceneClass::other);
  EXPECT_EQ(scene(with(R"("shadow_depth":0.5)", R"("shadow_depth":0.1)")).scene_class, SceneClass::other);
  EXPECT_EQ(scene(with(R"("contrast":0.05)", R"("contrast":0.15)")).scene_class, SceneClass::other);
}

TEST(MarkerScenes, ADamagedLineIsNamed) {
  for (const std::string& line : {with(R"("gain_rgb")", R"("gain")"), kScene.substr(0, 100),
                                  with("[[2,3,4],[1,1,1]]", "[[2,3,4]]"), with(R"("width":200)", R"("width":0)")}) {
    const Status s = loaded(kHead + "\n" + kScene + "\n" + line + "\n").status();
    EXPECT_EQ(s.code(), StatusCode::data_loss);
    EXPECT_NE(s.message().find("line 3"), std::string::npos) << s.message();
  }
  const test::TempDir folder;
  EXPECT_EQ(load_marker_scenes(folder.path(""), "dev").status().code(), StatusCode::not_found);
}

TEST(DirectionError, IsMeasuredAlongTheAxesOfTheCovariance) {
  const Vec3d estimate = normalized(Vec3d{0.3, -0.5, 0.8});
  const auto [u, v] = tangent_basis(estimate);
  // Three degrees along u, four along v: standard deviations of 1 and 2 degrees there.
  const Vec3d off = normalized(u * 3 + v * 4);
  const Vec3d truth = estimate * std::cos(5 * kDegree) + off * std::sin(5 * kDegree);
  const DirectionError e = direction_error(estimate, {1 * kDegree * kDegree, 0, 4 * kDegree * kDegree}, truth);
  EXPECT_NEAR(e.angle_rad, 5 * kDegree, 1e-9);
  EXPECT_NEAR(e.mahalanobis2, 9.0 / 1 + 16.0 / 4, 1e-6);
  EXPECT_NEAR(e.sigma_rad, kDegree * std::sqrt(0.36 * 1 + 0.64 * 4), 1e-9);
  EXPECT_EQ(direction_error(estimate, {1, 0, 1}, estimate).mahalanobis2, 0);
}

Light light_towards(Vec3d direction, float irradiance) {
  Light light;
  light.direction = vec_cast<float>(normalized(direction));
  light.irradiance = {irradiance, irradiance, irradiance};
  light.direction_covariance = {1e-4F, 0, 1e-4F};
  return light;
}

TEST(Score, ComparesTheStrongestLampWithAsManyLightsAsThereAreLamps) {
  MarkerScene s = scene();
  const Vec3d truth{0, 0.6, -0.8}, other{1, 0, 0};
  Descriptor d;
  d.lights = {light_towards(other, 2), light_towards(truth, 1)};
  EXPECT_NEAR(score(s, d).error_deg, 90, 1e-3);
  s.lamps.push_back({other, 90});
  EXPECT_NEAR(score(s, d).error_deg, 0, 0.05);
  EXPECT_NEAR(score(s, d).primary_error_deg, 90, 1e-3);
  EXPECT_TRUE(score(s, d).light);
  EXPECT_FALSE(score(s, d).unsure);
  d.flags.set(Flag::unsure);
  EXPECT_TRUE(score(s, d).unsure);
}

TEST(Score, IrradianceIsComparedOverNormalsAndChannels) {
  MarkerScene s = scene();
  s.normals = {{0, 0, 1}, {0, 1, 0}};
  s.irradiance = {{2, 2, 2}, {1, 1, 1}};
  Descriptor d;
  // A distant light along +Z gives 2 at the first normal, none at the second.
  d.lights = {light_towards({0, 0, 1}, 2)};
  EXPECT_NEAR(score(s, d).irradiance_rms, std::sqrt(3.0 / 15.0), 1e-5);
  s.irradiance[1] = {0, 0, 0};
  EXPECT_NEAR(score(s, d).irradiance_rms, 0, 1e-5);
}

TEST(Score, WithoutAnAnswerNothingIsSet) {
  const SceneScore none = score(scene(), std::nullopt);
  EXPECT_FALSE(none.answered);
  EXPECT_TRUE(none.unsure);
  EXPECT_FALSE(none.light);
  const SceneScore dark = score(scene(), Descriptor{});
  EXPECT_TRUE(dark.answered);
  EXPECT_FALSE(dark.light);
}

}  // namespace
}  // namespace lightwell::measure
