// Tests of the field of view of imported lenses.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "calibration/solve/import/readers.hpp"
#include "import_checks.hpp"

namespace lightwell {
namespace {

using namespace test;

constexpr double kDegree = std::numbers::pi / 180;

// An equidistant lens, 300 pixels per rad.
const std::string kLens = R"(cam0:
  camera_model: pinhole
  distortion_coeffs: [0, 0, 0, 0]
  distortion_model: equidistant
  intrinsics: [300, 300, 499.5, 499.5]
  resolution: [1000, 1000]
)";

double angle_of(const std::string& text, const ImportOptions& options = {}) {
  return imported(text, options).rig.lenses[0].max_angle_rad;
}

// The angle is rounded down to a thousandth of a degree.
constexpr double kStep = 0.001 * kDegree;

TEST(FieldOfView, EndsAtTheLargestCircleInThePicture) {
  EXPECT_LE(angle_of(kLens), 500.0 / 300);
  EXPECT_GT(angle_of(kLens), 500.0 / 300 - kStep);
}

TEST(FieldOfView, TheCircleTouchesTheNearestEdge) {
  // Principal point 20 pixels further left; 40 further up; a picture that is cut at the bottom.
  EXPECT_NEAR(angle_of(with(kLens, "499.5, 499.5", "479.5, 499.5")), 480.0 / 300, kStep);
  EXPECT_NEAR(angle_of(with(kLens, "499.5, 499.5", "499.5, 459.5")), 460.0 / 300, kStep);
  EXPECT_NEAR(angle_of(with(kLens, "[1000, 1000]", "[1000, 900]")), 400.0 / 300, kStep);
}

TEST(FieldOfView, IsLimitedToTheModelsDomain) {
  // dr/dtheta = 1 - 0.6 theta² is zero at 1.29 rad, r = 258 pixels of 500.
  const std::string turning = with(kLens, "[0, 0, 0, 0]", "[-0.2, 0, 0, 0]");
  EXPECT_NEAR(angle_of(turning), std::sqrt(1 / 0.6), kStep);
  EXPECT_LE(angle_of(turning), std::sqrt(1 / 0.6));
  EXPECT_TRUE(noted(imported(turning), "the end of the model's domain"));
}

TEST(FieldOfView, NeverBeyondTheWholeSphere) {
  EXPECT_NEAR(angle_of(with(kLens, "[300, 300", "[100, 100")), std::numbers::pi, kStep)
      << "the circle would be at 5 rad";
}

TEST(FieldOfView, TheRequestedAngleIsLimitedToTheModelsDomain) {
  ImportOptions options;
  options.max_angle_rad = 110 * kDegree;
  EXPECT_EQ(angle_of(kLens, options), 110 * kDegree) << "the option overrides the circle, which ends at 95 degrees";
  const ImportedCalibration capped = imported(with(kLens, "[0, 0, 0, 0]", "[-0.2, 0, 0, 0]"), options);
  EXPECT_NEAR(capped.rig.lenses[0].max_angle_rad, std::sqrt(1 / 0.6), kStep);
  EXPECT_TRUE(noted(capped, "two directions would project to the same pixel"));
}

TEST(FieldOfView, APrincipalPointOutsideThePictureNeedsTheAngle) {
  const std::string outside = with(kLens, "499.5, 499.5", "1010, 499.5");
  expect_refused(outside, {"principal point is outside", "--max-angle-deg"});
  ImportOptions options;
  options.max_angle_rad = 1;
  EXPECT_EQ(angle_of(outside, options), 1);
}

TEST(FieldOfView, InvalidAnglesAreRefused) {
  for (const double angle : {0.0, -1.0, 3.2, std::nan("")}) {
    ImportOptions options;
    options.max_angle_rad = angle;
    expect_refused(kLens, {"--max-angle-deg"}, options);
  }
}

}  // namespace
}  // namespace lightwell
