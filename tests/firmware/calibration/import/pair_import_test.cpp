// Tests of importing a real pair back to back, an Insta360 Air: poses of both lenses.
#include <cmath>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "import_checks.hpp"

namespace lightwell {
namespace {

using namespace test;

constexpr double kDegree = std::numbers::pi / 180;

// An Insta360 Air, both lenses, omni-radtan: github.com/tu-darmstadt-ros-pkg/image_projection,
// image_projection_demo/config/insta360_3_omni_radtan_calibration/cameras.yaml (MIT), as cam0 and cam1 of a camchain.
const std::string kInsta360 = R"(cam0:
  cam_overlaps: [1]
  camera_model: omni
  distortion_coeffs: [-0.25005483726150773, 0.15486545863797438, 0.0006619539678191391,
    0.004799650294887792]
  distortion_model: radtan
  intrinsics: [1.7503827001298708, 1280.9434853010955, 1280.346616094328, 744.18018744745,
    749.338173173202]
  resolution: [1504, 1504]
  rostopic: /camera360/left/image_raw
cam1:
  T_cn_cnm1:
  - [-0.9997050511222031, -0.02400871520926141, 0.0036595566338969284, 0.002862424041614364]
  - [-0.024013374006924392, 0.9997108751856715, -0.0012344651898040843, -0.00013127655875068252]
  - [-0.003628860642086871, -0.0013219793878309586, -0.9999925418426584, -0.03724378451297336]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [0]
  camera_model: omni
  distortion_coeffs: [-0.24474849399382448, 0.11004932449100978, -0.0018675969866192542,
    -0.0006350936498199472]
  distortion_model: radtan
  intrinsics: [1.7606284224437654, 1290.9565264821358, 1290.891371280236, 760.0476913711201,
    752.0428920983152]
  resolution: [1504, 1504]
  rostopic: /camera360/right/image_raw
)";

// Transforms a point from a camera's frame to the probe frame, by the convention of calibration.proto.
Vec3d in_probe(const LensParameters& lens, Vec3d p) {
  return rotate(lens.pose_cv.rotation, p) + lens.pose_cv.translation;
}

TEST(PairImport, BothLensesOfAnInsta360LandOnKalibrsPixels) {
  const ImportedCalibration in = imported(kInsta360);
  ASSERT_EQ(in.kind, ImportKind::kalibr);
  ASSERT_EQ(in.rig.lenses.size(), 2u);
  EXPECT_EQ(in.cameras, (std::vector<std::string>{"cam0", "cam1"}));
  EXPECT_EQ(in.rig.lenses[0].width, 1504);
  for (const LensParameters& lens : in.rig.lenses)
    EXPECT_GT(lens.max_angle_rad, 95 * kDegree) << "more than half the sphere";
  expect_same_pixels(in.rig.lenses[0],
                     omni(1.7503827001298708, 1280.9434853010955, 1280.346616094328, 744.18018744745, 749.338173173202,
                          {-0.25005483726150773, 0.15486545863797438, 0.0006619539678191391, 0.004799650294887792}));
  expect_same_pixels(
      in.rig.lenses[1],
      omni(1.7606284224437654, 1290.9565264821358, 1290.891371280236, 760.0476913711201, 752.0428920983152,
           {-0.24474849399382448, 0.11004932449100978, -0.0018675969866192542, -0.0006350936498199472}));
}

TEST(PairImport, APointSeenByBothLensesIsOnePointOfTheProbe) {
  const ImportedCalibration in = imported(kInsta360);
  // p_c1 = T_cn_cnm1 p_c0, with the values of the file.
  const auto second = [](Vec3d p) {
    return Vec3d{
        -0.9997050511222031 * p.x - 0.02400871520926141 * p.y + 0.0036595566338969284 * p.z + 0.002862424041614364,
        -0.024013374006924392 * p.x + 0.9997108751856715 * p.y - 0.0012344651898040843 * p.z - 0.00013127655875068252,
        -0.003628860642086871 * p.x - 0.0013219793878309586 * p.y - 0.9999925418426584 * p.z - 0.03724378451297336};
  };
  for (const Vec3d p : {Vec3d{0, 0, 0}, Vec3d{1, 0.2, 0.01}, Vec3d{-0.3, 2, -0.4}, Vec3d{0.5, -0.7, 3}})
    EXPECT_LT(length(in_probe(in.rig.lenses[0], p) - in_probe(in.rig.lenses[1], second(p))), 1e-9) << p.x;
}

TEST(PairImport, ThePairsOriginIsMidwayAndMinusZIsTheFirstLensesAxis) {
  const ImportedCalibration in = imported(kInsta360);
  const Vec3d first = in.rig.lenses[0].pose_cv.translation, second = in.rig.lenses[1].pose_cv.translation;
  EXPECT_LT(length(first + second), 1e-15);
  EXPECT_NEAR(length(first - second), 0.0373, 1e-4) << "m, the thickness of the camera";
  EXPECT_LT(first.z, -0.018) << "lens 0 is in front, towards -Z";
  EXPECT_LT(length(rotate(in.rig.lenses[0].pose_cv.rotation, Vec3d{0, 0, 1}) - Vec3d{0, 0, -1}), 1e-15);
  EXPECT_LT(angle_between(rotate(in.rig.lenses[1].pose_cv.rotation, Vec3d{0, 0, 1}), Vec3d{0, 0, 1}), 0.3 * kDegree)
      << "lens 1 looks along +Z";
}

TEST(PairImport, OneCameraOfAChainCanBeChosen) {
  ImportOptions options;
  options.camera = 1;
  const ImportedCalibration in = imported(kInsta360, options);
  ASSERT_EQ(in.rig.lenses.size(), 1u);
  EXPECT_EQ(in.cameras, std::vector<std::string>{"cam1"});
  EXPECT_EQ(std::get<MeiParameters>(in.rig.lenses[0].model).cx, 760.0476913711201);
  EXPECT_EQ(length(in.rig.lenses[0].pose_cv.translation), 0);
  EXPECT_TRUE(noted(in, "T_cn_cnm1"));
  options.camera = 2;
  expect_refused(kInsta360, {"no cam2; there is cam0, cam1"}, options);
}

TEST(PairImport, OmniWithoutDistortionIsTheUnifiedModel) {
  const std::string text =
      with(with(kInsta360.substr(0, kInsta360.find("cam1:")), "radtan", "none"),
           "[-0.25005483726150773, 0.15486545863797438, 0.0006619539678191391,\n    0.004799650294887792]", "[]");
  expect_same_pixels(imported(text).rig.lenses[0], omni(1.7503827001298708, 1280.9434853010955, 1280.346616094328,
                                                        744.18018744745, 749.338173173202, {}));
}

TEST(PairImport, InvalidPairsAreRefused) {
  expect_refused(with(kInsta360, "-0.9997050511222031", "0.9997050511222031"), {"cam1.T_cn_cnm1", "no rotation"});
  expect_refused(with(kInsta360, "-0.9997050511222031", ".nan"), {"cam1.T_cn_cnm1", "not finite"});
  expect_refused(with(kInsta360, "- [0.0, 0.0, 0.0, 1.0]", "- [0.0, 0.0, 1.0, 1.0]"), {"cam1.T_cn_cnm1", "last row"});
  expect_refused(with(kInsta360, "  - [0.0, 0.0, 0.0, 1.0]\n", ""), {"cam1.T_cn_cnm1", "3 rows"});
  expect_refused(with(kInsta360, "T_cn_cnm1:", "T_cn_cnm2:"), {"cam1.T_cn_cnm1", "is missing", "--camera"});
  expect_refused(with(kInsta360, "cam1:", "cam2:"), {"cam0, cam2", "are not consecutive", "--camera"});
  expect_refused(kInsta360 + "cam2: {}\n", {"3 cameras (cam0, cam1, cam2)", "--camera"});
  expect_refused(with(kInsta360, "cam1:", "cam0:"), {"given:11: cam0 is there twice"});
  // Determinant -1: a half turn with a reflection.
  const std::string rows = R"(  - [-1, 0, 0, 0]
  - [0, 1, 0, 0]
  - [0, 0, 1, 0]
)";
  const auto from = kInsta360.find("  - [-0.99970505"), to = kInsta360.find("  - [0.0, 0.0, 0.0, 1.0]");
  expect_refused(kInsta360.substr(0, from) + rows + kInsta360.substr(to), {"given:13: cam1.T_cn_cnm1", "mirrors"});
}

TEST(PairImport, AnXiBelowZeroIsRefused) {
  expect_refused(with(kInsta360, "1.7503827001298708", "-1"), {"given:7: cam0.intrinsics", "xi must be zero or more"});
}

}  // namespace
}  // namespace lightwell
