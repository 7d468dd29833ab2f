// The peer on pictures of the reference renderer: a cube of 60 mm on a plain table with a sharp shadow, its exact pose.
#include "bench/arief2012.hpp"

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "reference/marker/marker_exposure.hpp"
#include "reference/marker/marker_picture.hpp"
#include "reference/marker/test_bodies.hpp"

namespace lightwell::bench {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr int kBottom = 5;  ///< The cube's face on the table.

/// The camera is 0.5 m away, 35 degrees above the table: the cube is about 100 px wide. It is above the picture's
/// centre, so that shadows towards the camera end in the picture.
struct Stage {
  reference::MarkerScene scene;
  LensParameters lens = reference::pinhole_lens(480, 360, 600);

  Stage() {
    scene.body = reference::cube_by_hand();
    // The body is turned about its vertical axis, so that three of its faces are seen.
    scene.probe_body = {(Quat::about({1, 0, 0}, 35 * kDegree) * Quat::about({0, 1, 0}, 0.4)).normalized(),
                        {0, 0.03, -0.5}};
    scene.table = reference::table_under(scene.body, scene.probe_body, kBottom, {0.3, 0.3, 0.3});
    scene.ambient = reference::even_ambient({0.03, 0.03, 0.03});
  }
  /// `azimuth_deg`: 0 towards the camera, 90 to its right.
  [[nodiscard]] Vec3d towards(double azimuth_deg, double elevation_deg) const {
    const double a = azimuth_deg * kDegree, e = elevation_deg * kDegree;
    return rotate(Quat::about({1, 0, 0}, 35 * kDegree),
                  Vec3d{std::cos(e) * std::sin(a), std::sin(e), std::cos(e) * std::cos(a)});
  }
  [[nodiscard]] std::optional<AriefView> view(const AriefOptions& options = {}) const {
    const auto picture = reference::expose_grey(
        reference::render(scene, reference::MarkerCamera(lens), {.edge_rays = 13}), {.full_scale = 0.7});
    return AriefView::make(picture.view(), CameraModel(lens), scene.body,
                           compose(inverse(lens.pose_cv), scene.probe_body), options);
  }
  [[nodiscard]] Vec3d in_probe(Vec3d direction_cv) const { return rotate(lens.pose_cv.rotation, direction_cv); }
};

TEST(Arief, FindsALampWhoseShadowIsInView) {
  // Lamps beside and behind the body, which does not hide their shadows. It stands on a face with or without a tag.
  for (const double azimuth : {80.0, 150.0, 180.0, 230.0})
    for (const double elevation : {25.0, 40.0, 60.0}) {
      Stage stage;
      if (azimuth > 100) stage.scene.body.faces.pop_back();
      const Vec3d truth = stage.towards(azimuth, elevation);
      stage.scene.lamps = {reference::DistantLamp{truth, {1, 1, 1}, 0}};
      const auto view = stage.view();
      ASSERT_TRUE(view);
      const AriefLight light = view->light(0.5);
      ASSERT_TRUE(light.known) << azimuth << ", " << elevation;
      // A pixel is 0.8 to 1.5 mm of the table: the contour, half a pixel inside the edge, is off by up to 0.7 mm of the
      // 60 mm that are the cube's height, or 0.7 degrees.
      EXPECT_LT(angle_between(stage.in_probe(light.contour), truth), 1 * kDegree) << azimuth << ", " << elevation;
      // The cube hides a part of the shadow, and so moves its centroid: with a short shadow by up to 7 degrees.
      EXPECT_LT(angle_between(stage.in_probe(light.line), truth), 8 * kDegree) << azimuth << ", " << elevation;
    }
}

TEST(Arief, FindsALampWhoseShadowIsPartlyHidden) {
  // What is seen of the edge fits several directions; only one of them leaves the lit ground lit.
  for (const auto& [azimuth, elevation] : {std::pair{20.0, 30.0}, {40.0, 30.0}, {60.0, 40.0}}) {
    Stage stage;
    const Vec3d truth = stage.towards(azimuth, elevation);
    stage.scene.lamps = {reference::DistantLamp{truth, {1, 1, 1}, 0}};
    const auto view = stage.view();
    ASSERT_TRUE(view);
    // As above.
    EXPECT_LT(angle_between(stage.in_probe(view->light(0.5).contour), truth), 1 * kDegree) << azimuth;
  }
}

TEST(Arief, FindsALampFromACameraHeldSidewaysIfUpIsKnown) {
  Stage stage;
  const Quat roll = Quat::about({0, 0, 1}, 90 * kDegree);
  const Vec3d truth = rotate(roll, stage.towards(180, 40));
  stage.scene.probe_body = {roll * stage.scene.probe_body.rotation, {0, 0, -0.5}};
  stage.scene.table = reference::table_under(stage.scene.body, stage.scene.probe_body, kBottom, {0.3, 0.3, 0.3});
  stage.scene.lamps = {reference::DistantLamp{truth, {1, 1, 1}, 0}};
  const Vec3d up_cv = rotate(stage.lens.pose_cv.rotation.inverse(), stage.scene.table->normal);
  const auto view = stage.view({.up_cv = up_cv});
  ASSERT_TRUE(view);
  // As above.
  EXPECT_LT(angle_between(stage.in_probe(view->light(0.5).contour), truth), 1 * kDegree);
}

TEST(Arief, GivesNoLightWithoutAShadow) {
  Stage stage;
  stage.scene.ambient = reference::even_ambient({0.5, 0.5, 0.5});
  const auto view = stage.view();
  ASSERT_TRUE(view);
  for (std::size_t k = 0; k + 1 < kAriefThresholds; ++k) EXPECT_FALSE(view->light(arief_threshold(k)).known) << k;
}

TEST(Arief, GivesNoLightIfTheBodyHidesItsShadow) {
  // The lamp is above the camera: the shadow is behind the cube.
  Stage stage;
  stage.scene.lamps = {reference::DistantLamp{stage.towards(0, 60), {1, 1, 1}, 0}};
  const auto view = stage.view();
  ASSERT_TRUE(view);
  EXPECT_FALSE(view->light(0.5).known);
}

TEST(Arief, HasNoViewOfABallOnItsSheet) {
  Stage stage;
  const reference::GreyBytes picture{480, 360, std::vector<std::uint8_t>(480 * 360, 100)};
  EXPECT_FALSE(AriefView::make(picture.view(), CameraModel(stage.lens), reference::ball_by_hand(),
                               compose(inverse(stage.lens.pose_cv), stage.scene.probe_body)));
}

TEST(Arief, TheBestThresholdHasTheSmallestMeanErrorAndAFrameWithoutALightCounts90Degrees) {
  // Threshold 3: both frames are 60 degrees off; 5: one is right, the other has no light; 8: only one is known, and it
  // is 10 degrees off. The means are 60, 45 and 50 degrees, 90 elsewhere.
  const Vec3d truth{0, 0, -1};
  const auto off = [](double deg) { return Vec3d{std::sin(deg * kDegree), 0, -std::cos(deg * kDegree)}; };
  std::vector<AriefCase> cases(2);
  cases[0].truth = cases[1].truth = truth;
  for (AriefCase& one : cases) one.lights[3] = {true, {}, off(60)};
  cases[0].lights[5] = {true, {}, truth};
  cases[1].lights[8] = {true, {}, off(10)};
  EXPECT_EQ(arief_best_threshold(cases, &AriefLight::contour), 5U);
}

}  // namespace
}  // namespace lightwell::bench
