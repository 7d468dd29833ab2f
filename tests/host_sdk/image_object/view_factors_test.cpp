// Base colour and relative luminance (equations 3 to 7).
#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/image_object_encoder.hpp>

#include "host_sdk/image_object/matte_ball.hpp"

namespace lightwell::test {
namespace {

using testing::HasSubstr;

ViewFactors factors_of(const Ball& ball, BaseColor base) {
  auto factors = factor_view(ball.rig, ball.pictures(), base);
  EXPECT_TRUE(factors.ok()) << factors.status().message();
  return *factors;
}

std::vector<Radiance> product(const ViewFactors& f, std::size_t light) {
  std::vector<Radiance> out(f.base.size());
  for (std::size_t p = 0; p < out.size(); ++p) {
    const float white = f.highlight.empty() ? 0 : f.highlight[light][p];
    out[p] = f.base[p] * (f.luminance[light][p] - white) + f.second[p] * (white * f.base[p].luminance());
  }
  return out;
}

double largest_chroma(const ViewFactors& f) {
  double largest = 0;
  for (const Radiance& p : f.base)
    largest = std::max({largest, std::abs(0.5389 * static_cast<double>(p.b - p.luminance())),
                        std::abs(0.6350 * static_cast<double>(p.r - p.luminance()))});
  return largest;
}

TEST(ViewFactors, OfMatteObjectReproduceEachPicture) {
  const Ball ball;
  const ViewFactors f = factors_of(ball, BaseColor::ambient);
  for (std::size_t i = 0; i < ball.lit.size(); ++i) EXPECT_LT(rms(product(f, i), ball.lit[i]), 1e-6) << i;
}

TEST(ViewFactors, BaseHasTheLargestLuminanceOfThePicturesAndTheColourOfTheAmbientPicture) {
  const Ball ball;
  const ViewFactors f = factors_of(ball, BaseColor::ambient);
  const std::size_t p = Ball::kSide * (Ball::kSide / 2) + Ball::kSide / 2;
  float brightest = 0;
  for (const auto& picture : ball.lit) brightest = std::max(brightest, picture[p].luminance());
  EXPECT_FLOAT_EQ(f.base[p].luminance(), brightest);
  EXPECT_NEAR(f.base[p].r / f.base[p].g, ball.ambient[p].r / ball.ambient[p].g, 1e-5);
}

TEST(ViewFactors, ReduceTheBaseWhereChromaWouldOverflow) {
  Ball ball;
  for (auto& picture : ball.lit)
    for (Radiance& p : picture) p = p * 20;
  const ViewFactors f = factors_of(ball, BaseColor::ambient);
  EXPECT_GT(f.reduced, 0U);
  EXPECT_LE(largest_chroma(f), 0.5 + 1e-6);
  // The relative luminance is then above 1, and the picture is still the same.
  EXPECT_LT(rms(product(f, 10), ball.lit[10]), 1e-5);
}

TEST(ViewFactors, ReduceNothingWhereChromaFits) {
  const ViewFactors f = factors_of(Ball(), BaseColor::ambient);
  EXPECT_EQ(f.reduced, 0U);
}

TEST(ViewFactors, WithBlackAmbientPictureUseTheMeanOfTheOthers) {
  Ball ball;
  std::fill(ball.ambient.begin(), ball.ambient.end(), Radiance{});
  const ViewFactors f = factors_of(ball, BaseColor::ambient);
  EXPECT_LT(rms(product(f, 5), ball.lit[5]), 1e-6);
}

TEST(ViewFactors, OfPixelThatNoLightReachesAreBlack) {
  Ball ball;
  for (auto& picture : ball.lit) picture[700] = {};
  const ViewFactors f = factors_of(ball, BaseColor::highlights);
  EXPECT_EQ(f.base[700], Radiance{});
  EXPECT_EQ(f.luminance[3][700], 0);
}

TEST(ViewFactors, WithHighlightsReproduceGlossThatOneBaseColourCannot) {
  const Ball ball(21, 0.8F);
  double one = 0, two = 0;
  const ViewFactors single = factors_of(ball, BaseColor::ambient), both = factors_of(ball, BaseColor::highlights);
  for (std::size_t i = 0; i < ball.lit.size(); ++i) {
    one += rms(product(single, i), ball.lit[i]);
    two += rms(product(both, i), ball.lit[i]);
  }
  EXPECT_LT(two, 0.1 * one);
}

TEST(ViewFactors, OfMatteObjectHaveNoHighlights) {
  const ViewFactors f = factors_of(Ball(), BaseColor::highlights);
  for (const auto& picture : f.highlight)
    for (const float h : picture) EXPECT_LT(h, 1e-3);
}

Status refusal(const Ball& ball, const ViewPictures& pictures) {
  const auto made = encode_view(ball.rig, pictures, kFine);
  EXPECT_FALSE(made.ok());
  return made.status();
}

TEST(ViewPictures, WithoutPictureOfALightAreRefusedByItsNumber) {
  const Ball ball;
  ViewPictures pictures = ball.pictures();
  pictures.lit.pop_back();
  EXPECT_THAT(refusal(ball, pictures).message(), HasSubstr("light position 20 is missing"));
  pictures.lit.clear();
  EXPECT_THAT(refusal(ball, pictures).message(), HasSubstr("light position 0 is missing"));
}

TEST(ViewPictures, OfUnequalSizeAreRefused) {
  const Ball ball;
  ViewPictures pictures = ball.pictures();
  pictures.lit[4] = pictures.lit[4].first(100);
  EXPECT_THAT(refusal(ball, pictures).message(), HasSubstr("light position 4 has 100 pixels instead of 1600"));
  pictures = ball.pictures();
  pictures.coverage = pictures.coverage.first(3);
  EXPECT_THAT(refusal(ball, pictures).message(), HasSubstr("the coverage has 3 pixels"));
}

TEST(ViewPictures, WithNanNegativeOrHugeValuesAreRefused) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), -0.1F, 2e4F}) {
    Ball ball;
    ball.lit[2][7].g = bad;
    EXPECT_THAT(refusal(ball, ball.pictures()).message(), HasSubstr("light position 2: pixel 7"));
    ball = Ball();
    ball.ambient[9].b = bad;
    EXPECT_THAT(refusal(ball, ball.pictures()).message(), HasSubstr("the ambient picture: pixel 9"));
  }
}

