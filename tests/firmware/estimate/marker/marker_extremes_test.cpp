// The marker estimator on difficult or invalid images, from pixels to descriptor: the result must be refused, flagged
// or right, never wrong without a flag, and never NaN.
#include <cctype>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "firmware/estimate/marker/extreme_scenes.hpp"

namespace lightwell::marker::test {
namespace {

const std::vector<ExtremeCase>& cases() {
  static const std::vector<ExtremeCase> all = extreme_cases(LIGHTWELL_MARKER_BODIES);
  return all;
}

class MarkerExtremes : public testing::TestWithParam<ExtremeCase> {};

TEST_P(MarkerExtremes, IsRefusedOrFlaggedOrRight) {
  const ExtremePicture picture(GetParam());
  for (const std::uint64_t seed : {1U, 2U}) {
    for (const Evaluation& v : picture.evaluate_frames(seed)) {
      EXPECT_NE(v.outcome, Outcome::wrong)
          << v.why << ": off by " << v.error_deg << " deg, sigma " << v.sigma_deg << " deg, seed " << seed;
      if (GetParam().easy) {
        EXPECT_EQ(v.outcome, Outcome::right) << v.why << ": off by " << v.error_deg << " deg, sigma " << v.sigma_deg;
      }
      if (v.outcome == Outcome::refused) {
        EXPECT_GT(v.why.size(), 20U) << "the message is too short to help";
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Each, MarkerExtremes, testing::ValuesIn(cases()),
                         [](const testing::TestParamInfo<ExtremeCase>& one) {
                           std::string name;
                           for (const char c : one.param.name)
                             name += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
                           return name;
                         });

const ExtremeCase& case_of(const std::string& name) {
  for (const ExtremeCase& one : cases())
    if (one.name == name) return one;
  throw std::runtime_error("no case " + name);
}

// Noise differs between formats, and with it the selected surround model. Two estimates may therefore differ by three
// sigma, and each must have the accuracy required for a lamp that illuminates visible faces.
TEST(MarkerFormats, SameSceneGivesTheSameLightInEveryFormat) {
  constexpr double kLampInViewDeg = 3;
  const Evaluation rgb = ExtremePicture(case_of("plain")).worst(1);
  ASSERT_TRUE(rgb.direction.has_value());
  EXPECT_LT(rgb.error_deg, kLampInViewDeg);
  for (const PixelFormat format :
       {PixelFormat::nv12, PixelFormat::yuyv, PixelFormat::bayer_rggb8, PixelFormat::bayer_rggb12}) {
    const Evaluation other = ExtremePicture(case_of("plain, " + std::string(to_string(format)))).worst(1);
    ASSERT_TRUE(other.direction.has_value()) << to_string(format);
    EXPECT_LT(other.error_deg, kLampInViewDeg) << to_string(format);
    EXPECT_LT(angle_between(*rgb.direction, *other.direction) * 180 / std::numbers::pi,
              3 * std::hypot(rgb.sigma_deg, other.sigma_deg))
        << to_string(format);
  }
}

TEST(MarkerBlur, AboveTheLimitOfTheErrorModelIsFlagged) {
  for (const double blur_px : {1.0, 2.0}) {
    ExtremeCase blurred = case_of("plain");
    blurred.blur_px = blur_px;
    const Evaluation v = ExtremePicture(std::move(blurred)).worst(1);
    ASSERT_TRUE(v.report.body.blur_px);
    EXPECT_NEAR(*v.report.body.blur_px, blur_px, 0.3);
    EXPECT_EQ(v.outcome, blur_px > kMaxBlur_px ? Outcome::flagged : Outcome::right) << v.why << ", " << blur_px;
  }
}

TEST(MarkerExtremesRefuse, ImagesWithoutATagOfTheBody) {
  for (const char* name : {"exposure x 1e-4, all black", "mirrored picture", "another body's tags", "noise alone",
                           "floats, none a number"}) {
    const Evaluation v = ExtremePicture(case_of(name)).worst(1);
    EXPECT_EQ(v.outcome, Outcome::refused) << name << ": " << name_of(v.outcome) << ", " << v.why;
  }
}

TEST(EvaluateExtreme, ClassifiesResults) {
  const Vec3d truth{0, 0, 1};
  const auto answer = [](double off_deg, double sigma_deg) {
    Descriptor d;
    d.radiance.band = 1;
    Light light;
    const double off = off_deg * std::numbers::pi / 180, sigma = sigma_deg * std::numbers::pi / 180;
    light.direction = vec_cast<float>(Vec3d{std::sin(off), 0, std::cos(off)});
    light.irradiance = {1, 1, 1};
    light.direction_covariance = {static_cast<float>(sigma * sigma), 0, static_cast<float>(sigma * sigma)};
    light.track = 1;
    d.lights = {light};
    return d;
  };
  EXPECT_EQ(evaluate_extreme({}, answer(2, 1), truth).outcome, Outcome::right);
  EXPECT_EQ(evaluate_extreme({}, answer(4, 1), truth).outcome, Outcome::wrong) << "beyond three sigma";
  EXPECT_EQ(evaluate_extreme({}, answer(12, 8), truth).outcome, Outcome::wrong) << "error too large without a flag";
  Descriptor unsure = answer(12, 1);
  unsure.flags.set(Flag::unsure);
  EXPECT_EQ(evaluate_extreme({}, unsure, truth).outcome, Outcome::flagged);
  Descriptor clipped = answer(4, 1);
  clipped.flags.set(Flag::clipped);
  EXPECT_EQ(evaluate_extreme({}, clipped, truth).outcome, Outcome::wrong) << "clipped concerns energy, not direction";
  Descriptor none = answer(1, 1);
  none.lights[0].irradiance.g = NAN;
  EXPECT_EQ(evaluate_extreme({}, none, truth).outcome, Outcome::wrong);
  none = answer(1, 1);
  none.lights.clear();
  EXPECT_EQ(evaluate_extreme({}, none, truth).outcome, Outcome::wrong) << "no light, and no flag";
  EXPECT_EQ(evaluate_extreme(Status(StatusCode::not_found, "no tag"), {}, truth).outcome, Outcome::refused);
  EXPECT_EQ(evaluate_extreme(Status(StatusCode::data_loss, "?"), {}, truth).outcome, Outcome::wrong);
}

}  // namespace
}  // namespace lightwell::marker::test
