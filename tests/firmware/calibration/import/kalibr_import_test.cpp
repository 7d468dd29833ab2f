// Tests of importing Kalibr's camchains: real ones, and errors of invalid ones.
#include <cmath>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "import_checks.hpp"

namespace lightwell {
namespace {

using namespace test;

constexpr double kDegree = std::numbers::pi / 180;

// The left camera of the TUM VI data set, a lens of 195 degrees, pinhole-equidistant: vision.in.tum.de/data/datasets/
// visual-inertial-dataset, as github.com/HTLife/tumvi_fisheye_calib quotes it; the time shift is made up.
const std::string kTumVi = R"(cam0:
  camera_model: pinhole
  distortion_coeffs: [0.0034823894022493434, 0.0007150348452162257, -0.0020532361418706202, 0.00020293673591811182]
  distortion_model: equidistant
  intrinsics: [190.97847715128717, 190.9733070521226, 254.93170605935475, 256.8974428996504]
  resolution: [512, 512]
  rostopic: /cam0/image_raw
  timeshift_cam_imu: 0.00126
)";

// Two fisheyes side by side, ds-none:
// tlab-uav.github.io/tech-details/docs/research/calibration/kalibr-result-conventions.
const std::string kStereo = R"(cam0:
  cam_overlaps: [1]
  camera_model: ds
  distortion_coeffs: []
  distortion_model: none
  intrinsics: [-0.19963086018860057, 0.5924590037637837, 317.552559595926, 316.1745713358917, 724.8551471226007,
    546.5708052642561]
  resolution: [1440, 1080]
  rostopic: /tiscamera_ros/fisheye_left/image_rect_raw
cam1:
  T_cn_cnm1:
  - [0.9994397899015358, 0.01583231520610129, 0.029486338477008038, -0.1982100882850154]
  - [-0.014069141538300084, 0.9981545353408604, -0.05907269110882186, -0.003226884424352984]
  - [-0.03036717994712894, 0.05862475052124023, 0.9978181061738522, 0.0003909535695235701]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [0]
  camera_model: ds
  distortion_coeffs: []
  distortion_model: none
  intrinsics: [-0.19567833352036393, 0.5934771139662725, 318.54033139830346, 317.0520130252999, 712.7496608380312,
    557.2224352962965]
  resolution: [1440, 1080]
  rostopic: /tiscamera_ros/fisheye_right/image_rect_raw
)";

// Transforms a point from a camera's frame to the probe frame, by the convention of calibration.proto.
Vec3d in_probe(const LensParameters& lens, Vec3d p) {
  return rotate(lens.pose_cv.rotation, p) + lens.pose_cv.translation;
}

TEST(KalibrImport, ADoubleSphereLandsOnKalibrsPixels) {
  const ImportedCalibration in = imported(kStereo);
  expect_same_pixels(in.rig.lenses[0], double_sphere(-0.19963086018860057, 0.5924590037637837, 317.552559595926,
                                                     316.1745713358917, 724.8551471226007, 546.5708052642561));
  expect_same_pixels(in.rig.lenses[1], double_sphere(-0.19567833352036393, 0.5934771139662725, 318.54033139830346,
                                                     317.0520130252999, 712.7496608380312, 557.2224352962965));
  EXPECT_TRUE(noted(in, "not a pair back to back")) << "the axes are 3.8 degrees apart";
}

TEST(KalibrImport, AnEquidistantLensOf195DegreesLandsOnKalibrsPixels) {
  ImportOptions options;
  options.max_angle_rad = 97.5 * kDegree;
  const ImportedCalibration in = imported(kTumVi, options);
  EXPECT_DOUBLE_EQ(in.rig.lenses[0].max_angle_rad, 97.5 * kDegree);
  expect_same_pixels(
      in.rig.lenses[0],
      fisheye(190.97847715128717, 190.9733070521226, 254.93170605935475, 256.8974428996504,
              {0.0034823894022493434, 0.0007150348452162257, -0.0020532361418706202, 0.00020293673591811182}));
  EXPECT_TRUE(noted(in, "extrapolation")) << "Kalibr's pinhole only uses points with z > 0";
  EXPECT_TRUE(noted(in, "timeshift_cam_imu 0.00126 s"));
}

