// Selections of limited size against an exhaustive search over encoded messages.
#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/codec.hpp>

#include "cap_projection.hpp"
#include "estimate/common/descriptor_optimizer.hpp"

namespace lightwell::estimate {
namespace {

/// Bytes of lights and residual in an encoded message.
std::size_t wire_bytes(const RadianceSh& residual, float step, std::span<const Light> lights) {
  Encoder encoder;
  Descriptor d;
  const std::size_t nothing = encoder.encode(d)->size();
  const std::size_t empty_radiance = 2 + 2 + 2 + 3;  // Tags, lengths, bands, three zeros.
  d.radiance = residual;
  d.radiance_step = step;
  d.lights.assign(lights.begin(), lights.end());
  return encoder.encode(d)->size() - nothing + empty_radiance;
}

/// RMS irradiance by Parseval of what a reader of this message lacks of the scene, relative to it; the larger of plain
/// and weighted.
double received_error(const Projection& scene, const RadianceSh& residual, float step, std::span<const Light> lights) {
  Encoder encoder;
  Descriptor d;
  d.radiance = residual;
  d.radiance_step = step;
  d.lights.assign(lights.begin(), lights.end());
  const Result<Descriptor> received = decode_descriptor(*encoder.encode(d));
  Projection left = scene;
  for (Light light : received->lights) {
    light.irradiance = light.irradiance * -1.0F;
    add_cap(light, left);
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(received->radiance.count()); ++i)
    for (int k = 0; k < 3; ++k) left.c[i][static_cast<std::size_t>(k)] -= received->radiance.c[i][k];
  return relative(irradiance_rms(left), irradiance_rms(scene));
}

/// The least error of all subsets of the lights, last bands and steps whose messages have at most `max_bytes`.
double least_error(const Projection& scene, std::span<const Light> candidates, std::size_t max_bytes) {
  double least = 1e9;
  for (unsigned subset = 0; subset < 1U << candidates.size(); ++subset) {
    std::vector<Light> lights;
    Projection rest = scene;
    for (std::size_t j = 0; j < candidates.size(); ++j) {
      if ((subset >> j & 1U) == 0) continue;
      lights.push_back(candidates[j]);
      Light taken = candidates[j];
      taken.irradiance = taken.irradiance * -1.0F;
      add_cap(taken, rest);
    }
    for (const int band : {0, 1, 2, 4, 6}) {
      RadianceSh residual;
      residual.band = band;
      for (int l = 0; l <= band; ++l)
        for (int i = l * l; i < sh_count(l) && (l < 2 || l % 2 == 0); ++i)
          for (int k = 0; k < 3; ++k)
            residual.c[static_cast<std::size_t>(i)][k] =
                static_cast<float>(rest.c[static_cast<std::size_t>(i)][static_cast<std::size_t>(k)]);
      for (int exponent = -16; exponent <= 4; ++exponent) {
        const float step = std::ldexp(1.0F, exponent);
        if (wire_bytes(residual, step, lights) <= max_bytes)
          least = std::min(least, received_error(scene, residual, step, lights));
      }
    }
  }
  return least;
}

TEST(DescriptorSize, ALimitedSizeHasNearlyTheLeastErrorOfAllThatFits) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> unit(0, 1);
  double sum = 0, worst = 0;
  int cases = 0;
  for (int i = 0; i < 12; ++i) {
    Projection scene;
    const auto falling = [](std::size_t k) { return 1 / (1 + static_cast<double>(k)); };
    for (std::size_t k = 0; k < kRowCount; ++k)
      for (double& v : scene.c[k]) v = k == 0 ? 6 : 4 * falling(k) * static_cast<double>(unit(random) - 0.5F);
    std::vector<Light> candidates;
    for (std::uint32_t track = 1; track <= 4; ++track) {
      candidates.push_back(lamp({unit(random) - 0.5F, unit(random) - 0.5F, unit(random) - 0.5F},
                                std::pow(10.0F, -1 + 2 * unit(random)), track));
      add_cap(candidates.back(), scene);
    }
    std::ranges::sort(candidates, std::greater{}, [](const Light& l) { return l.irradiance.g; });
    for (const std::size_t bytes : {15U, 30U, 50U, 80U, 120U, 200U}) {
      DescriptorOptimizer optimizer;
      OptimizedDescriptor d;
      std::vector<Light> lights;
      optimizer.optimize(scene, candidates, -1, {.epsilon = 0, .max_bytes = bytes}, lights, d);
      ASSERT_LE(wire_bytes(d.residual, d.step, lights), bytes);
      const double error = received_error(scene, d.residual, d.step, lights);
      const double least = least_error(scene, candidates, bytes);
      worst = std::max(worst, error / least);
      sum += error / least;
      ++cases;
    }
  }
  // Lights are added one by one, and sizes are upper limits: a byte or two of each light is not used.
  EXPECT_LT(sum / cases, 1.05);
  EXPECT_LT(worst, 2);
}

TEST(DescriptorSize, ASelectionThatFitsIsNotChanged) {
  Projection scene;
  for (std::size_t k = 0; k < kRowCount; ++k)
    for (double& v : scene.c[k]) v = k == 0 ? 6 : std::sin(static_cast<double>(k)) / static_cast<double>(k);
  DescriptorOptimizer free_size, limited, small;
  OptimizedDescriptor all, same, less;
  std::vector<Light> lights;
  free_size.optimize(scene, {}, -1, {}, lights, all);
  limited.optimize(scene, {}, -1, {.max_bytes = 200}, lights, same);
  EXPECT_EQ(same.residual, all.residual);
  EXPECT_EQ(same.step, all.step);
  small.optimize(scene, {}, -1, {.max_bytes = 15}, lights, less);
  EXPECT_EQ(less.residual.band, 0);
  EXPECT_GT(less.truncation.plain, all.truncation.plain);
}

TEST(DescriptorSize, DarknessFits) {
  DescriptorOptimizer optimizer;
  OptimizedDescriptor d;
  std::vector<Light> lights;
  optimizer.optimize({}, {}, -1, {.epsilon = 0, .max_bytes = 15}, lights, d);
  EXPECT_LE(wire_bytes(d.residual, d.step, lights), 15U);
  EXPECT_EQ(d.truncation.plain, 0);
}

TEST(DescriptorSize, TheSelectionIsKeptWhileAnotherIsHardlyBetter) {
  // Two lights of which one may be sent; their gains differ by a few percent and change places.
  DescriptorOptimizer optimizer;
  std::vector<Light> candidates = {lamp({1, 0, 0}, 1, 1), lamp({0, 0, 1}, 1, 2)}, lights;
  std::uint32_t first = 0;
  for (int frame = 0; frame < 10; ++frame) {
    const float swing = frame % 2 == 0 ? 1.01F : 0.99F;
    candidates[0].irradiance = {swing, swing, swing};
    Projection scene;
    scene.c[0] = {3, 3, 3};
    for (const Light& light : candidates) add_cap(light, scene);
    OptimizedDescriptor d;
    optimizer.optimize(scene, candidates, -1, {.max_lights = 1, .epsilon = 0, .max_bytes = 92}, lights, d);
    ASSERT_EQ(lights.size(), 1U) << frame;
    if (frame == 0) first = lights[0].track;
    EXPECT_EQ(lights[0].track, first) << frame;
  }
}

}  // namespace
}  // namespace lightwell::estimate
