// Tests of patch_mean() and solve_white_balance().
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calibration/solve/photometry/picture.hpp"
#include "firmware/calibration/photometry/simulated_camera.hpp"

namespace lightwell::photometry {
namespace {

using ::testing::HasSubstr;

class Card : public testing::Test {
 protected:
  PhotometricCalibration truth_ = usual_photometry(PixelFormat::rgb8);
  SimulatedCamera camera_{PixelFormat::rgb8, truth_, 11};

  std::string refused(const Picture& picture, const PatchRect& patch) {
    const auto found = patch_mean(picture, patch, truth_, "card.png");
    EXPECT_FALSE(found.ok());
    EXPECT_THAT(found.status().message(), HasSubstr("card.png: "));
    return found.status().message();
  }
};

TEST_F(Card, MeanIsTheLinearValue) {
  const Picture picture = camera_.shoot([](int, int) { return 0.3; }, 1);
  const auto found = patch_mean(picture, {20, 20, 60, 40}, truth_, "card");
  ASSERT_TRUE(found.ok()) << found.status().message();
  for (const double m : found->mean) EXPECT_NEAR(m, 0.3, 0.001);
  EXPECT_EQ(found->count, 2400);
}

TEST_F(Card, ASpeckIsRejected) {
  Picture picture = camera_.shoot([](int, int) { return 0.3; }, 1);
  for (int i = 0; i < 30; ++i)
    picture.rgb[3 * (30UL * SimulatedCamera::kWidth + 30UL + static_cast<std::size_t>(i))] = 0.05F;
  const auto found = patch_mean(picture, {20, 20, 60, 40}, truth_, "card");
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_NEAR(found->mean[0], 0.3, 0.001);
}

TEST_F(Card, AMosaicsPatchIsInPixelsOfThePicture) {
  const PhotometricCalibration truth = usual_photometry(PixelFormat::bayer_rggb12);
  SimulatedCamera camera(PixelFormat::bayer_rggb12, truth, 11);
  const Picture picture = camera.shoot([](int x, int) { return x < 96 ? 0.2 : 0.6; }, 1);
  const auto found = patch_mean(picture, {100, 10, 60, 40}, truth, "card");
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_EQ(found->count, 30 * 20);
  for (const double m : found->mean) EXPECT_NEAR(m, 0.6, 0.002);
}

TEST_F(Card, UnsuitablePatchesAreRefused) {
  const Picture good = camera_.shoot([](int, int) { return 0.3; }, 1);
  EXPECT_THAT(refused(camera_.shoot([](int, int) { return 2.0; }, 1), {20, 20, 60, 40}), HasSubstr("saturated in red"));
  EXPECT_THAT(refused(camera_.shoot([](int, int) { return 0.005; }, 1), {20, 20, 60, 40}),
              HasSubstr("too dark in red"));
  EXPECT_THAT(refused(camera_.shoot([](int x, int) { return x < 50 ? 0.1 : 0.5; }, 1), {20, 20, 60, 40}),
              HasSubstr("not even"));
  EXPECT_THAT(refused(good, {180, 20, 60, 40}), HasSubstr("outside the picture of 192x96"));
  EXPECT_THAT(refused(good, {-1, 20, 60, 40}), HasSubstr("outside"));
  EXPECT_THAT(refused(good, {20, 20, 2147483647, 40}), HasSubstr("outside"));
  EXPECT_THAT(refused(good, {20, 20, 3, 3}), HasSubstr("fewer than 16"));
}

TEST_F(Card, GreenFactorIsOneAndTheIlluminantIsCorrected) {
  const PatchMean card{{0.2, 0.4, 0.3}, {1e-4, 1e-4, 1e-4}, 1000};
  const auto daylight = solve_white_balance(card);
  ASSERT_TRUE(daylight.ok());
  EXPECT_EQ(daylight->factors, (std::array<double, 3>{2, 1, 0.4 / 0.3}));
  // Under CIE illuminant A a grey card is orange: linear Rec. 709 about 1.83, 0.85, 0.16 (Lindbloom's matrices).
  const auto rgb = rgb_of_chromaticity(0.44757, 0.40745);
  ASSERT_TRUE(rgb.ok());
  const auto lamp = solve_white_balance(card, *rgb);
  ASSERT_TRUE(lamp.ok());
  EXPECT_EQ(lamp->factors[1], 1);
  for (const std::size_t c : {0U, 2U})
    EXPECT_NEAR(card.mean[c] * lamp->factors[c] / (*rgb)[c], card.mean[1] / (*rgb)[1], 1e-12)
        << "the balanced card must have the colour of the illuminant";
  const auto d65 = rgb_of_chromaticity(0.31271, 0.32902);
  ASSERT_TRUE(d65.ok());
  for (const double c : *d65) EXPECT_NEAR(c, 1, 0.001);
  EXPECT_FALSE(rgb_of_chromaticity(0.7, 0.3).ok());
  EXPECT_FALSE(rgb_of_chromaticity(0.3, 0).ok());
  EXPECT_FALSE(solve_white_balance({{0, 0.4, 0.3}, {}, 100}).ok());
}

}  // namespace
}  // namespace lightwell::photometry
