// Tests of response.hpp: encoded() and linearized() are inverse; black and full scale are exact.
#include "calibration/model/response.hpp"

#include <gtest/gtest.h>

namespace lightwell {
namespace {

ResponseCurve curve(ResponseCurve::Kind kind) {
  ResponseCurve response;
  response.kind = kind;
  if (kind == ResponseCurve::Kind::gamma) response.gamma = 2.2;
  if (kind == ResponseCurve::Kind::table) response.inverse = {0, 0.02, 0.1, 0.1001, 0.4, 1};
  return response;
}

class ResponseTest : public testing::TestWithParam<ResponseCurve::Kind> {};

TEST_P(ResponseTest, EncodedUndoesLinearized) {
  const ResponseCurve response = curve(GetParam());
  for (int i = 0; i <= 1000; ++i) {
    const double v = i / 1000.0;
    // The table has a section with slope 5e-4, which amplifies rounding errors by 2,000.
    EXPECT_NEAR(encoded(response, linearized(response, v)), v, 1e-11) << v;
  }
}

TEST_P(ResponseTest, EndsStayAndNothingLeavesThem) {
  const ResponseCurve response = curve(GetParam());
  EXPECT_NEAR(linearized(response, 0), 0, 1e-15);
  EXPECT_NEAR(linearized(response, 1), 1, 1e-15);
  EXPECT_EQ(linearized(response, 2), linearized(response, 1));
  EXPECT_EQ(encoded(response, -1), encoded(response, 0));
  EXPECT_EQ(encoded(response, 5), encoded(response, 1));
}

INSTANTIATE_TEST_SUITE_P(Kinds, ResponseTest,
                         testing::Values(ResponseCurve::Kind::linear, ResponseCurve::Kind::srgb,
                                         ResponseCurve::Kind::table, ResponseCurve::Kind::gamma));

TEST(Response, MiddleGreyOfSrgbIsTwentyOnePercent) {
  // IEC 61966-2-1: ((0.5 + 0.055) / 1.055)^2.4.
  EXPECT_NEAR(linearized(curve(ResponseCurve::Kind::srgb), 0.5), 0.21404, 1e-5);
}

TEST(LinearTable, BlackBecomesZeroAndFullScaleOne) {
  PhotometricCalibration p;
  p.black_level = 64.0 / 1023;
  const std::vector<float> table = linear_table(p, 1024);
  ASSERT_EQ(table.size(), 1024U);
  EXPECT_NEAR(table[64], 0, 1e-7);
  EXPECT_FLOAT_EQ(table[1023], 1);
  EXPECT_LT(table[0], 0) << "values below black must be negative, so that noise has mean zero";
  EXPECT_NEAR(table[64 + 100] * (1023 - 64), 100, 1e-4);
}

TEST(Vignetting, IsOneOnTheAxisAndNeverDark) {
  PhotometricCalibration p;
  EXPECT_EQ(vignetting(p, 1.5), 1);
  p.vignetting = {-0.1, 0.02, -0.001};
  EXPECT_EQ(vignetting(p, 0), 1);
  EXPECT_NEAR(vignetting(p, 2), 1 - 0.4 + 0.32 - 0.064, 1e-15);
  p.vignetting = {-1, 0, 0};
  EXPECT_EQ(vignetting(p, 3), 0.05);
}

}  // namespace
}  // namespace lightwell
