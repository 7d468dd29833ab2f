// The camera's pose from a picture of a tag that is drawn by rays, not by OpenGL.
#include "ar_viewer/tag_tracker.hpp"

#include <cmath>
#include <cstdlib>
#include <vector>

#include <gtest/gtest.h>

extern "C" {
#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
}

#include "host_sdk/ar_viewer/viewer_scenes.hpp"
#include "support/temp_dir.hpp"

namespace lightwell::test {
namespace {

constexpr double kTagSize = 0.1;
constexpr int kId = 7;
/// Half a turn about x and back: the tag lies on the plane y = 0, its +Z is up, its +Y is away from the camera.
const Pose kLyingTag{Quat::about({1, 0, 0}, -1.5707963267948966), {0.02, 0, 0.01}};

/// Cells of the tag, rows from its top, with the white border: 10 x 10 for tag36h11, of which 8 x 8 are kTagSize.
std::vector<std::uint8_t> tag_cells() {
  apriltag_family_t* family = tag36h11_create();
  image_u8_t* image = apriltag_to_image(family, kId);
  std::vector<std::uint8_t> cells;
  for (int row = 0; row < 10; ++row)
    for (int column = 0; column < 10; ++column) cells.push_back(image->buf[row * image->stride + column]);
  std::free(image->buf);  // NOLINT: libapriltag exports no function that does
  std::free(image);       // NOLINT
  tag36h11_destroy(family);
  return cells;
}

/// A grey plane with the tag, as the scene's camera sees it, 5 x 5 rays a pixel.
std::vector<std::uint8_t> picture_of_tag(const viewer::Scene& scene) {
  const std::vector<std::uint8_t> cells = tag_cells();
  const Pose T_tag_world = inverse(kLyingTag);
  std::vector<std::uint8_t> grey;
  for (int row = 0; row < scene.camera.height; ++row)
    for (int column = 0; column < scene.camera.width; ++column) {
      double sum = 0;
      for (int k = 0; k < 25; ++k) {
        const Vec3d at = ground_point(scene, column + (k % 5 - 2) / 5.0, row + (k / 5 - 2) / 5.0);
        const Vec3d p = transformed(T_tag_world, at);
        const double x = p.x / kTagSize * 8 + 5, y = 5 - p.y / kTagSize * 8;
        const bool inside = x >= 0 && x < 10 && y >= 0 && y < 10;
        sum += inside ? cells[static_cast<std::size_t>(y) * 10 + static_cast<std::size_t>(x)] : 150;
      }
      grey.push_back(static_cast<std::uint8_t>(std::lround(sum / 25)));
    }
  return grey;
}

viewer::TrackedTag tag() { return {viewer::TagFamily::tag36h11, kId, kTagSize, kLyingTag}; }

TEST(TagTracker, FindsThePoseOfTheCamera) {
  viewer::Scene scene = make_viewer_scene();
  scene.pose = Pose{Quat::about({0, 1, 0}, 0.3) * Quat::about({1, 0, 0}, -0.7), {0.1, 0.3, 0.35}};
  viewer::TagTracker tracker(tag(), scene.camera);
  const auto found = tracker.find(picture_of_tag(scene));
  ASSERT_TRUE(found.has_value());
  const Pose& truth = std::get<Pose>(scene.pose);
  // Corners are found to a tenth of a pixel; the tag has about 130 pixels.
  EXPECT_LT(length(found->translation - truth.translation), 0.002);
  const Quat turn = found->rotation * truth.rotation.inverse();
  EXPECT_LT(2 * std::asin(std::min(1.0, length(Vec3d{turn.x, turn.y, turn.z}))), 0.01);
}

TEST(TagTracker, FindsNothingWithoutTheTag) {
  const viewer::Scene scene = make_viewer_scene();
  viewer::TagTracker tracker(tag(), scene.camera);
  EXPECT_FALSE(tracker.find(std::vector<std::uint8_t>(640 * 360, 150)).has_value());
  EXPECT_FALSE(tracker.find(std::vector<std::uint8_t>(100, 150)).has_value());
  viewer::TrackedTag other = tag();
  other.id = 8;
  EXPECT_FALSE(viewer::TagTracker(other, scene.camera).find(picture_of_tag(scene)).has_value());
}

TEST(TagTracker, GivesThePoseOfTheViewersFrame) {
  viewer::Scene scene = make_viewer_scene();
  viewer::Picture background;
  background.resize(scene.camera.width, scene.camera.height);
  const std::vector<std::uint8_t> grey = picture_of_tag(scene);
  for (std::size_t i = 0; i < grey.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) background.rgba[4 * i + c] = viewer::srgb_linear(grey[i]);
  const TempDir folder;
  scene.background = folder.path("tag.png");
  ASSERT_TRUE(viewer::write_png(scene.background, background).ok());
  scene.objects = {make_object("sphere", {0.06}, {0.1, 0, 0})};
  set_light(scene, uniform_light({1, 1, 1}));
  const Rendered known = render(scene);
  scene.pose = tag();
  const Rendered tracked = render(scene);
  int differ = 0, covered = 0;
  for (std::size_t i = 3; i < known.frame.rgba.size(); i += 4) {
    covered += known.frame.rgba[i] > 0.5F ? 1 : 0;
    differ += (known.frame.rgba[i] > 0.5F) != (tracked.frame.rgba[i] > 0.5F) ? 1 : 0;
  }
  EXPECT_GT(covered, 2000);
  // Less than a pixel of the outline, which has about 200.
  EXPECT_LT(differ, 200);
}

}  // namespace
}  // namespace lightwell::test
