// The measured blur of tags and of a body in rendered pictures.
#include <cmath>
#include <iostream>
#include <optional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "calibration/model/response.hpp"
#include "firmware/pose/body_pictures.hpp"
#include "firmware/pose/tags_around.hpp"

namespace lightwell {
namespace {

using test::BoardCamera;
using test::BodyCamera;
using test::BodyShot;
using test::PictureOptions;
using test::PlacedBoard;

/// Standard deviation of the measured blur about the true one, px, over the pictures of the development scenes of
/// tests/reference/mitsuba/marker_scenes: 0.15.
constexpr double kTolerance_px = 0.15;

TEST(TagBlur, IsThatOfTheLens) {
  const BoardCamera camera(test::fisheye_lens(800));
  // Cells of 3.5 to 6 px, turned to the edge of the field, where large tags have curved edges.
  std::vector<PlacedBoard> boards;
  test::add_ring(boards, 20, 5, 0.17, 25);
  test::add_ring(boards, 45, 8, 0.24, 20);
  for (const CornerRefinement corners : {CornerRefinement::edge_search, CornerRefinement::edge_fit})
    for (const bool srgb : {false, true}) {
      TagDetectorOptions options;
      options.corners = corners;
      if (srgb) {
        PhotometricCalibration photometry;
        photometry.response.kind = ResponseCurve::Kind::srgb;
        options.linear = linear_table(photometry, 256);
      }
      auto detector = TagDetector::make(options);
      ASSERT_TRUE(detector);
      for (const double blur_px : {0.0, 0.5, 1.0, 1.5, 2.0}) {
        PictureOptions picture_options;
        picture_options.blur_px = blur_px;
        picture_options.srgb = srgb;
        const auto picture = camera.take(Pose{}, boards, picture_options);
        const auto tags = detector->detect(picture.view());
        ASSERT_TRUE(tags);
        ASSERT_GE(tags->size(), 10U) << blur_px;
        double squares = 0, sum = 0;
        for (const TagDetection& tag : *tags) {
          ASSERT_TRUE(tag.blur_px) << tag.id;
          // Below the width of a pixel's area and of interpolation, small differences of the profile are large ones of
          // the blur: 0.2 px and 0 differ by 0.04 px² of 0.29.
          const double measured = blur_px == 0 && *tag.blur_px < 0.25 ? 0 : *tag.blur_px;
          sum += measured - blur_px;
          squares += (measured - blur_px) * (measured - blur_px);
        }
        const auto count = static_cast<double>(tags->size());
        std::cout << (corners == CornerRefinement::edge_fit ? "fit" : "search") << (srgb ? ", sRGB" : "") << ", blur "
                  << blur_px << ": mean error " << sum / count << " px, RMS " << std::sqrt(squares / count) << "\n";
        EXPECT_LT(std::sqrt(squares / count), kTolerance_px) << blur_px << " px, sRGB " << srgb;
      }
    }
}

TEST(TagBlur, IsNotMeasuredWithoutRefinement) {
  const BoardCamera camera(test::fisheye_lens(400));
  std::vector<PlacedBoard> boards;
  test::add_ring(boards, 15, 2, 0.25);
  TagDetectorOptions options;
  options.corners = CornerRefinement::none;
  const auto tags = TagDetector::make(options)->detect(camera.take(Pose{}, boards).view());
  ASSERT_TRUE(tags);
  ASSERT_FALSE(tags->empty());
  for (const TagDetection& tag : *tags) EXPECT_FALSE(tag.blur_px);
}

/// Blur of the body in one picture of a still body, px.
double blur_of_body(double width_px, double blur_px, const std::optional<Vec3d>& motion_m = std::nullopt) {
  const RigParameters rig = test::camera_rig(640, 480, 550);
  const MarkerBody body = test::dodecahedron();
  BodyShot shot;
  shot.probe_body = test::body_at({0, 0, -test::distance_for(width_px, 550)}, 3);
  shot.blur_px = blur_px;
  if (motion_m) {
    shot.closing_pose = shot.probe_body;
    shot.closing_pose->translation += *motion_m;
  }
  auto tracker = BodyTracker::make(body, rig);
  EXPECT_TRUE(tracker);
  const auto observation = tracker->track(BodyCamera(rig, body).take(shot).view(), ProbeTime{1});
  EXPECT_TRUE(observation && observation->pose && observation->pose->blur_px) << width_px << " px, blur " << blur_px;
  return observation && observation->pose ? observation->pose->blur_px.value_or(-1) : -1;
}

TEST(BodyBlur, IsMeasuredWhereItIsAsWideAsHalfACell) {
  // Cells of a frontal tag are 2.7 and 5 px wide.
  for (const auto& [width_px, blur_px] :
       {std::pair{120.0, 0.5}, {120.0, 1.0}, {220.0, 0.5}, {220.0, 1.0}, {220.0, 1.5}, {220.0, 2.0}}) {
    const double measured = blur_of_body(width_px, blur_px);
    std::cout << width_px << " px, blur " << blur_px << ": " << measured << "\n";
    EXPECT_NEAR(measured, blur_px, 2 * kTolerance_px) << width_px;
  }
}

TEST(BodyBlur, ContainsMotionAlongEitherAxis) {
  // A box 4 px long has a standard deviation of 1.15 px; a lens blur of 0.6 px is added in quadrature.
  constexpr double kMotion_px = 4, kWidth_px = 220;
  // The faces that are seen are some 5 cm before the body's centre.
  const double per_px = (test::distance_for(kWidth_px, 550) - 0.05) / 550;
  const double expected = std::hypot(kMotion_px / std::sqrt(12.0), 0.6);
  const double still = blur_of_body(kWidth_px, 0.6);
  for (const Vec3d along : {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}}) {
    const double moving = blur_of_body(kWidth_px, 0.6, along * (kMotion_px * per_px));
    std::cout << "moving: " << moving << " px, a box of this length: " << expected << "\n";
    // A tag that is turned against the motion has no edge across all of it: at 45 degrees 0.7 of it.
    EXPECT_GT(moving, 0.7 * expected);
    // The profile of a moving edge is a ramp: a Gaussian fits it with a larger width.
    EXPECT_LT(moving, 1.3 * expected);
    EXPECT_GT(moving, still + 0.5);
  }
}

}  // namespace
}  // namespace lightwell
