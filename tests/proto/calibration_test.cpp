#include <numbers>

#include <gtest/gtest.h>

#include <lightwell/calibration.hpp>

namespace lightwell {
namespace {

constexpr const char* kPair = R"(
lens {
  width: 640 height: 480
  kannala_brandt { fx: 143 fy: 143 cx: 319.5 cy: 239.5 k1: -0.01 }
  max_angle_deg: 95
}
lens {
  width: 640 height: 480
  double_sphere { fx: 100 fy: 100 cx: 319.5 cy: 239.5 xi: -0.2 alpha: 0.6 }
  max_angle_deg: 95
  pose { qx: 0 qy: 0 qz: 1 qw: 0 }
  photometry { response { kind: SRGB } black_level: 0.01 vignetting: -0.1 saturation: 0.95 }
}
nits_per_unit: 2
)";

std::string refusal(const std::string& text) {
  const auto c = parse_calibration(text, "rig.textproto");
  EXPECT_FALSE(c.ok());
  return c.status().message();
}

TEST(Calibration, AReportIsKeptAndIsNoPartOfTheIdentity) {
  const auto rig = parse_calibration(kPair, "x");
  const auto reported = parse_calibration(std::string(kPair) +
                                              "report { geometry_time_s: 1700000000 rms_px: 0.125 points: 4321 "
                                              "seen_deg: [88.5, 87.5] direction_3_sigma_deg: [0.02, 0.03] "
                                              "photometry_time_s: 1700000001 }",
                                          "x");
  ASSERT_TRUE(rig && reported) << reported.status().message();
  EXPECT_FALSE(rig->report);
  const CalibrationReport expected{1'700'000'000, 0.125, 4321, {88.5, 87.5}, {0.02, 0.03}, 1'700'000'001};
  EXPECT_EQ(reported->report, expected);
  EXPECT_EQ(parse_calibration(calibration_to_text(*reported), "x")->report, expected);
  EXPECT_EQ(calibration_identity(*reported), calibration_identity(*rig));
  EXPECT_EQ(encode_calibration(*reported), encode_calibration(*rig));
}

TEST(Calibration, ASummaryTellsWhatIsCalibrated) {
  const auto rig = parse_calibration(kPair, "x");
  ASSERT_TRUE(rig);
  const CalibrationSummary s = summary_of(*rig, "rig.textproto");
  EXPECT_EQ(s.id, calibration_identity(*rig));
  EXPECT_EQ(s.file, "rig.textproto");
  EXPECT_TRUE(s.absolute);
  EXPECT_FALSE(s.report);
  ASSERT_EQ(s.lenses.size(), 2U);
  EXPECT_EQ(s.lenses[0].model, "kannala_brandt");
  EXPECT_EQ(s.lenses[0].width, 640U);
  EXPECT_EQ(s.lenses[0].height, 480U);
  EXPECT_NEAR(s.lenses[0].max_angle_deg, 95, 1e-9);
  EXPECT_EQ(s.lenses[0].response, "linear");
  EXPECT_FALSE(s.lenses[0].vignetting || s.lenses[0].noise);
  EXPECT_EQ(s.lenses[1].model, "double_sphere");
  EXPECT_EQ(s.lenses[1].response, "srgb");
  EXPECT_TRUE(s.lenses[1].vignetting);
  RigParameters noisy = *rig;
  noisy.lenses[0].photometry.shot_noise = 1e-4;
  noisy.nits_per_unit = 0;
  EXPECT_TRUE(summary_of(noisy, "").lenses[0].noise);
  EXPECT_FALSE(summary_of(noisy, "").absolute);
}

TEST(Calibration, ParsesWithDefaults) {
  const auto rig = parse_calibration(kPair, "x");
  ASSERT_TRUE(rig.ok()) << rig.status().message();
  ASSERT_EQ(rig->lenses.size(), 2U);
  EXPECT_NEAR(rig->lenses[0].max_angle_rad, 95 * std::numbers::pi / 180, 1e-12);
  EXPECT_EQ(rig->lenses[0].pose_cv.rotation.x, upright_lens_cv().x);
  EXPECT_EQ(rig->lenses[0].photometry.saturation, 0.98);
  EXPECT_EQ(rig->lenses[1].photometry.saturation, 0.95);
  EXPECT_EQ(rig->nits_per_unit, 2);
}

TEST(Calibration, UprightLensRotatesCvAxesToProbeAxes) {
  // _cv: x right, y down, z forward; the probe: x right, y up, z back.
  const Quat q = upright_lens_cv();
  EXPECT_EQ(rotate(q, Vec3d{1, 0, 0}), (Vec3d{1, 0, 0}));
  EXPECT_EQ(rotate(q, Vec3d{0, 1, 0}), (Vec3d{0, -1, 0}));
  EXPECT_EQ(rotate(q, Vec3d{0, 0, 1}), (Vec3d{0, 0, -1}));
}

TEST(Calibration, RoundTripThroughTextKeepsTheIdentity) {
  const auto rig = parse_calibration(kPair, "x");
  ASSERT_TRUE(rig.ok());
  const auto back = parse_calibration(calibration_to_text(*rig), "y");
  ASSERT_TRUE(back.ok()) << back.status().message();
  EXPECT_EQ(calibration_identity(*rig), calibration_identity(*back));
  auto other = *rig;
  other.lenses[0].model = KannalaBrandtParameters{143, 143, 319.5, 239.51, -0.01, 0, 0, 0};
  EXPECT_NE(calibration_identity(*rig), calibration_identity(other));
}

TEST(Calibration, RoundTripThroughBytesKeepsTheIdentity) {
  const auto rig = parse_calibration(kPair, "x");
  ASSERT_TRUE(rig.ok());
  const auto back = decode_calibration(encode_calibration(*rig));
  ASSERT_TRUE(back.ok()) << back.status().message();
  EXPECT_EQ(calibration_identity(*rig), calibration_identity(*back));
  EXPECT_EQ(decode_calibration("\xFF").status().code(), StatusCode::data_loss);
  EXPECT_EQ(decode_calibration(encode_calibration({})).status().code(), StatusCode::invalid_argument);
}

TEST(Calibration, ThatIsImpossibleIsRefusedByLensAndField) {
  const std::string lens = "lens { width: 640 height: 480 max_angle_deg: 95 ";
  EXPECT_NE(refusal("").find("one or two lenses"), std::string::npos);
  EXPECT_NE(refusal(lens + "}").find("no camera model"), std::string::npos);
  EXPECT_NE(refusal(lens + "kannala_brandt { fx: 0 fy: 1 } }").find("fx"), std::string::npos);
  EXPECT_NE(refusal(lens + "kannala_brandt { fx: nan fy: 1 } }").find("not finite"), std::string::npos);
  EXPECT_NE(refusal(lens + "kannala_brandt { fx: 100 fy: 100 k1: -0.5 } }").find("stops growing"), std::string::npos);
  EXPECT_NE(refusal(lens + "double_sphere { fx: 1 fy: 1 alpha: 2 } }").find("alpha"), std::string::npos);
  EXPECT_NE(refusal("lens { width: 0 height: 480 max_angle_deg: 95 equirectangular {} }").find("width"),
            std::string::npos);
  EXPECT_NE(refusal("lens { width: 64 height: 48 kannala_brandt { fx: 1 fy: 1 } }").find("max_angle_deg"),
            std::string::npos);
  EXPECT_NE(
      refusal(lens +
              "kannala_brandt { fx: 100 fy: 100 } photometry { response { kind: TABLE inverse: [0, 0.5, 0.4] } } }")
          .find("must increase"),
      std::string::npos);
  const std::string good = lens + "kannala_brandt { fx: 100 fy: 100 } photometry { ";
  EXPECT_NE(refusal(good + "vignetting: -1 } }").find("vignetting"), std::string::npos);
  EXPECT_NE(refusal(good + "response { kind: TABLE inverse: [0.1, 0.9] } } }").find("to 1"), std::string::npos);
  EXPECT_NE(refusal(good + "response { kind: TABLE inverse: [-1, 1] } } }").find("from 0"), std::string::npos);
  EXPECT_NE(refusal(good + "response { kind: GAMMA } } }").find("gamma"), std::string::npos);
  EXPECT_NE(refusal(lens + "kannala_brandt { fx: 100 fy: 100 } pose { tx: 1 } }").find("rotation"), std::string::npos);
}

TEST(Calibration, MisspeltFieldIsReportedWithLineAndNearestName) {
  const std::string m = refusal("lens {\n  width: 640\n  heigth: 480\n}\n");
  EXPECT_NE(m.find("rig.textproto:3:"), std::string::npos) << m;
  EXPECT_NE(m.find("'height'"), std::string::npos) << m;
}

}  // namespace
}  // namespace lightwell
