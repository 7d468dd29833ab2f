#include "estimate/common/smoother.hpp"

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "noisy_light.hpp"

namespace lightwell::estimate {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(Smoother, ReducesNoiseWithoutBias) {
  constexpr double kNoise = 0.01;
  constexpr int kFrames = 6000;
  Smoother smoother;
  Noise noise(kNoise);
  const Projection truth = sky();
  Projection sum;
  double before = 0, after = 0, residual_square = 0;
  for (int i = 0; i < kFrames; ++i) {
    Projection p = truth;
    noise.add(p);
    before += std::pow(rms(difference(p, truth)).plain, 2) / kFrames;
    const double r = smoother.apply(p, {}, frame_time(i), kNoise).plain;
    residual_square += r * r / kFrames;
    after += std::pow(rms(difference(p, truth)).plain, 2) / kFrames;
    for (std::size_t k = 0; k < kRowCount; ++k)
      for (std::size_t c = 0; c < 3; ++c) sum.c[k][c] += p.c[k][c] / kFrames;
  }
  EXPECT_NEAR(before, kNoise * kNoise, 0.03 * kNoise * kNoise);
  // (1 - q) / (1 + q) with q = exp(-1/30 / 0.25) is 1/15.0; large innovations increase the gain now and then.
  EXPECT_GT(before / after, 14);
  EXPECT_LT(before / after, 15.5);
  EXPECT_NEAR(smoother.residual_noise(), std::sqrt(after), 0.1 * std::sqrt(after)) << "predicted residual noise";
  // The mean of 6000 frames: noise divided by the square root of their number.
  EXPECT_LT(rms(difference(sum, truth)).plain, 2 * kNoise / std::sqrt(kFrames));
  // The difference is 1 - a times (frame minus mean so far), a = 1/8.
  EXPECT_NEAR(std::sqrt(residual_square), 0.9 * kNoise, 0.02 * kNoise) << "the difference is the noise";
}

TEST(Smoother, ReducesCorrelatedNoiseAlmostAsMuch) {
  // Equal channels, or noise of one lamp: few degrees of freedom, so that large innovations are more frequent.
  constexpr double kNoise = 0.01;
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal;
  Noise white(kNoise);
  for (const bool one_lamp : {false, true}) {
    Smoother smoother;
    double before = 0, after = 0;
    for (int i = 0; i < 6000; ++i) {
      Projection error;
      if (one_lamp)
        add_cap(error, lamp({1, 2, 0.5F}, static_cast<float>(kNoise * std::sqrt(6.0) / 0.87 * normal(random)), 1));
      else
        white.add(error);
      for (auto& c : error.c) c[1] = c[2] = c[0];
      Projection p = difference(sky(), error);
      before += std::pow(rms(error).plain, 2);
      (void)smoother.apply(p, {}, frame_time(i), kNoise);
      after += std::pow(rms(difference(p, sky())).plain, 2);
    }
    EXPECT_GT(before / after, one_lamp ? 6 : 12);
  }
}

TEST(Smoother, ReducesNoiseLikeAMeanAfterStart) {
  constexpr double kNoise = 0.01;
  constexpr int kRuns = 400;
  double after = 0;
  for (int run = 0; run < kRuns; ++run) {
    Smoother smoother;
    Noise noise(kNoise, static_cast<std::uint64_t>(run) + 7);
    Projection p;
    for (int i = 0; i < 5; ++i) {
      p = sky();
      noise.add(p);
      (void)smoother.apply(p, {}, frame_time(i), kNoise);
    }
    after += std::pow(rms(difference(p, sky())).plain, 2) / kRuns;
  }
  EXPECT_NEAR(after / (kNoise * kNoise), 1.0 / 5, 0.02);
}

TEST(Smoother, ConstantLightIsExactlyConstantForAMillionFrames) {
  Smoother smoother;
  const std::vector<Light> lights = {lamp({1, 2, 0.5F}, 3, 1), lamp({-1, 0.1F, 1e-8F}, 1, 2)};
  Projection truth = sky();
  for (const Light& l : lights) add_cap(truth, l);
  std::vector<Light> now;
  for (int i = 0; i < 1'000'000; ++i) {
    Projection p = truth;
    now = lights;
    // Irregular times, and a nonzero stated noise.
    const IrradianceRms residual = smoother.apply(p, now, {i * kFrame + (i % 7) * 1'000'000}, 0.01);
    if (i % 1000 != 0 && i < 999'000) continue;
    ASSERT_TRUE(equal(p, truth)) << i;
    ASSERT_EQ(now, lights) << i;
    ASSERT_EQ(residual.plain, 0);
  }
}

TEST(Smoother, SwitchedLampPassesInTheSameFrame) {
  constexpr double kNoise = 0.01;
  for (const double size : {6.0, 10.0, 1000.0}) {
    for (const bool on : {true, false}) {
      Smoother smoother;
      Noise noise(kNoise);
      // RMS irradiance of a lamp is E / sqrt(6), by its mean channel.
      const Light light = lamp({1, 2, 0.5F}, static_cast<float>(size * kNoise * std::sqrt(6.0) / 0.87), 1);
      for (int i = 0; i < 100; ++i) {
        const bool lit = (i >= 60) == on;
        Projection p = sky(), raw;
        if (lit) add_cap(p, light);
        noise.add(p);
        raw = p;
        std::vector<Light> lights;
        if (lit) lights.push_back(light);
        const IrradianceRms residual = smoother.apply(p, lights, frame_time(i), kNoise);
        if (i == 60 || i == 61) {
          EXPECT_TRUE(equal(p, raw)) << size << " noises, frame " << i;
          EXPECT_EQ(residual.plain, 0);
          EXPECT_EQ(lights.size(), lit ? 1U : 0U);
          if (lit) {
            EXPECT_EQ(lights[0], light);
          }
        }
        if (i == 70) {
          EXPECT_GT(residual.plain, 0) << "noise must be removed again";
        }
      }
    }
  }
}

TEST(Smoother, SwitchDuringAnExposureIsCompleteInTheNextFrame) {
  // A first part of the change (100 sigma at least) is in one frame, the rest in the next.
  for (const double first : {0.1, 0.5, 0.97}) {
    Smoother smoother;
    Noise noise(0.001);
    Projection p, raw;
    for (int i = 0; i < 62; ++i) {
      p = sky(i < 60 ? 1 : i == 60 ? 1 + first : 2);
      noise.add(p);
      raw = p;
      (void)smoother.apply(p, {}, frame_time(i), 0.001);
    }
    EXPECT_TRUE(equal(p, raw)) << first;
  }
}

TEST(Smoother, PassesChangesWithoutIrradiance) {
  // Bands 3 and 5 have no irradiance at all.
  Smoother smoother;
  Noise noise(0.01);
  for (int i = 0; i < 40; ++i) {
    Projection p = sky(), raw;
    for (std::size_t k = 0; k < 3; ++k) p.c[i < 30 ? 27U : 30U][k] += 1;
    noise.add(p);
    raw = p;
    (void)smoother.apply(p, {}, frame_time(i), 0.01);
    if (i == 30) {
      EXPECT_TRUE(equal(p, raw));
    }
  }
}

TEST(Smoother, FollowsSlowChangesWithinTheTimeConstant) {
  constexpr double kNoise = 0.01;
  // Sigmas of noise per second: a sunset, a cloud, a dimmer.
  for (const double speed : {0.5, 3.0, 10.0, 40.0}) {
    Smoother smoother;
    double lag = 0;
    const double unit = rms(sky()).plain;
    for (int i = 0; i < 300; ++i) {
      Projection p = sky(1 + speed * kNoise / unit * i / 30), raw = p;
      (void)smoother.apply(p, {}, frame_time(i), kNoise);
      lag = std::max(lag, rms(difference(p, raw)).plain);
    }
    EXPECT_LT(lag, kSmoothingTime * speed * kNoise * 1.001) << speed;
    EXPECT_LT(lag, 4 * std::sqrt(kNoise * kNoise + std::pow(smoother.residual_noise(), 2))) << speed;
    EXPECT_GT(lag, 0);
  }
}

TEST(Smoother, ReturnsTheRmsOfTheDifference) {
  Smoother smoother;
  Noise noise(0.02);
  for (int i = 0; i < 200; ++i) {
    Projection p = sky(1 + 0.05 * std::sin(0.2 * i)), raw;
    noise.add(p);
    raw = p;
    const IrradianceRms reported = smoother.apply(p, {}, frame_time(i), 0.02), true_rms = rms(difference(raw, p));
    ASSERT_NEAR(reported.plain, true_rms.plain, 1e-12);
    ASSERT_NEAR(reported.weighted, true_rms.weighted, 1e-12);
  }
}

TEST(Smoother, WithoutNoiseModelPassesFramesUnchanged) {
  for (const double n : {0.0, -1.0, kNan, kInfinite}) {
    Smoother smoother;
    Noise noise(0.01);
    for (int i = 0; i < 20; ++i) {
      Projection p = sky(), raw;
      noise.add(p);
      raw = p;
      const IrradianceRms residual = smoother.apply(p, {}, frame_time(i), n);
      ASSERT_TRUE(equal(p, raw));
      ASSERT_EQ(residual.plain, 0);
    }
  }
  Smoother off(0);
  Noise noise(0.01);
  Projection p = sky(), first;
  (void)off.apply(p, {}, frame_time(0), 0.01);
  noise.add(p);
  first = p;
  (void)off.apply(p, {}, frame_time(1), 0.01);
  EXPECT_TRUE(equal(p, first)) << "a time constant of zero";
}

TEST(Smoother, ScalesWithTheLight) {
  for (const double scale : {1e-8, 1e8}) {
    Smoother one, other;
    Noise a(0.01), b(0.01 * scale);
    for (int i = 0; i < 50; ++i) {
      Projection p = sky(), q = sky(scale);
      a.add(p);
      b.add(q);
      (void)one.apply(p, {}, frame_time(i), 0.01);
      (void)other.apply(q, {}, frame_time(i), 0.01 * scale);
      ASSERT_NEAR(q.c[0][0] / scale, p.c[0][0], 1e-12);
      ASSERT_NEAR(q.c[30][1] / scale, p.c[30][1], 1e-12);
    }
  }
}

TEST(Smoother, ReplacesNanAndRecovers) {
  Smoother smoother;
  const Projection truth = sky();
  std::vector<Light> lights;
  for (int i = 0; i < 30; ++i) {
    Projection p = truth;
    lights = {lamp({0, 1, 0}, 1, 1)};
    const bool bad = i == 10 || i == 0;
    if (bad) {
      p.c[0][0] = kNan;
      p.c[40][2] = kInfinite;
      lights[0].irradiance.g = std::numeric_limits<float>::quiet_NaN();
    }
    const IrradianceRms residual = smoother.apply(p, lights, frame_time(i), 0.01);
    for (const auto& c : p.c)
      for (const double v : c) ASSERT_TRUE(std::isfinite(v)) << i;
    ASSERT_TRUE(std::isfinite(lights[0].irradiance.luminance()));
    ASSERT_EQ(std::isinf(residual.plain), bad) << i;
    if (i == 10) {
      EXPECT_TRUE(equal(p, truth)) << "replaced by the smoothed coefficients";
    }
    if (i == 12) {
      EXPECT_TRUE(equal(p, truth));
      EXPECT_EQ(lights[0].irradiance, lamp({0, 1, 0}, 1, 1).irradiance);
    }
  }
}

TEST(Smoother, PassesTheFirstFrameAfterAnHour) {
  Smoother smoother;
  Noise noise(0.01);
  Projection p, raw;
  for (int i = 0; i < 30; ++i) {
    p = sky();
    noise.add(p);
    (void)smoother.apply(p, {}, frame_time(i), 0.01);
  }
  raw = p = sky(1.005);
  (void)smoother.apply(p, {}, {frame_time(30).ns + 3'600'000'000'000}, 0.01);
  EXPECT_TRUE(equal(p, raw));
}

TEST(Smoother, ToleratesClockErrors) {
  Smoother smoother;
  Noise noise(0.01);
  Projection p, raw;
  double after = 0;
  for (int i = 0; i < 2000; ++i) {
    p = sky();
    noise.add(p);
    (void)smoother.apply(p, {}, frame_time(0), 0.01);
    if (i >= 1000) after += std::pow(rms(difference(p, sky())).plain, 2) / 1000;
  }
  EXPECT_NEAR(after, 1e-4 / 15, 1e-4 / 60) << "as at 30 frames/s";
  const auto passes = [&](std::int64_t ns) {
    raw = sky(1.004);
    p = raw;
    const IrradianceRms residual = smoother.apply(p, {}, {ns}, 0.01);
    return equal(p, raw) && residual.plain == 0;
  };
  EXPECT_TRUE(passes(0)) << "time runs backwards";
  EXPECT_TRUE(passes(std::numeric_limits<std::int64_t>::max()));
  EXPECT_TRUE(passes(std::numeric_limits<std::int64_t>::min()));
}

TEST(Smoother, ResetPassesTheNextFrame) {
  Smoother smoother;
  Projection p = sky(), other = sky(1.001), raw = other;
  (void)smoother.apply(p, {}, frame_time(0), 0.01);
  smoother.reset();
  (void)smoother.apply(other, {}, frame_time(1), 0.01);
  EXPECT_TRUE(equal(other, raw));
}

}  // namespace
}  // namespace lightwell::estimate