TEST(ObjectRig, RefusesWhatCannotBeCaptured) {
  const auto message = [](const auto& change) {
    Ball ball;
    change(ball.rig);
    const Status status = ball.rig.validate();
    EXPECT_EQ(status.code(), StatusCode::invalid_argument);
    return status.message();
  };
  EXPECT_THAT(message([](ObjectRig& r) { r.light_positions.clear(); }), HasSubstr("light_positions is a list of 0"));
  EXPECT_THAT(message([](ObjectRig& r) { r.light_positions[3] = {}; }),
              HasSubstr("position 3 is at the object's origin"));
  EXPECT_THAT(message([](ObjectRig& r) { r.turns_rad.clear(); }), HasSubstr("turns_rad is a list of 0"));
  EXPECT_THAT(message([](ObjectRig& r) { r.columns = 5000; }), HasSubstr("columns is 5000"));
  EXPECT_THAT(message([](ObjectRig& r) { r.reference_irradiance = 0; }), HasSubstr("reference_irradiance"));
}

TEST(ObjectEncoderOptions, RefuseStepsOutOfRange) {
  EXPECT_TRUE(ObjectEncoderOptions{}.validate().ok());
  EXPECT_TRUE((ObjectEncoderOptions{0.1F, 0, 0.1F}).validate().ok());
  EXPECT_THAT((ObjectEncoderOptions{0, 0.1F, 0.1F}).validate().message(), HasSubstr("luminance_step"));
  EXPECT_THAT((ObjectEncoderOptions{0.1F, 2, 0.1F}).validate().message(), HasSubstr("highlight_step"));
  EXPECT_THAT((ObjectEncoderOptions{0.1F, 0.1F, 0}).validate().message(), HasSubstr("base_step"));
}

}  // namespace
}  // namespace lightwell::test
