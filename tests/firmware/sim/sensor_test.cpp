// Tests of Sensor: pictures correspond to the radiance, with the noise of the calibration.
#include "sim/sensor.hpp"

#include <array>
#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include <lightwell/color.hpp>

#include "calibration/model/response.hpp"

namespace lightwell::sim {
namespace {

constexpr int kWidth = 128, kHeight = 64;
constexpr std::size_t kPixels = kWidth * kHeight;

/// An equirectangular lens, which has no vignetting.
LensParameters plain_lens() { return make_rig("equirect", kWidth, kHeight, PixelFormat::rgb8)->lenses[0]; }

SensorModel sensor_model(PixelFormat format) {
  return sensor_of(*make_rig("equirect", kWidth, kHeight, format), format, 1);
}

SensorModel silent(PixelFormat format) {
  SensorModel model = sensor_model(format);
  model.photometry.read_noise = model.photometry.shot_noise = 0;
  return model;
}

std::vector<float> uniform(Radiance l) {
  std::vector<float> radiance(3 * kPixels);
  for (std::size_t k = 0; k < radiance.size(); ++k) radiance[k] = l[static_cast<int>(k % 3)];
  return radiance;
}

std::vector<std::byte> shoot(const SensorModel& model, const std::vector<float>& radiance, const Exposure& exposure) {
  const Sensor sensor(plain_lens(), model);
  std::vector<std::byte> out(sensor.bytes());
  sensor.expose(radiance, exposure, out);
  return out;
}

int word(const std::vector<std::byte>& out, std::size_t k) {
  return std::to_integer<int>(out[2 * k]) | std::to_integer<int>(out[2 * k + 1]) << 8;
}
int byte(const std::vector<std::byte>& out, std::size_t k) { return std::to_integer<int>(out[k]); }

TEST(Sensor, TheIdealSensorReturnsRadiance) {
  const std::vector<float> radiance = uniform({0.25F, 1.0F, 32700.0F});
  const std::vector<std::byte> out = shoot(sensor_model(PixelFormat::rgb_f32), radiance, {});
  ASSERT_EQ(out.size(), radiance.size() * sizeof(float));
  EXPECT_EQ(std::memcmp(out.data(), radiance.data(), out.size()), 0);
}

TEST(Sensor, IsDeterministicAndVariesWithFrameLensAndSeed) {
  const SensorModel model = sensor_model(PixelFormat::bayer_rggb12);
  const std::vector<float> radiance = uniform({0.4F, 0.4F, 0.4F});
  const Exposure exposure{0.01, 1, 7, 0};
  const auto once = shoot(model, radiance, exposure);
  EXPECT_EQ(once, shoot(model, radiance, exposure));
  EXPECT_NE(once, shoot(model, radiance, {0.01, 1, 8, 0})) << "another frame";
  EXPECT_NE(once, shoot(model, radiance, {0.01, 1, 7, 1})) << "another lens";
  SensorModel other = model;
  other.seed = 2;
  EXPECT_NE(once, shoot(other, radiance, exposure)) << "another seed";
}

/// Mean and variance of the linear value x of a uniformly lit 12-bit picture.
std::array<double, 2> moments(const SensorModel& model, float radiance, double exposure_s, double gain) {
  const std::vector<float> table = linear_table(model.photometry, 4096);
  double sum = 0, squares = 0;
  constexpr int kFrames = 8;
  for (int frame = 0; frame < kFrames; ++frame) {
    const auto out =
        shoot(model, uniform({radiance, radiance, radiance}), {exposure_s, gain, static_cast<std::uint64_t>(frame), 0});
    for (std::size_t k = 0; k < kPixels; ++k) {
      const double x = static_cast<double>(table[static_cast<std::size_t>(word(out, k))]);
      sum += x;
      squares += x * x;
    }
  }
  const double n = kFrames * static_cast<double>(kPixels);
  return {sum / n, squares / n - sum / n * (sum / n)};
}

TEST(Sensor, MeanAndVarianceFollowTheModel) {
  const SensorModel model = sensor_model(PixelFormat::bayer_rggb12);
  // Electrons at gain 1: 4 and 30 (Poisson), 500 and 5,000 (Gaussian).
  for (const double x : {0.0004, 0.003, 0.05, 0.5}) {
    for (const double gain : {1.0, 4.0}) {
      const double signal = x * gain;
      if (signal > 0.9) continue;
      const auto [mean, variance] = moments(model, static_cast<float>(x), 0.01, gain);
      const double read = gain * model.photometry.read_noise;
      const double quantised = 1.0 / 12 / (3839.0 * 3839.0);
      const double stated = read * read + gain * model.photometry.shot_noise * signal + quantised;
      const double n = 8.0 * kPixels;
      // Five standard deviations of a mean and of a variance of n samples.
      EXPECT_NEAR(mean, signal, 5 * std::sqrt(stated / n)) << x << " gain " << gain;
      EXPECT_NEAR(variance / stated, 1, 5 * std::sqrt(2 / n) + 0.01) << x << " gain " << gain;
    }
  }
}

TEST(Sensor, DarknessIsTheBlackLevel) {
  const SensorModel model = sensor_model(PixelFormat::bayer_rggb10);
  const auto out = shoot(model, uniform({}), {0.01, 1, 0, 0});
  double sum = 0;
  for (std::size_t k = 0; k < kPixels; ++k) sum += word(out, k);
  // Read noise of 0.3 levels, 8,192 pixels: five standard deviations of the mean.
  EXPECT_NEAR(sum / static_cast<double>(kPixels), 64, 5 * 0.45 / std::sqrt(8192.0));
}

TEST(Sensor, Saturates) {
  for (const PixelFormat format : {PixelFormat::rgb8, PixelFormat::bayer_rggb12}) {
    const auto out = shoot(sensor_model(format), uniform({1e6F, 1e6F, 1e6F}), {0.01, 1, 0, 0});
    if (format == PixelFormat::rgb8) {
      for (std::size_t k = 0; k < out.size(); ++k) ASSERT_EQ(byte(out, k), 255);
    } else {
      for (std::size_t k = 0; k < kPixels; ++k) ASSERT_EQ(word(out, k), 4095);
    }
  }
}

TEST(Sensor, ExposureAndGainScaleTheSignal) {
  const SensorModel model = silent(PixelFormat::bayer_rggb12);
  const std::vector<float> table = linear_table(model.photometry, 4096);
  const auto linear = [&](double exposure_s, double gain) {
    const auto out = shoot(model, uniform({1, 1, 1}), {exposure_s, gain, 0, 0});
    return static_cast<double>(table[static_cast<std::size_t>(word(out, 0))]);
  };
  // Half a level of 12 bits; radiance 1 gives full scale in 10 ms.
  EXPECT_NEAR(linear(0.002, 1), 0.2, 1.0 / 4096);
  EXPECT_NEAR(linear(0.004, 1), 0.4, 1.0 / 4096);
  EXPECT_NEAR(linear(0.002, 3), 0.6, 1.0 / 4096);
}

TEST(Sensor, RgbHasTheResponseOfEachChannel) {
  const SensorModel model = silent(PixelFormat::rgb8);
  const auto out = shoot(model, uniform({0.1F, 0.5F, 0.9F}), {0.01, 1, 0, 0});
  for (std::size_t c = 0; c < 3; ++c) {
    const double wanted = linear_to_srgb(std::array{0.1, 0.5, 0.9}[c]) * 255;
    EXPECT_NEAR(byte(out, 300 + c), wanted, 0.51);
  }
}

TEST(Sensor, TheMosaicStartsWithRed) {
  const SensorModel model = silent(PixelFormat::bayer_rggb12);
  const auto out = shoot(model, uniform({0.2F, 0.4F, 0.8F}), {0.01, 1, 0, 0});
  EXPECT_LT(word(out, 0), word(out, 1));
  EXPECT_EQ(word(out, 1), word(out, kWidth)) << "both greens must be equal";
  EXPECT_LT(word(out, 1), word(out, kWidth + 1)) << "blue must be at the lower right";
}

class YuvTest : public testing::TestWithParam<PixelFormat> {
 protected:
  static std::array<float, 3> unit(std::array<std::uint8_t, 3> codes) {
    return {codes[0] / 255.0F, codes[1] / 255.0F, codes[2] / 255.0F};
  }
  /// Decodes r, g, b (encoded values) of a pixel.
  static std::array<float, 3> decoded(const std::vector<std::byte>& out, std::size_t x, std::size_t y) {
    if (GetParam() == PixelFormat::yuyv) {
      const std::size_t pair = y * 2 * kWidth + x / 2 * 4;
      return unit(rgb8_of_ycbcr601(byte(out, pair + x % 2 * 2), byte(out, pair + 1), byte(out, pair + 3)));
    }
    const std::size_t chroma = kPixels + y / 2 * kWidth + x / 2 * 2;
    return unit(rgb8_of_ycbcr601(byte(out, y * kWidth + x), byte(out, chroma), byte(out, chroma + 1)));
  }
};

TEST_P(YuvTest, RoundTripsColours) {
  const SensorModel model = silent(GetParam());
  for (const Radiance l : {Radiance{0.2F, 0.4F, 0.8F}, Radiance{0.9F, 0.1F, 0.1F}, Radiance{0.5F, 0.5F, 0.5F},
                           Radiance{0, 0, 0}, Radiance{1, 1, 1}}) {
    const auto rgb = decoded(shoot(model, uniform(l), {0.01, 1, 0, 0}), 70, 31);
    for (int c = 0; c < 3; ++c) {
      // Rounding by half a level of each: 0.58 from luma, 1.01 from the blue difference, of 255.
      EXPECT_NEAR(rgb[static_cast<std::size_t>(c)], linear_to_srgb(l[c]), 1.7 / 255) << c;
    }
  }
}

TEST_P(YuvTest, ChromaIsTheMeanOfItsPixels) {
  // Alternating red and blue columns: luma resolves them, chroma does not.
  std::vector<float> stripes(3 * kPixels, 0.0F);
  for (std::size_t k = 0; k < kPixels; ++k) stripes[3 * k + (k % 2 == 0 ? 0 : 2)] = 1;
  const auto out = shoot(silent(GetParam()), stripes, {0.01, 1, 0, 0});
  const std::size_t cb = GetParam() == PixelFormat::yuyv ? 1 : kPixels;
  const std::size_t cr = GetParam() == PixelFormat::yuyv ? 3 : kPixels + 1;
  EXPECT_NEAR(byte(out, cb), 128 + (112 - 37.797) / 2, 0.51);
  EXPECT_NEAR(byte(out, cr), 128 + (112 - 18.214) / 2, 0.51);
}

INSTANTIATE_TEST_SUITE_P(Formats, YuvTest, testing::Values(PixelFormat::nv12, PixelFormat::yuyv));

TEST(Sensor, VignettingDarkensTheRimAndTheTableUndoesIt) {
  const RigParameters rig = *make_rig("single", 160, 120, PixelFormat::bayer_rggb12);
  SensorModel model = sensor_of(rig, PixelFormat::bayer_rggb12, 1);
  model.photometry.read_noise = model.photometry.shot_noise = 0;
  const Sensor sensor(rig.lenses[0], model);
  std::vector<std::byte> out(sensor.bytes());
  sensor.expose(std::vector<float>(3 * 160 * 120, 0.9F), {0.01, 1, 0, 0}, out);
  const std::vector<float> table = linear_table(model.photometry, 4096);
  const auto at = [&](std::size_t x, std::size_t y) {
    return static_cast<double>(table[static_cast<std::size_t>(word(out, y * 160 + x))]);
  };
  EXPECT_NEAR(at(80, 60), 0.9, 1e-3);
  // 57 px from the axis with a circle of 59.4 px: about 91 degrees.
  EXPECT_NEAR(at(137, 60) / at(80, 60), vignetting(model.photometry, 91.0 / 57.3), 0.01);
}

TEST(ExposureBelowSaturation, IsJustBelowFullScale) {
  for (const PixelFormat format : {PixelFormat::rgb8, PixelFormat::bayer_rggb12}) {
    const SensorModel model = silent(format);
    const double exposure = exposure_below_saturation(model, 25, 2);
    const auto out = shoot(model, uniform({25, 25, 25}), {exposure, 2, 0, 0});
    const double value = format == PixelFormat::rgb8 ? byte(out, 0) / 255.0 : word(out, 0) / 4095.0;
    EXPECT_LT(value, model.photometry.saturation);
    EXPECT_GT(value, 0.9 * model.photometry.saturation);
  }
}

TEST(Noise, NormalQuantileInvertsTheDistribution) {
  for (int i = 1; i < 4000; ++i) {
    const double p = i / 4000.0;
    EXPECT_NEAR(0.5 * std::erfc(-normal_quantile(p) / std::sqrt(2.0)), p, 1e-7);
  }
  EXPECT_NEAR(0.5 * std::erfc(-normal_quantile(1e-9) / std::sqrt(2.0)) / 1e-9, 1, 1e-5);
}

TEST(Noise, PoissonQuantileInvertsTheDistribution) {
  // P(N <= 2) of mean 3: e^-3 (1 + 3 + 4.5) = 0.42319.
  EXPECT_EQ(poisson_quantile(3, 0.4231), 2);
  EXPECT_EQ(poisson_quantile(3, 0.4233), 3);
  EXPECT_EQ(poisson_quantile(0.1, 0.5), 0);
}

}  // namespace
}  // namespace lightwell::sim
