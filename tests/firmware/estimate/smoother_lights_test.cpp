// Smoothed lights and the smoothed projection must describe the same energy.
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "estimate/common/smoother.hpp"
#include "noisy_light.hpp"

namespace lightwell::estimate {
namespace {

TEST(SmootherLights, NoiseOfLightsIsReduced) {
  constexpr double kNoise = 0.01, kJitter = 1e-3;
  Smoother smoother;
  Noise noise(kNoise);
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  const Light truth = lamp({0, 0, -1}, 1, 5);
  double energy = 0, direction = 0;
  constexpr int kFrames = 4000;
  for (int i = 0; i < kFrames; ++i) {
    Light l = truth;
    l.irradiance = l.irradiance * static_cast<float>(1 + 0.01 * normal(random));
    l.direction = normalized(
        Vec3f{static_cast<float>(kJitter * normal(random)), static_cast<float>(kJitter * normal(random)), -1});
    l.direction_covariance = {static_cast<float>(kJitter * kJitter), 0, static_cast<float>(kJitter * kJitter)};
    Projection p = sky();
    add_cap(p, truth);
    noise.add(p);
    (void)smoother.apply(p, std::span(&l, 1), frame_time(i), kNoise);
    energy += std::pow(l.irradiance.r - 1, 2) / kFrames;
    direction += std::pow(angle_between(l.direction, truth.direction), 2) / kFrames;
    ASSERT_NEAR(length(l.direction), 1, 1e-6);
  }
  EXPECT_GT(1e-4 / energy, 12);
  EXPECT_GT(2 * kJitter * kJitter / direction, 10);
}

TEST(SmootherLights, MovingLightPassesThoughTheProjectionHardlyChanges) {
  // A step of one degree by a lamp whose irradiance equals the noise.
  Smoother smoother;
  Noise noise(0.1);
  for (int i = 0; i < 40; ++i) {
    const double a = i < 30 ? 0.5 : 0.5 + std::numbers::pi / 180;
    Light l = lamp({static_cast<float>(std::sin(a)), 0.3F, static_cast<float>(-std::cos(a))}, 0.25F, 1);
    const Light found = l;
    Projection p = sky();
    add_cap(p, l);
    noise.add(p);
    (void)smoother.apply(p, std::span(&l, 1), frame_time(i), 0.1);
    EXPECT_EQ(l.direction, found.direction);
  }
}

TEST(SmootherLights, ResidualStaysConstantWhileLightsMergeAndSeparate) {
  // Four constant lamps, detected as one to four lights with changing tracks: the projection is constant, so that the
  // residual without the lights must equal that of each frame within the noise.
  constexpr double kNoise = 0.003;
  Smoother smoother;
  Noise noise(kNoise);
  std::mt19937_64 random(11);
  const std::vector<Vec3f> places = {{1, 1, 0}, {1, 1, 0.05F}, {1, 1.05F, 0}, {-1, 0.5F, 0.3F}};
  double worst = 0;
  std::uint32_t fresh = 100;
  for (int i = 0; i < 3000; ++i) {
    Projection p = sky(), raw;
    for (std::size_t k = 0; k < places.size(); ++k) add_cap(p, lamp(places[k], 1, 1));
    noise.add(p);
    raw = p;
    std::vector<Light> lights;
    const auto variant = random() % 5;
    const auto number = [&](std::uint32_t usual) { return random() % 10 == 0 ? fresh++ : usual; };
    if (variant == 0) {
      lights = {lamp(places[0], 3, number(1)), lamp(places[3], 1, number(4))};
    } else if (variant == 1) {
      lights = {lamp(places[1], 1, number(1)), lamp(places[0], 2, number(2))};
    } else if (variant == 2) {
      for (std::size_t k = 0; k < 4; ++k)
        lights.push_back(lamp(places[k], 1, number(static_cast<std::uint32_t>(k) + 1)));
    } else if (variant == 3) {
      lights = {lamp(places[3], 1, number(1))};
    }
    std::vector<Light> found = lights;
    const double residual = smoother.apply(p, lights, frame_time(i), kNoise).plain;
    const double error = rms(difference(without(p, lights), without(raw, found))).plain;
    worst = std::max(worst, error - residual);
    // A light that is new, or has changed by more than 4 n, is unchanged.
    ASSERT_LT(error, residual + 4 * std::sqrt(2.0) * kNoise * 4) << i;
  }
  EXPECT_LT(worst, 4 * kNoise);
}

TEST(SmootherLights, LostTrackIsDropped) {
  // Weaker than the noise, so that its remainder in the projection fades slowly.
  Smoother smoother;
  const Light l = lamp({0, 1, 0}, 0.02F, 1);
  std::vector<Light> lights;
  Projection p;
  for (int i = 0; i < 60; ++i) {
    p = sky();
    lights.clear();
    if (i < 30) {
      add_cap(p, l);
      lights.push_back(l);
    }
    (void)smoother.apply(p, lights, frame_time(i), 0.05);
    EXPECT_EQ(lights.size(), i < 30 ? 1U : 0U);
  }
  EXPECT_LT(rms(difference(p, sky())).plain, 0.03 * 0.02) << "after one second, at most e^-4 of it remains";
  // The same track number in another direction is a new lamp, not motion.
  lights = {lamp({1, 0, 0}, 0.02F, 1)};
  (void)smoother.apply(p, lights, frame_time(60), 0.05);
  EXPECT_EQ(lights[0], lamp({1, 0, 0}, 0.02F, 1));
}

TEST(SmootherLights, CovarianceFollowsTheTangentBasis) {
  // The tangent basis of Duff et al. (2017) rotates where z changes its sign; the ellipse on the sphere must not.
  Smoother smoother;
  const auto spread = [](const Light& l, Vec3d along) {
    const auto basis = tangent_basis(vec_cast<double>(l.direction));
    const double u = dot(basis[0], along), v = dot(basis[1], along);
    return u * u * l.direction_covariance[0] + 2 * u * v * l.direction_covariance[1] +
           v * v * l.direction_covariance[2];
  };
  for (int i = 0; i < 50; ++i) {
    Light l = lamp({1, 0.2F, i % 2 == 0 ? 1e-3F : -1e-3F}, 1, 1);
    const auto basis = tangent_basis(vec_cast<double>(l.direction));
    // Wide along +Y, narrow across.
    const double u = dot(basis[0], Vec3d{0, 1, 0}), v = dot(basis[1], Vec3d{0, 1, 0});
    constexpr double kWide = 1e-4, kNarrow = 1e-6;
    l.direction_covariance = {static_cast<float>(kNarrow + kWide * u * u), static_cast<float>(kWide * u * v),
                              static_cast<float>(kNarrow + kWide * v * v)};
    const double up = spread(l, {0, 1, 0}), across = spread(l, {0, 0, 1});
    Projection p = sky();
    (void)smoother.apply(p, std::span(&l, 1), frame_time(i), 0.1);
    EXPECT_NEAR(spread(l, {0, 1, 0}), up, 1e-3 * up);
    EXPECT_NEAR(spread(l, {0, 0, 1}), across, 0.1 * across);
  }
}

TEST(SmootherLights, ExcessLightsAndLightsWithoutTrackAreUnchanged) {
  Smoother smoother;
  std::vector<Light> lights;
  for (int i = 0; i < 20; ++i) {
    lights.clear();
    for (std::uint32_t k = 0; k < kMaxLights + 3; ++k)
      lights.push_back(lamp({1, 0.1F * static_cast<float>(k), 1}, 1, k));
    const std::vector<Light> found = lights;
    Projection p = sky();
    (void)smoother.apply(p, lights, frame_time(i), 0.01);
    EXPECT_EQ(lights, found) << "constant lights are unchanged";
  }
}

}  // namespace
}  // namespace lightwell::estimate
