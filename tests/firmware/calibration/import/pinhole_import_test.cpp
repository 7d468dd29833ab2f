// Tests of importing pinholes with radial and tangential distortion, which are accepted if a supported model is equal.
#include <cmath>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "calibration/model/camera_model.hpp"
#include "import_checks.hpp"

namespace lightwell {
namespace {

using namespace test;

constexpr double kDegree = std::numbers::pi / 180;

// EuRoC's left camera, from Kalibr's wiki, "Yaml formats".
const std::string kEuroc = R"(cam0:
  camera_model: pinhole
  intrinsics: [461.629, 460.152, 362.680, 246.049]
  distortion_model: radtan
  distortion_coeffs: [-0.27695497, 0.06712482, 0.00087538, 0.00011556]
  resolution: [752, 480]
)";
Formula euroc() {
  return pinhole(461.629, 460.152, 362.680, 246.049, {-0.27695497, 0.06712482, 0.00087538, 0.00011556});
}

// The same camera as written by cv::calibrateCamera, five coefficients, and by ROS.
const std::string kOpenCv = R"(%YAML:1.0
---
image_width: 752
image_height: 480
fisheye_model: 0
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 461.629, 0., 362.680, 0., 460.152, 246.049, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -0.27695497, 0.06712482, 0.00087538, 0.00011556, 0. ]
)";
const std::string kRos = R"(image_width: 752
image_height: 480
camera_matrix: {rows: 3, cols: 3, data: [461.629, 0, 362.680, 0, 460.152, 246.049, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [-0.27695497, 0.06712482, 0.00087538, 0.00011556, 0]}
)";

TEST(PinholeImport, FourCoefficientsEqualMeiWithXiZero) {
  for (const std::string& text : {kEuroc, kOpenCv, kRos}) {
    const LensParameters lens = imported(text).rig.lenses[0];
    EXPECT_LT(lens.max_angle_rad, 45 * kDegree);
    expect_same_pixels(lens, euroc());
  }
}

TEST(PinholeImport, FurtherCoefficientsAreRefusedWithTheRemedy) {
  expect_refused(with(kOpenCv, "0.00011556, 0. ]", "0.00011556, 0.001 ]"),
                 {"distortion_coefficients", "5 coefficients", "more than k1 k2 p1 p2", "fisheye or omnidir"});
  expect_refused(with(kRos, "0.00011556, 0]", "0.00011556, 0.01]"),
                 {"given:4: distortion_model", "plumb_bob", "more radial terms", "pinhole-equi"});
  const std::string rational = with(with(with(kRos, "plumb_bob", "rational_polynomial"), "cols: 5", "cols: 8"),
                                    "0.00011556, 0]", "0.00011556, 0, 0.1, 0, 0]");
  expect_refused(rational, {"given:4: distortion_model", "rational_polynomial", "pinhole-equi"});
  expect_refused(with(kRos, ", 0]", "]"), {"given:5: distortion_coefficients.data", "4 numbers"});
  expect_refused(with(with(kRos, "cols: 5", "cols: 3"), "0.00011556, 0]", "]"),
                 {"given:5: distortion_coefficients", "k1 k2 t1 t2 k3", "here are 3"});
}

// With tangential distortion, circles of directions project to ovals, which must be inside the picture's circle.
TEST(FieldOfView, HoldsAtEveryAzimuthOfALensWithTangentialDistortion) {
  const std::string text = R"(cam0:
  camera_model: omni
  distortion_coeffs: [-0.2, 0.1, 0.004, -0.003]
  distortion_model: radtan
  intrinsics: [1.75, 1280, 1280, 749.5, 749.5]
  resolution: [1500, 1500]
)";
  const LensParameters lens = imported(text).rig.lenses[0];
  const CameraModel model(lens);
  double largest = 0;
  for (int i = 0; i < 3600; ++i) {
    const double phi = i * 0.1 * kDegree, t = lens.max_angle_rad;
    const auto p = model.project({std::sin(t) * std::cos(phi), std::sin(t) * std::sin(phi), std::cos(t)});
    ASSERT_TRUE(p) << phi;
    largest = std::max(largest, std::hypot(p->x - 749.5, p->y - 749.5));
  }
  EXPECT_LE(largest, 750 + 1e-3);
  EXPECT_GT(largest, 750 - 0.05) << "a thousandth of a degree is 1/50 pixel";
}

}  // namespace
}  // namespace lightwell