TEST(KalibrImport, OneCameraLooksAlongMinusZWithItsPictureUpright) {
  const LensParameters lens = imported(kTumVi).rig.lenses[0];
  EXPECT_LT(length(in_probe(lens, {0, 0, 1}) - Vec3d{0, 0, -1}), 1e-15);
  EXPECT_LT(length(in_probe(lens, {1, 0, 0}) - Vec3d{1, 0, 0}), 1e-15) << "right in the picture is +X";
  EXPECT_LT(length(in_probe(lens, {0, 1, 0}) - Vec3d{0, -1, 0}), 1e-15) << "down in the picture is -Y";
}

// Constructed by hand: lens 1 is 10 cm to the right of lens 0 and looks to the right. The rows of its rotation are its
// axes in lens 0's frame: x is backward, y down, z right. t = -R (0.1, 0, 0).
TEST(KalibrImport, TheChainMapsTheFirstCamerasPointsIntoTheSeconds) {
  const std::string text = with(
      with(with(with(kStereo, "[0.9994397899015358, 0.01583231520610129, 0.029486338477008038, -0.1982100882850154]",
                     "[0, 0, -1, 0]"),
                "[-0.014069141538300084, 0.9981545353408604, -0.05907269110882186, -0.003226884424352984]",
                "[0, 1, 0, 0]"),
           "[-0.03036717994712894, 0.05862475052124023, 0.9978181061738522, 0.0003909535695235701]", "[1, 0, 0, -0.1]"),
      "rostopic", "# rostopic");
  const LensParameters lens = imported(text).rig.lenses[1];
  EXPECT_LT(length(rotate(lens.pose_cv.rotation, Vec3d{0, 0, 1}) - Vec3d{1, 0, 0}), 1e-12) << "looks along +X";
  EXPECT_LT(length(rotate(lens.pose_cv.rotation, Vec3d{0, 1, 0}) - Vec3d{0, -1, 0}), 1e-12) << "upright";
  EXPECT_LT(length(lens.pose_cv.translation - Vec3d{0.05, 0, 0}), 1e-12) << "half of 10 cm towards +X";
}

TEST(KalibrImport, EveryHalfTurnBecomesItsQuaternion) {
  // The trace of a half turn is -1: the quaternion's w is zero and must not be used as a divisor.
  for (const char* axes : {"1 -1 -1", "-1 1 -1", "-1 -1 1"}) {
    double x = 0, y = 0, z = 0;
    ASSERT_EQ(std::sscanf(axes, "%lf %lf %lf", &x, &y, &z), 3);
    std::string text = kStereo.substr(0, kStereo.find("  T_cn_cnm1"));
    text += "  T_cn_cnm1: [[" + std::to_string(x) + ", 0, 0, 0], [0, " + std::to_string(y) + ", 0, 0], [0, 0, " +
            std::to_string(z) + ", 0], [0, 0, 0, 1]]\n" + kStereo.substr(kStereo.find("  cam_overlaps: [0]"));
    const ImportedCalibration in = imported(text);
    const Vec3d p{0.3, -0.5, 0.8};
    EXPECT_LT(length(in_probe(in.rig.lenses[0], p) - in_probe(in.rig.lenses[1], {x * p.x, y * p.y, z * p.z})), 1e-12)
        << axes;
  }
}

TEST(KalibrImport, EucmIsImportedIfBetaIsOne) {
  const std::string eucm = R"(cam0:
  camera_model: eucm
  distortion_model: none
  intrinsics: [0.6, 1.0, 230.5, 231.5, 320.25, 239.5]
  resolution: [640, 480]
)";
  // Khomutenko et al. 2016: x / (alpha rho + (1 - alpha) z), rho² = beta (x² + y²) + z².
  expect_same_pixels(imported(eucm).rig.lenses[0], [](double x, double y, double z) -> Pixel {
    const double below = 0.6 * std::sqrt(1.0 * (x * x + y * y) + z * z) + 0.4 * z;
    return {230.5 * x / below + 320.25, 231.5 * y / below + 239.5};
  });
  expect_refused(with(eucm, "1.0,", "1.1,"), {"given:2: cam0.camera_model", "ellipsoid", "beta 1.1", "pinhole-equi"});
}

