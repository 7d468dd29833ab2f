// Tests of importing sensor_msgs/CameraInfo as written by camera_calibration, and as printed message.
#include <cmath>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "import_checks.hpp"

namespace lightwell {
namespace {

using namespace test;

// A RealSense T265's right fisheye (github.com/VladyslavUsenko/basalt, data/t265_kb4_calib.json, BSD) in the fields
// that camera_calibration writes.
const std::string kWritten = R"(image_width: 848
image_height: 800
camera_name: t265_right
camera_matrix:
  rows: 3
  cols: 3
  data: [286.94962264945976, 0, 431.3293011565108, 0, 286.69078453656996, 390.0750907521924, 0, 0, 1]
distortion_model: equidistant
distortion_coefficients:
  rows: 1
  cols: 4
  data: [-0.00917659267037002, 0.05074013237676034, -0.04804389088255095, 0.009643678532407408]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  rows: 3
  cols: 4
  data: [286.9, 0, 431.3, 0, 0, 286.7, 390.1, 0, 0, 0, 1, 0]
)";
Formula t265() {
  return fisheye(286.94962264945976, 286.69078453656996, 431.3293011565108, 390.0750907521924,
                 {-0.00917659267037002, 0.05074013237676034, -0.04804389088255095, 0.009643678532407408});
}

// The same lens as printed by `rostopic echo`.
const std::string kPrinted = R"(header:
  seq: 0
  frame_id: "right"
height: 800
width: 848
distortion_model: "equidistant"
D: [-0.00917659267037002, 0.05074013237676034, -0.04804389088255095, 0.009643678532407408]
K: [286.94962264945976, 0.0, 431.3293011565108, 0.0, 286.69078453656996, 390.0750907521924, 0.0, 0.0, 1.0]
R: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
P: [286.9, 0.0, 431.3, 0.0, 0.0, 286.7, 390.1, 0.0, 0.0, 0.0, 1.0, 0.0]
binning_x: 0
binning_y: 0
roi:
  x_offset: 0
  y_offset: 0
  height: 0
  width: 0
  do_rectify: False
)";

TEST(RosImport, AnEquidistantLensLandsOnItsPixels) {
  for (const std::string& text : {kWritten, kPrinted, with(kWritten, "equidistant", "fisheye")}) {
    const ImportedCalibration in = imported(text);
    EXPECT_EQ(in.kind, ImportKind::ros);
    EXPECT_EQ(in.rig.lenses[0].width, 848);
    EXPECT_EQ(in.rig.lenses[0].height, 800);
    expect_same_pixels(in.rig.lenses[0], t265());
  }
  EXPECT_EQ(imported(kWritten).cameras, std::vector<std::string>{"t265_right"});
  // ROS 2 names the arrays in lower case.
  expect_same_pixels(imported(with(with(kPrinted, "K:", "k:"), "D:", "d:")).rig.lenses[0], t265());
}

TEST(RosImport, ARegionOfInterestShiftsThePixels) {
  const std::string text = with(with(with(with(kPrinted, "x_offset: 0", "x_offset: 24"), "y_offset: 0", "y_offset: 10"),
                                     "  height: 0", "  height: 780"),
                                "  width: 0", "  width: 800");
  const ImportedCalibration in = imported(text);
  EXPECT_EQ(in.rig.lenses[0].width, 800);
  EXPECT_EQ(in.rig.lenses[0].height, 780);
  EXPECT_TRUE(noted(in, "roi"));
  expect_same_pixels(in.rig.lenses[0], [](double x, double y, double z) -> Pixel {
    const Pixel whole = t265()(x, y, z);
    return {whole[0] - 24, whole[1] - 10};
  });
}

// Binning joins two pixels with centres 0 and 1 to one with centre 0, which is 0.5 in the sensor's pixels.
TEST(RosImport, BinningKeepsTheCentreOfABinnedPixel) {
  const std::string text = with(with(kPrinted, "binning_x: 0", "binning_x: 2"), "binning_y: 0", "binning_y: 4");
  const ImportedCalibration in = imported(text);
  EXPECT_EQ(in.rig.lenses[0].width, 424);
  EXPECT_EQ(in.rig.lenses[0].height, 200);
  EXPECT_TRUE(noted(in, "binned"));
  expect_same_pixels(in.rig.lenses[0], [](double x, double y, double z) -> Pixel {
    const Pixel whole = t265()(x, y, z);
    return {(whole[0] - 0.5) / 2, (whole[1] - 1.5) / 4};
  });
  expect_refused(with(kPrinted, "binning_x: 0", "binning_x: 3"),
                 {"given:11: binning_x", "does not divide", "848 x 800"});
  expect_refused(with(kPrinted, "binning_x: 0", "binning_x: 0.5"), {"given:11: binning_x", "whole number"});
}

TEST(RosImport, ARegionOutsideThePictureIsRefused) {
  const std::string sized = with(with(kPrinted, "  height: 0", "  height: 700"), "  width: 0", "  width: 848");
  expect_refused(with(sized, "x_offset: 0", "x_offset: 1"), {"roi", "inside the picture of 848 x 800"});
  expect_refused(with(sized, "y_offset: 0", "y_offset: 101"), {"roi", "inside the picture"});
  expect_refused(with(sized, "x_offset: 0", "x_offset: -1"), {"roi.x_offset", "whole number"});
  expect_refused(with(kPrinted, "x_offset: 0", "x_offset: 5"), {"roi", "offset but no width"});
}

TEST(RosImport, InvalidLensesAreRefusedWithTheLine) {
  expect_refused(with(kWritten, "equidistant", "atan"),
                 {"given:8: distortion_model", "'atan' is unknown", "equidistant", "plumb_bob", "rational_polynomial"});
  expect_refused(with(kWritten, "distortion_model: equidistant\n", ""),
                 {"distortion_model", "is missing", "equidistant"});
  expect_refused(with(kWritten, "data: [286.94962264945976, 0,", "data: [286.94962264945976, 0.5,"),
                 {"given:5: camera_matrix", "skew of 0.5"});
  expect_refused(with(kWritten, "286.94962264945976", ".nan"), {"given:5: camera_matrix", "not finite"});
  // CameraInfo of a camera that has not been calibrated.
  expect_refused(with(kWritten, "286.94962264945976", "0"), {"given:5: camera_matrix", "never calibrated"});
  expect_refused(with(kWritten, "286.69078453656996", "-286"), {"given:5: camera_matrix", "must be positive"});
  expect_refused(with(kWritten, "[286.94962264945976, 0,", "[0,"), {"given:7: camera_matrix.data", "8 numbers"});
  expect_refused(with(kPrinted, "K: [286.94962264945976, ", "K: ["), {"given:8: K", "3 x 3 numbers, it has 8"});
  expect_refused(with(kPrinted, "D: [-0.00917659267037002, ", "D: ["), {"given:7: D", "4 coefficients", "here are 3"});
  expect_refused(with(kWritten, "-0.00917659267037002", ".inf"), {"given:10: distortion_coefficients", "not finite"});
  expect_refused(with(kWritten, "image_width: 848", "image_width: 0"), {"given:1: image_width", "0 x 800"});
  expect_refused(with(kWritten, "image_width: 848\n", ""), {"image_width", "is missing"});
  expect_refused(kWritten + "width: 848\n", {"given:21: width", "has the same meaning as image_width"});
  expect_refused(kWritten + "image_width: 848\n", {"given:21: image_width is there twice"});
  expect_refused(kWritten, {"has one camera", "--camera"}, {{}, 3, {}});
}

}  // namespace
}  // namespace lightwell
