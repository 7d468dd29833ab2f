// How far out in a fisheye picture tags are found.
#include <cmath>
#include <iomanip>
#include <iostream>
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

struct Share {
  int there = 0, plain = 0, rectified = 0;
};

/// Tags of a ring at each angle, found without and with rectified views.
Share found_at(const BoardCamera& camera, double theta, int count, double size_m, double tilt_deg) {
  std::vector<PlacedBoard> boards;
  add_ring(boards, theta, count, size_m, tilt_deg);
  const BoardPicture picture = camera.take(kOrigin, boards);
  auto detector = TagDetector::make();
  Share share;
  share.there = static_cast<int>(picture.tags.size());
  const auto right = [&](const CameraModel* lens) {
    const auto tags = detector->detect(picture.view(), lens);
    EXPECT_TRUE(tags);
    test::errors_of(*tags, picture);
    return static_cast<int>(tags->size());
  };
  share.plain = right(nullptr);
  share.rectified = right(&camera.model());
  return share;
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
    std::cout << name << " across: angle, tags, found plainly, with views\n";
    Share all;
    for (double theta = 40; theta <= 90; theta += 10) {
      if (theta + std::atan(size / 2) / test::kDegree * 1.5 > 94) continue;
      const Share s = found_at(camera, theta, count, size, tilt);
      std::cout << std::setw(6) << theta << std::setw(6) << s.there << std::setw(6) << s.plain << std::setw(6)
                << s.rectified << "\n";
      EXPECT_GE(s.rectified, s.plain) << name << " at " << theta;
      all.there += s.there;
      all.plain += s.plain;
      all.rectified += s.rectified;
    }
    EXPECT_GE(all.there, 14) << name;
    EXPECT_GE(all.rectified, 0.97 * all.there) << name;
  }
}

}  // namespace
}  // namespace lightwell
