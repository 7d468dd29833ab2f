// Tests of importing files of cv::omnidir as written by OpenCV's sample.
#include <array>
#include <numbers>
#include <string>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "import_checks.hpp"

namespace lightwell {
namespace {

using namespace test;

constexpr double kDegree = std::numbers::pi / 180;

// A left fisheye of KITTI-360 (calibration/image_02.yaml, xi, k1 k2 p1 p2, gamma and centre), in the fields of
// opencv_contrib's omni_calibration.cpp; the size is not among them.
constexpr double kKittiXi = 2.2134047507854890;
constexpr std::array<double, 9> kKittiK{
    1336.3220825849971, 0, 716.94323510126321, 0, 1335.7883350012958, 705.76498308221585, 0, 0, 1};
constexpr std::array<double, 4> kKittiD{0.016798235660113681, 1.6548773243373522, 0.00042223943394772046,
                                        0.00042462134260997584};
Formula kitti() {
  return omni(kKittiXi, kKittiK[0], kKittiK[4], kKittiK[2], kKittiK[5],
              {kKittiD[0], kKittiD[1], kKittiD[2], kKittiD[3]});
}

/// Written with OpenCV like saveCameraParams() of omni_calibration.cpp; `with_size` adds the picture size, which that
/// omits.
std::string omni_sample(const std::string& extension, bool with_size) {
  cv::FileStorage fs(extension, cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
  fs << "calibration_time"
     << "now";
  fs << "nFrames" << 20;
  fs << "flags" << 2;
  fs << "camera_matrix" << cv::Mat(3, 3, CV_64F, const_cast<double*>(kKittiK.data()));
  fs << "distortion_coefficients" << cv::Mat(1, 4, CV_64F, const_cast<double*>(kKittiD.data()));
  fs << "xi" << kKittiXi;
  fs << "used_imgs"
     << "["
     << "a.png"
     << "b.png"
     << "]";
  fs << "image_points" << cv::Mat(2, 3, CV_64FC2, cv::Scalar(3, 4));
  if (with_size) fs << "image_width" << 1400 << "image_height" << 1400;
  return fs.releaseAndGetString();
}

TEST(OpenCvImport, AnOmnidirLensLandsOnOpenCvsPixelsFromYamlAndXml) {
  for (const char* extension : {".yml", ".xml"}) {
    const ImportedCalibration in = imported(omni_sample(extension, true));
    EXPECT_EQ(in.kind, ImportKind::opencv);
    EXPECT_GT(in.rig.lenses[0].max_angle_rad, 90 * kDegree) << extension;
    expect_same_pixels(in.rig.lenses[0], kitti());
  }
}

TEST(OpenCvImport, ReportsTheSizeMissingInTheOmnidirSample) {
  for (const char* extension : {".yml", ".xml"})
    expect_refused(omni_sample(extension, false), {"image_width", "is missing", "add image_width and image_height"});
}

}  // namespace
}  // namespace lightwell
