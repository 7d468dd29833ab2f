// Tests of solve_response().
#include "calibration/solve/photometry/response_solver.hpp"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calibration/model/response.hpp"

namespace lightwell::photometry {
namespace {

using ::testing::HasSubstr;

const std::vector<double> kExposures = {0.001, 0.002, 0.004, 0.008, 0.016, 0.032, 0.064};

/// Series of pixels over three decades of light through `curve`, without noise, rounded to 8 bits.
ResponseSamples series(const ResponseCurve& curve, const std::vector<double>& exposures = kExposures,
                       int pixels = 120) {
  ResponseSamples out;
  out.exposures = exposures;
  for (int i = 0; i < pixels; ++i) {
    // Golden-ratio sequence: with uniform steps in log light, different exposures (factors of two) would give equal
    // values.
    const double light = 2 * std::pow(1000.0, std::fmod(0.6180339887 * i, 1.0));
    PixelSeries pixel{i % 3, {}};
    for (const double t : exposures) pixel.values.push_back(std::round(255 * encoded(curve, light * t)) / 255);
    out.pixels.push_back(pixel);
  }
  return out;
}

ResponseCurve gamma_curve(double gamma) {
  ResponseCurve curve;
  curve.kind = ResponseCurve::Kind::gamma;
  curve.gamma = gamma;
  return curve;
}

ResponseCurve srgb() {
  ResponseCurve curve;
  curve.kind = ResponseCurve::Kind::srgb;
  return curve;
}

TEST(ResponseSolver, RecognisesParametricCurves) {
  const auto linear = solve_response(series({}));
  ASSERT_TRUE(linear.ok()) << linear.status().message();
  EXPECT_EQ(linear->response.kind, ResponseCurve::Kind::linear);
  const auto standard = solve_response(series(srgb()));
  ASSERT_TRUE(standard.ok()) << standard.status().message();
  EXPECT_EQ(standard->response.kind, ResponseCurve::Kind::srgb);
  const auto gamma = solve_response(series(gamma_curve(1.6)));
  ASSERT_TRUE(gamma.ok()) << gamma.status().message();
  EXPECT_EQ(gamma->response.kind, ResponseCurve::Kind::gamma);
  EXPECT_NEAR(gamma->response.gamma, 1.6, 0.01);
}

TEST(ResponseSolver, SolvesASingleChannel) {
  ResponseSamples mixed = series(gamma_curve(2.4));
  const ResponseSamples blue = series(gamma_curve(1.5));
  for (std::size_t i = 0; i < mixed.pixels.size(); ++i)
    if (mixed.pixels[i].channel == 2) mixed.pixels[i] = blue.pixels[i];
  for (const int channel : {0, 1, 2}) {
    const auto found = solve_response(mixed, channel);
    ASSERT_TRUE(found.ok()) << found.status().message();
    EXPECT_NEAR(found->response.gamma, channel == 2 ? 1.5 : 2.4, 0.02) << channel;
  }
}

TEST(ResponseSolver, MovingObjectsAreRejected) {
  ResponseSamples samples = series(gamma_curve(1.6));
  for (std::size_t i = 0; i < samples.pixels.size(); i += 20) samples.pixels[i].values[3] = 0.6;
  const auto found = solve_response(samples);
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_NEAR(found->response.gamma, 1.6, 0.01);
  EXPECT_GE(found->outliers, 3);
}

TEST(ResponseSolver, ATableIncreasesFromZeroToFullScaleAndIsValid) {
  ResponseCurve odd;
  odd.kind = ResponseCurve::Kind::table;
  for (int i = 0; i <= 64; ++i) {
    const double v = i / 64.0;
    odd.inverse.push_back(0.25 * v + 1.5 * v * v - 1.6 * v * v * v + 0.85 * std::pow(v, 5));
  }
  const auto found = solve_response(series(odd));
  ASSERT_TRUE(found.ok()) << found.status().message();
  ASSERT_EQ(found->response.kind, ResponseCurve::Kind::table);
  const auto& table = found->response.inverse;
  EXPECT_EQ(table.size(), 256U);
  EXPECT_EQ(table.front(), 0);
  EXPECT_EQ(table.back(), 1);
  EXPECT_TRUE(std::is_sorted(table.begin(), table.end()));
  double squares = 0;
  for (int i = 0; i <= 100; ++i)
    squares += std::pow(linearized(found->response, i / 100.0) - linearized(odd, i / 100.0), 2) / 101;
  EXPECT_LE(std::sqrt(squares), 0.01);
}

std::string refused(const ResponseSamples& samples) {
  const auto found = solve_response(samples);
  EXPECT_FALSE(found.ok());
  EXPECT_EQ(found.status().code(), StatusCode::invalid_argument);
  return found.status().message();
}

TEST(ResponseSolver, RefusesInsufficientExposures) {
  EXPECT_THAT(refused(series(srgb(), {0.01, 0.04})), HasSubstr("take three or more"));
  EXPECT_THAT(refused(series(srgb(), {0.01, 0.01, 0.01, 0.01})), HasSubstr("1 different exposures"));
  EXPECT_THAT(refused(series(srgb(), {0.01, 0.013, 0.017})), HasSubstr("at least four times the shortest"));
  EXPECT_THAT(refused(series(srgb(), {0.01, -0.02, 0.04})), HasSubstr("must be positive"));
  EXPECT_THAT(refused(series(srgb(), {0.01, std::nan(""), 0.04})), HasSubstr("must be positive"));
}

TEST(ResponseSolver, RefusesInsufficientPixels) {
  ResponseSamples same = series(srgb());
  for (PixelSeries& p : same.pixels)
    for (double& v : p.values) v = 0.5;
  EXPECT_THAT(refused(same), HasSubstr("turn off automatic exposure"));
  ResponseSamples white = series(srgb());
  for (PixelSeries& p : white.pixels)
    for (double& v : p.values) v = 1;
  EXPECT_THAT(refused(white), HasSubstr("0 pixels are neither dark nor saturated"));
  ResponseSamples dim = series(srgb());
  for (PixelSeries& p : dim.pixels)
    for (std::size_t j = 0; j < p.values.size(); ++j) p.values[j] = 0.1 + 0.03 * static_cast<double>(j);
  EXPECT_THAT(refused(dim), HasSubstr("of full scale only"));
  EXPECT_THAT(refused(series(srgb(), kExposures, 10)), HasSubstr("20 are needed"));
}

TEST(ResponseSolver, RefusesInvalidSeries) {
  ResponseSamples ragged = series(srgb());
  ragged.pixels[7].values.pop_back();
  EXPECT_THAT(refused(ragged), HasSubstr("6 values for 7 exposures"));
  ResponseSamples broken = series(srgb());
  broken.pixels[7].values[2] = std::nan("");
  EXPECT_THAT(refused(broken), HasSubstr("not finite"));
  ResponseSamples bright = series(srgb());
  bright.dark_value = 0.7;
  EXPECT_THAT(refused(bright), HasSubstr("check the dark pictures"));
}

}  // namespace
}  // namespace lightwell::photometry