TEST(KalibrImport, InvalidLensesAreRefusedWithTheLine) {
  expect_refused(with(kTumVi, "190.97847715128717", ".nan"), {"given:5: cam0.intrinsics", "not finite"});
  expect_refused(with(kTumVi, "190.97847715128717", "-190.9"), {"given:5: cam0.intrinsics", "must be positive"});
  expect_refused(with(kTumVi, "190.97847715128717, ", ""),
                 {"given:5: cam0.intrinsics", "4 numbers, fu fv pu pv", "it has 3"});
  expect_refused(with(kTumVi, "190.97847715128717", "wide"), {"given:5: cam0.intrinsics", "list of numbers"});
  expect_refused(with(kTumVi, "0.0034823894022493434, ", ""),
                 {"given:3: cam0.distortion_coeffs", "k1 k2 k3 k4", "it has 3"});
  expect_refused(with(kTumVi, "0.0034823894022493434", ".inf"), {"given:3: cam0.distortion_coeffs", "not finite"});
  expect_refused(with(kTumVi, "[512, 512]", "[0, 512]"), {"given:6: cam0.resolution", "0 x 512"});
  expect_refused(with(kTumVi, "[512, 512]", "[512.5, 512]"), {"given:6: cam0.resolution", "whole numbers"});
  expect_refused(with(kTumVi, "  resolution: [512, 512]\n", ""), {"given:2: cam0.resolution", "is missing"});
  expect_refused(with(kTumVi, "  camera_model: pinhole\n", ""), {"cam0.camera_model", "is missing"});
  expect_refused(with(kTumVi, "pinhole", "fisheye"),
                 {"given:2: cam0.camera_model", "'fisheye' is unknown", "pinhole", "ds", "omni", "eucm"});
  expect_refused(with(kTumVi, "equidistant", "kb4"),
                 {"given:4: cam0.distortion_model", "'kb4' is unknown", "equidistant, radtan, none"});
  expect_refused(with(kTumVi, "equidistant", "fov"), {"given:4: cam0.distortion_model", "FOV model", "pinhole-equi"});
  expect_refused(with(kTumVi, "equidistant", "none"), {"given:3: cam0.distortion_coeffs", "none has no coefficients"});
  expect_refused(with(kTumVi, "0.00126", "soon"), {"given:8: cam0.timeshift_cam_imu", "'soon' is not a number"});
  expect_refused(with(kStereo, "0.5924590037637837", "1.5"),
                 {"given:6: cam0.intrinsics", "alpha from 0 to 1", "xi alpha fu fv pu pv"});
  expect_refused(with(kStereo, "distortion_coeffs: []", "distortion_coeffs: [0.1]"),
                 {"given:4: cam0.distortion_coeffs"});
}

TEST(KalibrImport, BrokenYamlIsRefusedWithItsLine) {
  ImportOptions kalibr;
  kalibr.kind = ImportKind::kalibr;
  expect_refused("cam0:\n  intrinsics: [1, 2\n", {"given:3: not YAML"}, kalibr);
  expect_refused("cam0:\n  intrinsics: [1, 2\n", {"given:3: not YAML"});
  expect_refused("just words", {"no YAML with fields"}, kalibr);
  expect_refused("cam0: 5\n", {"given:1: cam0", "fields of its own"}, kalibr);
  expect_refused("camera0: {}\n", {"no cam0"}, kalibr);
}

TEST(AnyImport, UnknownFormatsAreRefusedWithTheKnownNames) {
  expect_refused("lens { width: 3 }", {"opencv", "kalibr", "ros", "--kind"});
  expect_refused("some: field\n", {"opencv", "kalibr", "ros", "--kind"});
  expect_refused("", {"is empty"});
  expect_refused(" \n\n", {"is empty"});
  for (const char* begin : {"%YAML:1.0\n---\na: ", "cam0: ", "<?xml version=\"1.0\"?>\n<opencv_storage>"})
    for (const char* level : {"[", "{a: ", "- ", "<a>"}) {
      std::string deep = begin;
      for (int i = 0; i < 200'000; ++i) deep += level;
      expect_refused(deep, {"nests deeper"});
    }
  expect_refused(kTumVi, {"not a file of cv::FileStorage"}, {ImportKind::opencv, {}, {}});
  expect_refused(kTumVi, {"image_width", "is missing"}, {ImportKind::ros, {}, {}});
}

}  // namespace
}  // namespace lightwell
