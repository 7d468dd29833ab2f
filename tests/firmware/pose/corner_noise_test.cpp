// Corners in rendered pictures: their covariance, and which attitudes of a body it excludes.
#include "firmware/pose/corner_noise.hpp"

#include <iostream>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

namespace lightwell {
namespace {

using test::CornerCell;
using test::CornerScenes;
using test::CornerStatistics;

struct Case {
  double width_px;
  CornerCell cell;
};

/// In the small cells the blur mixes neighbouring cells; in the large ones noise and interpolation dominate.
const std::vector<Case> kCases = {{120, {0.5, 10'000}},
                                  {120, {1, 10'000}},
                                  {200, {1, 10'000}},
                                  {200, {1, 1'000}},
                                  {160, {0.7, 10'000, 1.5, 0.1, true}}};

TEST(CornerNoise, ChiSquareIsThatOfTheStatedCovariance) {
  const MarkerBody body = test::dodecahedron();
  double width_px = 0;
  std::unique_ptr<CornerScenes> scenes;
  for (const auto& [width, cell] : kCases) {
    if (width != width_px) scenes = std::make_unique<CornerScenes>(body, width_px = width, 6, 300);
    for (const CornerRefinement refinement : {CornerRefinement::edge_search, CornerRefinement::edge_fit}) {
      const CornerStatistics s = scenes->measure(refinement, cell);
      std::cout << width << " px, blur " << cell.blur_px << ", " << cell.electrons << " electrons, exposure "
                << cell.exposure << (refinement == CornerRefinement::edge_fit ? ", fit" : ", search") << ": " << s.tags
                << " tags, " << s.refined << " refined, RMS " << s.rms_px() << " px, chi² " << s.true_chi_square()
                << ", fitted " << s.fitted_chi_square() << "\n";
      ASSERT_GE(s.tags, 6);
      EXPECT_GE(s.refined, 0.9 * s.tags);
      // A standard deviation that is right to a factor of 1.7, as in all cells of the table in firmware/pose/README.md.
      // By chance alone, 6 tags (48 coordinates, of which those of an edge are correlated) scatter by a factor of 1.2.
      for (const double chi_square : {s.true_chi_square(), s.fitted_chi_square()}) {
        EXPECT_GT(chi_square, 0.3);
        EXPECT_LT(chi_square, 2.5);
      }
    }
  }
}

/// The linear contrast of a dark encoded picture is a few steps of a linear one.
TEST(BodyPoseInPictures, ThreeFacesExcludeTheSecondAttitude) {
  const MarkerBody body = test::dodecahedron();
  for (const auto& [width_px, cell] :
       {Case{140, {0.6, 10'000}}, Case{200, {1, 1'000}}, Case{200, {0.6, 10'000, 1.5, 0.025, true}}}) {
    const CornerStatistics s =
        CornerScenes(body, width_px, 12, 400).measure(CornerRefinement::edge_search, cell, BodyPoseOptions{});
    std::cout << width_px << " px, exposure " << cell.exposure << ": three tags in " << s.three_tags().poses << " of "
              << s.poses << " pictures, ambiguous " << s.three_tags().ambiguous << "; of all " << s.ambiguous
              << ", beyond 3 sigma " << s.all_tags().beyond_3_sigma << "\n";
    EXPECT_GE(s.three_tags().poses, 4);
    EXPECT_EQ(s.three_tags().ambiguous, 0);
    EXPECT_EQ(s.all_tags().beyond_3_sigma, 0);
  }
}

TEST(BodyPoseInPictures, OneDistantFaceRemainsAmbiguous) {
  const RigParameters rig = test::camera_rig(640, 480, 550);
  const MarkerBody body = test::dodecahedron();
  const test::BodyCamera camera(rig, body);
  TagDetectorOptions detect;
  detect.corners = CornerRefinement::edge_search;
  TagDetector detector = std::move(*TagDetector::make(detect));
  int found = 0, ambiguous = 0;
  for (const double tilt : {0.1, 0.15, 0.2, 0.25, 0.3})
    for (const double width_px : {95.0, 110.0}) {
      const Pose truth = test::face_on(test::distance_for(width_px, 550), tilt);
      const reference::GreyBytes picture = camera.take(truth, static_cast<std::uint64_t>(1000 * tilt + width_px));
      const auto tags = detector.detect_in(picture.view(), {{0, 0, 640, 480}, 1, contrast_above_noise(picture.view())});
      ASSERT_TRUE(tags);
      std::vector<TagObservation> front;
      for (const TagDetection& tag : *tags)
        if (tag.id == 0) front.push_back({0, tag});
      const auto pose = find_body_pose(rig, body, front, std::nullopt, test::exact_camera());
      if (!pose) continue;
      ++found;
      ambiguous += pose->ambiguous;
      const double turn = test::turn_of(test::error_of(pose->probe_body.pose, truth));
      EXPECT_TRUE(pose->ambiguous || turn < 0.1) << width_px << " px, tilt " << tilt << ", off by " << turn << " rad";
      std::cout << width_px << " px, tilt " << tilt << ": excess " << pose->alternative_excess << ", off by " << turn
                << " rad" << (pose->ambiguous ? ", ambiguous" : "") << "\n";
    }
  EXPECT_GE(found, 8);
  EXPECT_EQ(ambiguous, found);
}

}  // namespace
}  // namespace lightwell
