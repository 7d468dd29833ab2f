// Tests of noise_levels() and solve_noise().
#include "calibration/solve/photometry/noise.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/calibration/photometry/simulated_camera.hpp"

namespace lightwell::photometry {
namespace {

using ::testing::HasSubstr;

constexpr double kRead = 3e-4, kShot = 1e-4;

std::vector<NoiseLevel> exact_levels() {
  std::vector<NoiseLevel> out;
  for (const double x : {0.02, 0.05, 0.1, 0.2, 0.4, 0.8}) out.push_back({x, kRead * kRead + kShot * x, 0, 10000, 1});
  return out;
}

TEST(Noise, ExactLevelsGiveTheExactLine) {
  const auto found = solve_noise(exact_levels());
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_NEAR(found->read_noise, kRead, 1e-9);
  EXPECT_NEAR(found->shot_noise, kShot, 1e-12);
}

TEST(Noise, LevelsOfDifferentGainsAreOneLine) {
  std::vector<NoiseLevel> levels;
  for (const double gain : {1.0, 4.0})
    for (const double x : {0.02, 0.1, 0.4, 0.8})
      levels.push_back({x, gain * gain * kRead * kRead + gain * kShot * x, 0, 10000, gain});
  const auto found = solve_noise(levels);
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_NEAR(found->read_noise, kRead, 1e-9);
  EXPECT_NEAR(found->shot_noise, kShot, 1e-12);
}

TEST(Noise, AnOutlierLevelIsRejected) {
  std::vector<NoiseLevel> levels = exact_levels();
  for (const double x : {0.15, 0.3, 0.6}) levels.push_back({x, kRead * kRead + kShot * x, 0, 10000, 1});
  levels[4].variance *= 2;
  const auto found = solve_noise(levels);
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_NEAR(found->shot_noise, kShot, 0.01 * kShot);
}

TEST(Noise, MovingObjectsAreRejected) {
  const PhotometricCalibration truth = usual_photometry(PixelFormat::bayer_rggb12);
  SimulatedCamera camera(PixelFormat::bayer_rggb12, truth, 5);
  std::vector<FlatPair> pairs = camera.flats({0.03, 0.1, 0.2, 0.4, 0.8});
  for (FlatPair& pair : pairs)
    for (std::size_t i = 0; i < pair.b.rgb.size(); i += 100) pair.b.rgb[i] *= 0.7F;
  const auto levels = noise_levels(pairs, truth);
  ASSERT_TRUE(levels.ok()) << levels.status().message();
  const auto found = solve_noise(*levels);
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_NEAR(found->shot_noise, kShot, 0.05 * kShot);
}

TEST(Noise, VignettingGivesSeveralLevels) {
  const PhotometricCalibration truth = usual_photometry(PixelFormat::bayer_rggb12);
  SimulatedCamera camera(PixelFormat::bayer_rggb12, truth, 5);
  const auto wedge = [](int x, int) { return 0.02 + 0.8 * x / SimulatedCamera::kWidth; };
  std::vector<FlatPair> pairs;
  for (int i = 0; i < 4; ++i) pairs.push_back({camera.shoot(wedge, 1), camera.shoot(wedge, 1), 1});
  const auto levels = noise_levels(pairs, truth);
  ASSERT_TRUE(levels.ok()) << levels.status().message();
  EXPECT_GT(levels->size(), 20U);
  const auto found = solve_noise(*levels);
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_NEAR(found->shot_noise, kShot, 0.05 * kShot);
}

TEST(Noise, RoundingIsSubtracted) {
  // 8 bits, linear: standard deviations of 0.5 to 2 codes, of which rounding contributes 0.29.
  PhotometricCalibration truth = usual_photometry(PixelFormat::bayer_rggb8);
  SimulatedCamera camera(PixelFormat::bayer_rggb8, truth, 5);
  const auto levels = noise_levels(camera.flats({0.05, 0.1, 0.2, 0.4, 0.6, 0.8}), truth);
  ASSERT_TRUE(levels.ok()) << levels.status().message();
  const auto found = solve_noise(*levels);
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_NEAR(found->shot_noise, kShot, 0.05 * kShot);
}

TEST(Noise, RefusesInsufficientLevels) {
  const PhotometricCalibration truth = usual_photometry(PixelFormat::bayer_rggb12);
  SimulatedCamera camera(PixelFormat::bayer_rggb12, truth, 5);
  const auto levels_of = [&](std::vector<FlatPair> pairs) { return noise_levels(pairs, truth).status().message(); };
  EXPECT_THAT(levels_of({}), HasSubstr("no pair"));
  std::vector<FlatPair> copies = camera.flats({0.5});
  copies[0].b = copies[0].a;
  EXPECT_THAT(levels_of(copies), HasSubstr("are identical"));
  EXPECT_THAT(levels_of(camera.flats({5})), HasSubstr("between dark and saturated"));
  std::vector<FlatPair> unequal = camera.flats({0.5});
  unequal[0].b.levels = 256;
  EXPECT_THAT(levels_of(unequal), HasSubstr("one camera mode"));
  PhotometricCalibration silent = truth;
  silent.shot_noise = silent.read_noise = 0;
  silent.black_level = 16.0 / 255;
  SimulatedCamera quiet(PixelFormat::bayer_rggb8, silent, 5);
  std::vector<FlatPair> rounded = quiet.flats({0.3});
  rounded[0].b.rgb[0] += 1.0F / 255;
  EXPECT_THAT(noise_levels(rounded, silent).status().message(), HasSubstr("rounding hides the noise"));

  EXPECT_THAT(solve_noise({}).status().message(), HasSubstr("at least three"));
  std::vector<NoiseLevel> near = exact_levels();
  for (NoiseLevel& l : near) l.mean = 0.4 + 0.01 * l.mean;
  EXPECT_THAT(solve_noise(near).status().message(), HasSubstr("three times the darkest"));
  std::vector<NoiseLevel> smooth = exact_levels();
  for (NoiseLevel& l : smooth) l.variance = 1e-6;
  EXPECT_THAT(solve_noise(smooth).status().message(), HasSubstr("turn off noise reduction"));
  smooth[2].variance = std::nan("");
  EXPECT_THAT(solve_noise(smooth).status().message(), HasSubstr("invalid mean"));
}

}  // namespace
}  // namespace lightwell::photometry
