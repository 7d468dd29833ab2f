#include "ar_viewer/background.hpp"

#include <cmath>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "ar_viewer/frame_recorder.hpp"
#include "host_sdk/ar_viewer/viewer_scenes.hpp"
#include "support/temp_dir.hpp"

namespace lightwell::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

viewer::Picture uniform_picture(int width, int height, float r, float g, float b) {
  viewer::Picture picture;
  picture.resize(width, height);
  for (std::size_t i = 0; i < picture.rgba.size(); i += 4) {
    picture.rgba[i] = r;
    picture.rgba[i + 1] = g;
    picture.rgba[i + 2] = b;
  }
  return picture;
}

TEST(ViewerBackground, IsShownWithoutTheLensesDistortion) {
  viewer::Scene scene = make_viewer_scene();
  scene.camera.distortion = {0.3, -0.1, 0.002, 0.001, 0.02};
  // A white spot where the lens shows the point (x, y) of the plane z = 1, by Brown's formula.
  const double x = 0.3, y = -0.2, r2 = x * x + y * y;
  const auto& k = scene.camera.distortion;
  const double radial = 1 + k[0] * r2 + k[1] * r2 * r2 + k[4] * r2 * r2 * r2;
  const double distorted_x = x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x);
  const double distorted_y = y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y;
  const auto& c = scene.camera;
  const int column = static_cast<int>(std::lround(c.cx + c.fx * distorted_x));
  const int row = static_cast<int>(std::lround(c.cy + c.fy * distorted_y));
  viewer::Picture picture = uniform_picture(c.width, c.height, 0, 0, 0);
  for (int dy = -2; dy <= 2; ++dy)
    for (int dx = -2; dx <= 2; ++dx) picture.at(column + dx, row + dy)[0] = 1;
  const TempDir folder;
  scene.background = folder.path("distorted.png");
  ASSERT_TRUE(viewer::write_png(scene.background, picture).ok());
  const auto background = viewer::Background::open(scene);
  ASSERT_TRUE(background.ok()) << background.status().message();
  const viewer::Picture& shown = background->picture();
  EXPECT_GT(shown.at(static_cast<int>(std::lround(c.cx + c.fx * x)), static_cast<int>(std::lround(c.cy + c.fy * y)))[0],
            0.9F);
  EXPECT_LT(shown.at(column, row)[0], 0.1F) << "it has moved";
}

TEST(ViewerBackground, OfAVideoAdvancesAndStaysAtItsEnd) {
  const TempDir folder;
  viewer::FrameRecorder recorder(folder.path("."));
  const auto video = recorder.toggle_video(64, 48);
  ASSERT_TRUE(video.ok()) << video.status().message();
  for (const float level : {0.1F, 0.4F, 0.8F}) recorder.add(uniform_picture(64, 48, level, 0.3F, 0.2F));
  ASSERT_TRUE(recorder.toggle_video(64, 48).ok());
  viewer::Scene scene = make_viewer_scene();
  scene.camera.width = 64;
  scene.camera.height = 48;
  scene.background = *video;
  auto background = viewer::Background::open(scene);
  ASSERT_TRUE(background.ok()) << background.status().message();
  // Motion JPEG: 4 % of the level.
  for (const float level : {0.1F, 0.4F, 0.8F, 0.8F}) {
    ASSERT_TRUE(background->next().ok());
    EXPECT_NEAR(background->picture().at(30, 20)[0], level, 0.04F);
  }
  EXPECT_FALSE(background->changed());
}

TEST(ViewerBackground, OfLinearRadianceIsTimesTheExposure) {
  const TempDir folder;
  viewer::Scene scene = make_viewer_scene();
  scene.background = folder.path("radiance.exr");
  scene.exposure = 0.25F;
  ASSERT_TRUE(viewer::write_exr(scene.background, uniform_picture(640, 360, 100, 2, 1e-4F)).ok());
  const auto background = viewer::Background::open(scene);
  ASSERT_TRUE(background.ok()) << background.status().message();
  EXPECT_EQ(background->picture().at(3, 5)[0], 25);
  EXPECT_EQ(background->picture().at(3, 5)[2], 0.25F * 1e-4F);
}

TEST(ViewerBackground, ThatDoesNotFitIsRefusedWithTheRemedy) {
  const TempDir folder;
  viewer::Scene scene = make_viewer_scene();
  const auto error_of = [&](const std::string& name) {
    scene.background = folder.path(name);
    const auto background = viewer::Background::open(scene);
    return background.ok() ? std::string("accepted") : std::string(background.status().message());
  };
  ASSERT_TRUE(viewer::write_png(folder.path("small.png"), uniform_picture(64, 48, 0, 0, 0)).ok());
  EXPECT_THAT(error_of("small.png"), AllOf(HasSubstr("small.png"), HasSubstr("64x48"), HasSubstr("camera.width")));
  EXPECT_THAT(error_of("none.png"), HasSubstr("none.png"));
  EXPECT_THAT(error_of("none.mp4"), HasSubstr("none.mp4"));
  std::ofstream(folder.path("broken.exr")) << "no picture";
  EXPECT_THAT(error_of("broken.exr"), HasSubstr("broken.exr"));
  std::ofstream(folder.path("broken.jpg")) << "no picture";
  EXPECT_THAT(error_of("broken.jpg"), HasSubstr("broken.jpg"));
}

}  // namespace
}  // namespace lightwell::test
