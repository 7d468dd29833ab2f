// Tests of importing files of cv::FileStorage as written by OpenCV's samples, with values of real lenses.
#include <array>
#include <cmath>
#include <string>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "import_checks.hpp"

namespace lightwell {
namespace {

using namespace test;

// A RealSense T265's left fisheye: github.com/VladyslavUsenko/basalt, data/t265_kb4_calib.json (BSD).
const std::string kT265 = R"(%YAML:1.0
---
calibration_time: "Sat 21 Nov 2026"
image_width: 848
image_height: 800
fisheye_model: 1
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 286.60144163375528, 0., 422.2765876951761, 0., 286.4617087423328, 395.2246466040553, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 4
   cols: 1
   dt: d
   data: [ -0.006762412326815424, 0.045170283325720008, -0.043515167278210638, 0.008374959821591333 ]
avg_reprojection_error: 0.2
)";
Formula t265() {
  return fisheye(286.60144163375528, 286.4617087423328, 422.2765876951761, 395.2246466040553,
                 {-0.006762412326815424, 0.045170283325720008, -0.043515167278210638, 0.008374959821591333});
}

// The convention of pixel coordinates: cornerSubPix() puts the corner of four squares between pixels 19 and 20 at 19.5,
// so integers are the centres of pixels. Kalibr and ROS refine corners with the same function (README.md).
TEST(OpenCvImport, ThePictureOriginIsTheCentreOfTheTopLeftPixel) {
  cv::Mat picture(40, 40, CV_8U, cv::Scalar(0));
  picture(cv::Rect(0, 0, 20, 20)).setTo(255);
  picture(cv::Rect(20, 20, 20, 20)).setTo(255);
  std::vector<cv::Point2f> corner{{18, 21}};
  cv::cornerSubPix(picture, corner, {5, 5}, {-1, -1}, {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 100, 1e-6});
  EXPECT_NEAR(corner[0].x, 19.5, 1e-3);
  EXPECT_NEAR(corner[0].y, 19.5, 1e-3);
  // In Lightwell's convention pixel (0, 0) of a lens with principal point (0, 0) is on the axis.
  const std::string text = with(with(kT265, "422.2765876951761", "0."), "395.2246466040553", "0.");
  ImportOptions options;
  options.max_angle_rad = 1;
  const auto k = std::get<KannalaBrandtParameters>(imported(text, options).rig.lenses[0].model);
  EXPECT_EQ(k.cx, 0);
  EXPECT_EQ(k.cy, 0);
}

TEST(OpenCvImport, AFisheyeLandsOnOpenCvsPixels) {
  const ImportedCalibration in = imported(kT265);
  EXPECT_EQ(in.kind, ImportKind::opencv);
  EXPECT_EQ(in.rig.lenses[0].width, 848);
  EXPECT_EQ(in.rig.lenses[0].height, 800);
  expect_same_pixels(in.rig.lenses[0], t265());
  EXPECT_FALSE(noted(in, "taken as cv::fisheye's")) << "the file declares a fisheye";
}

TEST(OpenCvImport, TheSpellingsOfTheTutorialsAreTheSameLens) {
  const std::string tutorial = R"(%YAML:1.0
---
DIM: [ 848, 800 ]
K: [ [ 286.60144163375528, 0., 422.2765876951761 ], [ 0., 286.4617087423328, 395.2246466040553 ], [ 0., 0., 1. ] ]
D: [ [ -0.006762412326815424 ], [ 0.045170283325720008 ], [ -0.043515167278210638 ], [ 0.008374959821591333 ] ]
)";
  const ImportedCalibration in = imported(tutorial);
  EXPECT_EQ(in.rig.lenses[0].height, 800);
  expect_same_pixels(in.rig.lenses[0], t265());
  EXPECT_TRUE(noted(in, "taken as cv::fisheye's k1 k2 k3 k4")) << "four coefficients could be a pinhole's";
  const std::string old =
      with(with(with(with(with(kT265, "image_width", "image_Width"), "image_height", "image_Height"), "camera_matrix",
                     "Camera_Matrix"),
                "distortion_coefficients", "Distortion_Coefficients"),
           "fisheye_model: 1", "distortion_model: fisheye");
  expect_same_pixels(imported(old).rig.lenses[0], t265());
}

TEST(OpenCvImport, SkewIsRefused) {
  expect_refused(with(kT265, "286.60144163375528, 0.,", "286.60144163375528, 0.25,"),
                 {"camera_matrix", "skew of 0.25", "CALIB_FIX_SKEW"});
}

TEST(OpenCvImport, InvalidLensesAreRefusedWithTheField) {
  expect_refused(with(kT265, "286.60144163375528", ".Nan"), {"camera_matrix", "not finite"});
  expect_refused(with(kT265, "286.60144163375528", "-286."), {"camera_matrix", "must be positive"});
  expect_refused(with(kT265, "286.60144163375528, 0.,", "0.,"),
                 {"camera_matrix", "has 8 numbers", "rows and cols say 9"});
  expect_refused(with(kT265, "0., 0., 1. ]", "0., 0., 2. ]"), {"camera_matrix", "fx 0 cx, 0 fy cy, 0 0 1"});
  expect_refused(with(kT265, "-0.006762412326815424", ".Inf"), {"distortion_coefficients", "not finite"});
  expect_refused(with(with(kT265, "-0.006762412326815424, ", ""), "rows: 4", "rows: 3"),
                 {"distortion_coefficients", "4 coefficients, k1 k2 k3 k4", "it has 3"});
  expect_refused(with(kT265, "image_width: 848", "image_width: 0"), {"image_width", "0 x 800"});
  expect_refused(with(kT265, "image_width: 848", "image_width: wide"), {"image_width", "numbers"});
  expect_refused(with(kT265, "fisheye_model: 1", "distortion_model: kb4"),
                 {"distortion_model", "'kb4' is unknown", "fisheye", "plumb_bob"});
  expect_refused(with(kT265, "image_height", "image_depth"), {"image_height", "is missing"});
  expect_refused(with(kT265, "camera_matrix", "matrix"), {"camera_matrix", "is missing", "K"});
  expect_refused(with(kT265, "distortion_coefficients", "coefficients"), {"distortion_coefficients", "is missing"});
  expect_refused(kT265 + "K: [ 1, 0, 0, 0, 1, 0, 0, 0, 1 ]\n", {"K: has the same meaning as camera_matrix"});
  expect_refused(kT265 + "image_size: [ 848, 800 ]\n", {"image_size: has the same meaning as image_width"});
  expect_refused(kT265 + "xi: -0.5\n", {"xi", "must be zero or more"});
  expect_refused(kT265 + "xi: [ 1., 2. ]\n", {"xi", "must be one number"});
  expect_refused(kT265 + "camera_matrix_1: 5\n", {"camera_matrix_1", "a pair of cameras"});
  expect_refused("%YAML:1.0\n---\na: [ 1, 2\n", {"given:3: not a file of cv::FileStorage"});
  expect_refused("<?xml version=\"1.0\"?>\n<opencv_storage>\n<a>1</b>\n</opencv_storage>\n",
                 {"given:3: not a file of cv::FileStorage", "closing tag"});
  expect_refused(kT265, {"has one camera", "--camera"}, {{}, 1, {}});
}

}  // namespace
}  // namespace lightwell
