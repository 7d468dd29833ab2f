// Detection rate of tags by their angle from the axis of a fisheye lens.
#include <cmath>
#include <iomanip>
#include <iostream>
#include <numbers>
#include <utility>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include "firmware/pose/tags_around.hpp"
#include "pose/tag_detector.hpp"

namespace lightwell {
namespace {

using test::add_ring;
using test::BoardCamera;
using test::BoardPicture;
using test::PlacedBoard;

constexpr Pose kOrigin;

struct DetectionCounts {
  int visible = 0, plain = 0, rectified = 0;
};

/// Tags of a ring at each angle, found without and with rectified views.
DetectionCounts found_at(const BoardCamera& camera, double theta, int count, double size_m, double tilt_deg) {
  std::vector<PlacedBoard> boards;
  add_ring(boards, theta, count, size_m, tilt_deg);
  const BoardPicture picture = camera.take(kOrigin, boards);
  auto detector = TagDetector::make();
  DetectionCounts counts;
  counts.visible = static_cast<int>(picture.tags.size());
  const auto right = [&](const CameraModel* lens) {
    const auto tags = detector->detect(picture.view(), lens);
    EXPECT_TRUE(tags);
    test::errors_of(*tags, picture);
    return static_cast<int>(tags->size());
  };
  counts.plain = right(nullptr);
  counts.rectified = right(&camera.model());
  return counts;
}

TEST(TagAngles, RectifiedViewsFindTagsOutToTheRim) {
  const BoardCamera camera(test::fisheye_lens(800));
  struct Kind {
    const char* name;
    int count;
    double size_m, tilt_deg;
  };
  for (const auto& [name, count, size, tilt] :
       {Kind{"8 degrees", 16, 0.14, 0}, Kind{"8 degrees, tilted by 45", 16, 0.2, 45}, Kind{"30 degrees", 6, 0.54, 0}}) {
    std::cout << name << " wide: angle, tags, found without views, with views\n";
    DetectionCounts all;
    for (double theta = 40; theta <= 90; theta += 10) {
      if (theta + std::atan(size / 2) / test::kDegree * 1.5 > 94) continue;
      const DetectionCounts s = found_at(camera, theta, count, size, tilt);
      std::cout << std::setw(6) << theta << std::setw(6) << s.visible << std::setw(6) << s.plain << std::setw(6)
                << s.rectified << "\n";
      EXPECT_GE(s.rectified, s.plain) << name << " at " << theta;
      all.visible += s.visible;
      all.plain += s.plain;
      all.rectified += s.rectified;
    }
    EXPECT_GE(all.visible, 14) << name;
    EXPECT_GE(all.rectified, 0.97 * all.visible) << name;
  }
}

TEST(TagAngles, RectifiedViewsNeedOnlyACoarseCameraModel) {
  const LensParameters lens = test::fisheye_lens(800);
  LensParameters coarse = lens;
  KannalaBrandtParameters k = std::get<KannalaBrandtParameters>(lens.model);
  k.k1 = k.k2 = 0;
  k.fx = k.fy = k.fx * 0.95;
  k.cx += 8;
  coarse.model = k;
  std::vector<PlacedBoard> boards;
  add_ring(boards, 70, 6, 0.54);
  const BoardPicture picture = BoardCamera(lens).take(kOrigin, boards);
  const CameraModel model(coarse);
  auto detector = TagDetector::make();
  ASSERT_TRUE(detector);
  const auto tags = detector->detect(picture.view(), &model);
  ASSERT_TRUE(tags);
  EXPECT_EQ(tags->size(), boards.size());
  const test::CornerErrors e = test::errors_of(*tags, picture);
  EXPECT_EQ(e.refined, e.corners);
  EXPECT_LT(e.rms(), 0.05) << "corners are refined in the picture, independent of the model";
}

TEST(TagAngles, FindsTagsNearThePolesOfAnEquirectangularPicture) {
  LensParameters lens;
  lens.width = 1600;
  lens.height = 800;
  lens.model = EquirectangularParameters{};
  lens.max_angle_rad = std::numbers::pi;
  lens.pose_cv.rotation = upright_lens_cv();
  const BoardCamera camera(lens);
  std::vector<PlacedBoard> boards;
  // Rings around the vertical axis: one 20 degrees from the pole, two further down.
  for (const auto& [height, count] : {std::pair{70.0, 3}, std::pair{30.0, 7}, std::pair{-50.0, 5}})
    for (int i = 0; i < count; ++i) {
      const double a = 360.0 * i / count * test::kDegree, h = height * test::kDegree;
      const Vec3d at{std::cos(h) * std::sin(a), std::sin(h), -std::cos(h) * std::cos(a)};
      boards.push_back(test::board_facing(test::single_tag(static_cast<int>(boards.size()), 0.2), at, -at, 0.3 * i));
    }
  BoardPicture picture = camera.take(kOrigin, boards);
  EXPECT_EQ(picture.tags.size(), boards.size());
  // One more behind the camera, across the seam of the picture.
  boards.push_back(test::board_facing(test::single_tag(99, 0.2), {0, 0, 1}, {0, 0, -1}));
  picture.pixels = camera.take(kOrigin, boards).pixels;
  auto detector = TagDetector::make();
  ASSERT_TRUE(detector);
  const auto plain = detector->detect(picture.view()), views = detector->detect(picture.view(), &camera.model());
  ASSERT_TRUE(plain && views);
  const test::CornerErrors e = test::errors_of(*views, picture);
  std::cout << "whole sphere: " << picture.tags.size() << " tags, " << plain->size() << " found plainly, "
            << views->size() << " with views, RMS " << e.rms() << " px\n";
  EXPECT_EQ(views->size(), picture.tags.size());
  EXPECT_LT(e.rms(), 0.05);
}

TEST(TagAngles, FindsAllTagsOfAPlanarBoardCloseToTheLens) {
  const BoardCamera camera(test::fisheye_lens(1000));
  TagBoard board;
  board.columns = board.rows = 8;
  board.tag_size_m = 0.03;
  // Its centre is 24 cm away and its corners are 43 degrees from the axis.
  const std::vector<PlacedBoard> boards = {test::board_facing(board, {0, 0, -0.24}, {0, 0, 1}, 0.1)};
  const BoardPicture picture = camera.take(kOrigin, boards);
  ASSERT_EQ(picture.tags.size(), 64u);
  auto detector = TagDetector::make();
  ASSERT_TRUE(detector);
  const auto plain = detector->detect(picture.view()), views = detector->detect(picture.view(), &camera.model());
  ASSERT_TRUE(plain && views);
  const test::CornerErrors e = test::errors_of(*views, picture);
  std::cout << "board of 64 tags: " << plain->size() << " found plainly, " << views->size() << " with views, RMS "
            << e.rms() << " px\n";
  EXPECT_GE(views->size(), 62u);
  EXPECT_LT(e.rms(), 0.05);
}

}  // namespace
}  // namespace lightwell
