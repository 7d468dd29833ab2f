// Tests of choose_samples() and picture_of().
#include <cmath>
#include <cstring>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calibration/solve/photometry/response_solver.hpp"
#include "firmware/calibration/photometry/simulated_camera.hpp"

namespace lightwell::photometry {
namespace {

using ::testing::HasSubstr;

class Extraction : public testing::Test {
 protected:
  SimulatedCamera camera_{PixelFormat::rgb8, usual_photometry(PixelFormat::rgb8), 21};
  std::vector<double> exposures_{0.001, 0.004, 0.016, 0.064};

  std::vector<Picture> series() {
    std::vector<Picture> out;
    for (const double t : exposures_) out.push_back(camera_.shoot(shades, t));
    return out;
  }
};

TEST_F(Extraction, ChoosesAllBrightnessClassesAndChannels) {
  const auto samples = choose_samples(series(), exposures_, 0, 0.98);
  ASSERT_TRUE(samples.ok()) << samples.status().message();
  EXPECT_GE(samples->pixels.size(), 300U);
  EXPECT_LE(samples->pixels.size(), 600U);
  int dark = 0, bright = 0, of_channel[3] = {};
  for (const PixelSeries& p : samples->pixels) {
    dark += p.values[3] < 0.5 ? 1 : 0;
    bright += p.values[0] > 0.5 ? 1 : 0;
    ++of_channel[p.channel];
  }
  EXPECT_GT(dark, 10);
  EXPECT_GT(bright, 10);
  for (const int n : of_channel) EXPECT_GT(n, 50);
}

TEST_F(Extraction, RejectsBlocksThatDarkenInALongerExposure) {
  std::vector<Picture> pictures = series();
  // A lamp in the upper half is switched off before the last picture.
  for (std::size_t i = 0; i < pictures[2].rgb.size() / 2; ++i) {
    pictures[2].rgb[i] = 0.9F;
    pictures[3].rgb[i] = 0.3F;
  }
  const auto samples = choose_samples(pictures, exposures_, 0, 0.98);
  ASSERT_TRUE(samples.ok()) << samples.status().message();
  for (const PixelSeries& p : samples->pixels) EXPECT_FALSE(p.values[2] > 0.85 && p.values[3] < 0.35);
}

TEST_F(Extraction, ABlockWithASaturatedPixelIsSaturated) {
  const auto samples = choose_samples(series(), exposures_, 0, 0.98);
  ASSERT_TRUE(samples.ok()) << samples.status().message();
  for (const PixelSeries& p : samples->pixels)
    for (const double v : p.values) EXPECT_TRUE(v < 0.995 || v >= 1) << v;
}

TEST_F(Extraction, RefusesInvalidSeries) {
  const std::vector<Picture> good = series();
  const auto refused = [&](const std::vector<Picture>& pictures, const std::vector<double>& exposures) {
    const auto found = choose_samples(pictures, exposures, 0, 0.98);
    EXPECT_FALSE(found.ok());
    return found.status().message();
  };
  EXPECT_THAT(refused({good[0], good[1]}, {1, 2}), HasSubstr("at least 3"));
  EXPECT_THAT(refused(good, {1, 2, 4}), HasSubstr("3 exposures for 4 pictures"));
  std::vector<Picture> other = good;
  other[2].height /= 2;
  other[2].rgb.resize(3 * other[2].sites());
  EXPECT_THAT(refused(other, exposures_), HasSubstr("192x48"));
  EXPECT_THAT(refused(good, {4, 3, 2, 1}), HasSubstr("get darker in a longer exposure"));
}

TEST(PictureOf, ReadsSensorFormatsAndRefusesInterpolatedOnes) {
  const std::vector<std::byte> bytes(4 * 4 * 12, std::byte{255});
  const auto full = picture_of({0, PixelFormat::rgb8, 4, 4, 12, bytes}, "a");
  ASSERT_TRUE(full.ok());
  EXPECT_EQ(full->at(3, 3, 2), 1.0F);
  EXPECT_EQ(full->levels, 256);
  const auto mosaic = picture_of({0, PixelFormat::bayer_rggb8, 4, 4, 4, bytes}, "a");
  ASSERT_TRUE(mosaic.ok());
  EXPECT_EQ(mosaic->width, 2);
  EXPECT_EQ(mosaic->pitch, 2);
  EXPECT_THAT(picture_of({0, PixelFormat::yuyv, 4, 4, 8, bytes}, "a").status().message(),
              HasSubstr("mixes the values"));
  EXPECT_THAT(picture_of({0, PixelFormat::rgb8, 4, 99, 12, bytes}, "a").status().message(), HasSubstr("too few"));
  std::vector<std::byte> floats(4 * 4 * 12);
  const float quarter = 0.25F;
  for (std::size_t k = 0; k < floats.size(); k += sizeof quarter)
    std::memcpy(floats.data() + k, &quarter, sizeof quarter);
  const auto raw = picture_of({0, PixelFormat::rgb_f32, 4, 4, 48, floats}, "a", 4096);
  ASSERT_TRUE(raw.ok());
  EXPECT_EQ(raw->at(2, 1, 0), 0.25F) << "fractions of full scale, unchanged";
  EXPECT_EQ(raw->levels, 4096);
  // 0xFFFFFFFF is NaN as a float.
  EXPECT_THAT(picture_of({0, PixelFormat::rgb_f32, 4, 4, 48, bytes}, "a").status().message(), HasSubstr("not finite"));
}

}  // namespace
}  // namespace lightwell::photometry
