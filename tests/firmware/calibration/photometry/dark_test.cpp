// Tests of dark_value_of() and solve_dark().
#include <cmath>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calibration/solve/photometry/noise.hpp"
#include "firmware/calibration/photometry/simulated_camera.hpp"

namespace lightwell::photometry {
namespace {

using ::testing::HasSubstr;

/// Dark frames of a 12-bit sensor with Gaussian noise, a fixed pattern of offsets, and some hot pixels.
std::vector<Picture> patterned(int count, double black, double noise, double pattern, double hot_share) {
  std::mt19937_64 random(77);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  Picture empty{200, 100, 4096, 1, std::vector<float>(3 * 200 * 100)};
  std::vector<double> offset(empty.rgb.size());
  for (double& o : offset) o = black + pattern * normal(random) + (uniform(random) < hot_share ? 0.2 : 0);
  std::vector<Picture> out(static_cast<std::size_t>(count), empty);
  for (Picture& p : out)
    for (std::size_t i = 0; i < offset.size(); ++i)
      p.rgb[i] = static_cast<float>(std::round(4095 * std::clamp(offset[i] + noise * normal(random), 0.0, 1.0)) / 4095);
  return out;
}

TEST(Dark, ReadNoiseExcludesTheFixedPattern) {
  const auto found = solve_dark(patterned(4, 0.06, 5e-4, 1e-3, 0), {});
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_NEAR(found->read_noise * (1 - 0.06), 5e-4, 0.05 * 5e-4);
  EXPECT_NEAR(found->black_level, 0.06, 1e-4);
}

TEST(Dark, HotPixelsAreCountedAndRejected) {
  const auto found = solve_dark(patterned(4, 0.06, 5e-4, 0, 0.005), {});
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_NEAR(found->outlier_share, 0.005, 0.001);
  EXPECT_NEAR(found->black_level, 0.06, 1e-4);
  EXPECT_NEAR(found->read_noise * (1 - 0.06), 5e-4, 0.05 * 5e-4);
}

TEST(Dark, NoiseIsReferredToGainOne) {
  SimulatedCamera camera(PixelFormat::bayer_rggb12, usual_photometry(PixelFormat::bayer_rggb12), 3);
  const auto found = solve_dark(camera.darks(4, 8), {}, 8);
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_NEAR(found->read_noise, 3e-4, 0.05 * 3e-4);
}

TEST(Dark, CensoredNoiseIsEstimatedAndFlagged) {
  SimulatedCamera camera(PixelFormat::rgb8, usual_photometry(PixelFormat::rgb8), 3);
  const auto found = solve_dark(camera.darks(4), usual_photometry(PixelFormat::rgb8).response);
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_TRUE(found->clipped);
  EXPECT_NEAR(found->read_noise, 3e-4, 0.05 * 3e-4);
  EXPECT_EQ(*dark_value_of(camera.darks(2)), 0);
}

TEST(Dark, OneCodeEverywhereIsUnresolved) {
  PhotometricCalibration p = usual_photometry(PixelFormat::bayer_rggb8);
  SimulatedCamera camera(PixelFormat::bayer_rggb8, p, 3);
  const auto found = solve_dark(camera.darks(2), p.response);
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_FALSE(found->resolved);
  EXPECT_EQ(found->read_noise, 0);
  EXPECT_GT(found->read_deviation, p.read_noise / 3) << "the noise that quantisation may conceal";
  EXPECT_NEAR(found->black_level, p.black_level, 2 * found->black_deviation);
}

std::string refused(const std::vector<Picture>& pictures) {
  const auto found = solve_dark(pictures, {});
  EXPECT_FALSE(found.ok());
  return found.status().message();
}

TEST(Dark, RefusesPicturesThatAreNotDark) {
  SimulatedCamera camera(PixelFormat::bayer_rggb12, usual_photometry(PixelFormat::bayer_rggb12), 3);
  EXPECT_THAT(refused({}), HasSubstr("at least 2"));
  EXPECT_THAT(refused(camera.darks(1)), HasSubstr("take more"));
  const Picture once = camera.darks(1)[0];
  EXPECT_THAT(refused({once, once}), HasSubstr("are identical"));
  const auto lit = [&](int, int) { return 0.5; };
  EXPECT_THAT(refused({camera.shoot(lit, 1), camera.shoot(lit, 1)}), HasSubstr("cover the lens"));
  const auto half = [&](int x, int) { return x < 100 ? 0.0 : 0.5; };
  EXPECT_THAT(refused({camera.shoot(half, 1), camera.shoot(half, 1)}), HasSubstr("light enters the camera"));
  Picture small = once;
  small.width /= 2;
  small.rgb.resize(3 * small.sites());
  EXPECT_THAT(refused({once, small}), HasSubstr("take all with one camera mode"));
}

}  // namespace
}  // namespace lightwell::photometry
