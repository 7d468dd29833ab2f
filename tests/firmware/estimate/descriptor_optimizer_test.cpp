#include "estimate/common/descriptor_optimizer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include <lightwell/cap.hpp>
#include <lightwell/query.hpp>

#include "cap_projection.hpp"
#include "reference/irradiance.hpp"
#include "reference/panorama.hpp"

namespace lightwell::estimate {
namespace {

namespace ref = reference;

/// Projection of a panorama by plain sums over its pixels.
Projection project(const ref::Panorama& p) {
  Projection out;
  for (int j = 0; j < p.height; ++j) {
    for (int i = 0; i < p.width; ++i) {
      const ref::V3 d = ref::pixel_direction(i, j, p.width, p.height);
      const BasisRow y = basis_row({d.x, d.y, d.z});
      const ref::Rgb l = ref::pixel(p, i, j);
      const double sr = ref::pixel_solid_angle(j, p.width, p.height);
      for (std::size_t k = 0; k < kRowCount; ++k)
        for (std::size_t c = 0; c < 3; ++c) out.c[k][c] += sr * l[c] * y[k];
    }
  }
  return out;
}

struct Selection {
  OptimizedDescriptor descriptor;
  std::vector<Light> lights;
};

Selection optimize(DescriptorOptimizer& optimizer, const Projection& scene, std::span<const Light> candidates,
                   const OptimizerOptions& limits, int required = -1) {
  Selection out;
  optimizer.optimize(scene, candidates, required, limits, out.lights, out.descriptor);
  return out;
}

/// Optimizes with a given last band and all lights (epsilon 0).
Selection stop_at(int band, const Projection& scene, std::span<const Light> candidates) {
  DescriptorOptimizer optimizer;
  return optimize(optimizer, scene, candidates, {.band = band, .epsilon = 0});
}

double predicted_error(const Selection& result) {
  return relative(result.descriptor.truncation, result.descriptor.scene_rms);
}

double true_error(const ref::Panorama& p, const RadianceSh& residual, std::span<const Light> lights) {
  const auto normals = ref::fibonacci_normals(2048);
  const auto truth = ref::irradiance_at(p, normals);
  Descriptor d;
  d.radiance = residual;
  d.lights.assign(lights.begin(), lights.end());
  std::vector<ref::Rgb> got;
  for (const ref::V3& n : normals) {
    const Irradiance e = irradiance_at(d, {static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)});
    got.push_back({e.r, e.g, e.b});
  }
  const ref::IrradianceError e = ref::irradiance_error(truth, got);
  return std::max(e.rms, e.luminance_weighted);
}

ref::Panorama sky_and_lamp() {
  const ref::Panorama sky = ref::from_function(
      256, 128,
      [](const ref::V3& d) {
        return ref::Rgb{d.y > 0 ? 2.0 : 0.3, d.y > 0 ? 2.5 : 0.3, d.y > 0 ? 4.0 : 0.2};
      },
      4);
  return ref::sum(sky, ref::disc_lamp(256, 128, ref::normalised({1, 2, 0.5}), 0.05, {300, 280, 200}));
}

TEST(DescriptorOptimizer, PredictsTheTruncationErrorOfEachBand) {
  const ref::Panorama p = sky_and_lamp();
  const Projection scene = project(p);
  for (const int band : {0, 1, 2, 3, 4, 5, 6}) {
    const Selection result = stop_at(band, scene, {});
    const double truth = true_error(p, result.descriptor.residual, {});
    // Parseval is exact for the projected bands; above 12 the spectrum of a point is assumed (a few percent of the
    // rest).
    EXPECT_NEAR(predicted_error(result) / truth, 1, 0.05)
        << "band " << band << " stated " << predicted_error(result) << " true " << truth;
  }
}

TEST(DescriptorOptimizer, PredictsTheErrorOfAnInaccurateCap) {
  const ref::Panorama p = sky_and_lamp();
  const Projection scene = project(p);
  Light right;
  right.direction = normalized(Vec3f{1, 2, 0.5F});
  right.angular_radius_rad = 0.05F;
  const auto e = static_cast<float>(std::numbers::pi * std::sin(0.05) * std::sin(0.05));
  right.irradiance = {300 * e, 280 * e, 200 * e};
  Light off = right;
  off.direction = normalized(Vec3f{1.15F, 2, 0.5F});
  Light wide = right;
  wide.angular_radius_rad = 0.6F;
  double before = 0;
  for (const Light& light : {right, off, wide}) {
    const Selection result = stop_at(4, scene, std::span(&light, 1));
    ASSERT_EQ(result.lights.size(), 1U);
    const double error = predicted_error(result), truth = true_error(p, result.descriptor.residual, result.lights);
    // The true error of the correct cap is rounding of floats, 1e-5.
    EXPECT_GT(error + 1e-4, 0.9 * truth);
    EXPECT_LT(error, 1.5 * truth + 1e-3);
    if (before > 0)
      EXPECT_GT(error, before) << "a worse cap is a larger error";
    else
      before = error;
  }
}

TEST(DescriptorOptimizer, LeavesNoResidualWhereTheSceneIsItsLights) {
  Light light;
  light.direction = normalized(Vec3f{0.2F, -0.3F, 0.9F});
  light.irradiance = {5, 4, 3};
  light.angular_radius_rad = 0.1F;
  Projection scene;
  add_cap(light, scene);
  const Selection result = stop_at(4, scene, std::span(&light, 1));
  EXPECT_LT(predicted_error(result), 1e-6);
  for (std::size_t i = 0; i < 25; ++i) EXPECT_NEAR(result.descriptor.residual.c[i].r, 0, 1e-5);
}

TEST(DescriptorOptimizer, DarknessHasNoError) {
  const Selection result = stop_at(4, {}, {});
  EXPECT_EQ(result.descriptor.scene_rms.plain, 0);
  EXPECT_EQ(predicted_error(result), 0);
}

TEST(DescriptorOptimizer, UniformLightIsBandZeroWithoutLights) {
  Projection scene;
  scene.c[0] = {3, 2, 1};
  DescriptorOptimizer optimizer;
  const Selection result = optimize(optimizer, scene, {}, {});
  EXPECT_EQ(result.descriptor.residual.band, 0);
  EXPECT_TRUE(result.lights.empty());
  EXPECT_EQ(predicted_error(result), 0);
}

TEST(DescriptorOptimizer, StaysWithinTheLimitAndSendsMoreForATighterOne) {
  const ref::Panorama p = sky_and_lamp();
  const Projection scene = project(p);
  Light sun = lamp({1, 2, 0.5F}, 0, 1);
  const auto e = static_cast<float>(std::numbers::pi * std::sin(0.05) * std::sin(0.05));
  sun.irradiance = {300 * e, 280 * e, 200 * e};
  std::vector<std::size_t> numbers;
  for (const double epsilon : {0.5, 0.1, 0.01, 0.002}) {
    DescriptorOptimizer optimizer;
    const Selection result = optimize(optimizer, scene, std::span(&sun, 1), {.epsilon = epsilon});
    EXPECT_LE(true_error(p, result.descriptor.residual, result.lights), epsilon);
    numbers.push_back(3 * static_cast<std::size_t>(sh_count(result.descriptor.residual.band)) +
                      7 * result.lights.size());
  }
  EXPECT_LT(numbers.front(), numbers.back());
}

TEST(DescriptorOptimizer, SelectionIsIndependentOfBrightness) {
  // The bytes of a coefficient depend on the ratio of the step to a power of two; the selection must not.
  for (int i = 0; i < 300; ++i) {
    // One light that band 4 may describe as well: the bytes decide.
    const auto a = static_cast<float>(i);
    Projection scene;
    for (std::size_t k = 0; k < 9; ++k)
      for (double& v : scene.c[k]) v = k == 0 ? 3 : 0.8 * std::sin(static_cast<double>(a) + 5 * static_cast<double>(k));
    const std::vector<Light> candidates = {
        lamp({std::sin(7 * a), std::cos(11 * a), std::sin(3 * a + 1)}, 0.3F + 0.02F * a, 1)};
    add_cap(candidates[0], scene);
    const OptimizerOptions limits{.epsilon = 0.005 * (1 + i % 8)};
    DescriptorOptimizer first;
    const Selection one = optimize(first, scene, candidates, limits);
    for (const float factor : {1e-6F, 3e-3F, 1.2F, 1.5F, 1.9F, 1e7F}) {
      Projection brighter = scene;
      for (auto& c : brighter.c)
        for (double& v : c) v *= static_cast<double>(factor);
      std::vector<Light> lights = candidates;
      for (Light& light : lights) light.irradiance = light.irradiance * factor;
      DescriptorOptimizer without_history;
      const Selection same = optimize(without_history, brighter, lights, limits);
      ASSERT_EQ(same.lights.size(), one.lights.size()) << "scene " << i << " times " << factor;
      ASSERT_EQ(same.descriptor.residual.band, one.descriptor.residual.band) << "scene " << i << " times " << factor;
    }
  }
}

TEST(DescriptorOptimizer, BandsWithoutIrradianceAreSentOnlyWithARadianceLimit) {
  const Projection scene = project(sky_and_lamp());
  DescriptorOptimizer plain, glossy;
  const Selection matte = optimize(plain, scene, {}, {.epsilon = 1e-4});
  ASSERT_GE(matte.descriptor.residual.band, 4);
  for (const std::size_t l : {3U, 5U})
    for (std::size_t i = l * l; i < (l + 1) * (l + 1); ++i)
      EXPECT_EQ(matte.descriptor.residual.c[i], (Radiance{})) << i;
  const Selection shiny = optimize(glossy, scene, {}, {.epsilon = 1e-4, .radiance_epsilon = 1e-4});
  float third = 0;
  for (std::size_t i = 9; i < 16; ++i) third += std::abs(shiny.descriptor.residual.c[i].g);
  EXPECT_GT(third, 0);
}

TEST(DescriptorOptimizer, SelectsTheRequiredLight) {
  Projection scene;
  scene.c[0] = {300, 300, 300};
  const Light faint = lamp({0, 1, 0}, 1e-4F, 7);
  add_cap(faint, scene);
  DescriptorOptimizer without, with;
  EXPECT_TRUE(optimize(without, scene, std::span(&faint, 1), {}).lights.empty());
  const Selection result = optimize(with, scene, std::span(&faint, 1), {}, 0);
  ASSERT_EQ(result.lights.size(), 1U);
  EXPECT_EQ(result.lights[0].track, 7U);
}

TEST(DescriptorOptimizer, WithoutASufficientConfigurationTakesTheSmallestError) {
  const Projection scene = project(sky_and_lamp());
  DescriptorOptimizer optimizer;
  const Selection result = optimize(optimizer, scene, {}, {.band = 2, .epsilon = 1e-4});
  EXPECT_EQ(result.descriptor.residual.band, 2);
  EXPECT_GT(predicted_error(result), 1e-4) << "the limit is not reachable";
}

TEST(DescriptorOptimizer, InUniformLightOnlyTheBrightestLightIsSearched) {
  Projection scene;
  scene.c[0] = {3, 2, 1};
  Light faint = lamp({0, 1, 0}, 1e-4F, 0);
  add_cap(faint, scene);
  DescriptorOptimizer optimizer;
  EXPECT_EQ(optimizer.max_lights_to_find(scene, &faint, {}), 1);
  EXPECT_EQ(optimizer.max_lights_to_find(scene, nullptr, {}), 1);
}

TEST(DescriptorOptimizer, WithoutAnErrorLimitAllLightsAreSearched) {
  Projection scene;
  scene.c[0] = {3, 2, 1};
  DescriptorOptimizer optimizer;
  EXPECT_EQ(optimizer.max_lights_to_find(scene, nullptr, {.max_lights = 64, .epsilon = 0}), 64);
}

TEST(DescriptorOptimizer, WhereNoBandIsSufficientAllLightsAreSearched) {
  Projection scene;
  for (const Vec3f& d : {Vec3f{1, 0, 0}, Vec3f{0, 1, 0}, Vec3f{0, 0, 1}}) add_cap(lamp(d, 1, 0), scene);
  const Light one = lamp({1, 0, 0}, 1, 0);
  DescriptorOptimizer optimizer;
  EXPECT_EQ(optimizer.max_lights_to_find(scene, &one, {.max_lights = 9, .epsilon = 0.002}), 9);
}

TEST(DescriptorOptimizer, WhereNoiseExceedsTheLimitNoFurtherLightsAreSearched) {
  Projection scene;
  scene.c[0] = {10, 10, 10};
  const Light one = lamp({1, 0, 0}, 0.01F, 0);
  add_cap(one, scene);
  add_cap(lamp({0, 1, 0}, 0.01F, 0), scene);
  DescriptorOptimizer optimizer;
  EXPECT_EQ(optimizer.max_lights_to_find(scene, &one, {.epsilon = 0.01, .independent_error = 0.1}), 1);
}

TEST(DescriptorOptimizer, SearchesAsManyLightsAsWereSentBefore) {
  std::vector<Light> candidates;
  Projection scene;
  for (const Vec3f& d : {Vec3f{1, 0, 0}, Vec3f{0, 1, 0}, Vec3f{0, 0, 1}}) {
    candidates.push_back(lamp(d, 1, static_cast<std::uint32_t>(candidates.size() + 1)));
    add_cap(candidates.back(), scene);
  }
  DescriptorOptimizer optimizer;
  ASSERT_EQ(optimize(optimizer, scene, candidates, {.epsilon = 0.002}).lights.size(), 3U);
  Projection even;
  even.c[0] = {3, 2, 1};
  EXPECT_EQ(optimizer.max_lights_to_find(even, nullptr, {}), 3);
}

TEST(DescriptorOptimizer, LimitOnSearchedLightsDoesNotChangeTheSelection) {
  // Lamps of all strengths in smooth light; the one with the highest peak need not have the largest irradiance.
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(0, 1);
  std::normal_distribution<float> normal;
  int saved = 0;
  for (int i = 0; i < 400; ++i) {
    Projection scene;
    scene.c[0] = {10, 10, 10};
    for (std::size_t k = 1; k < 9; ++k)
      for (double& v : scene.c[k]) v = normal(random);
    std::vector<Light> candidates(static_cast<std::size_t>(1 + i % 12));
    for (Light& light : candidates) {
      light = lamp({normal(random), normal(random), normal(random)}, 3 * std::pow(uniform(random), 4.0F), 0);
      add_cap(light, scene);
    }
    std::sort(candidates.begin(), candidates.end(),
              [](const Light& a, const Light& b) { return a.irradiance.r > b.irradiance.r; });
    for (std::size_t k = 0; k < candidates.size(); ++k) candidates[k].track = static_cast<std::uint32_t>(k + 1);
    const std::size_t brightest = static_cast<std::size_t>(i) % candidates.size();
    const OptimizerOptions limits{.epsilon = i % 2 == 0 ? 0.01 : 0.03};

    DescriptorOptimizer of_all, of_few;
    const Selection all = optimize(of_all, scene, candidates, limits);
    const auto limit = static_cast<std::size_t>(of_few.max_lights_to_find(scene, &candidates[brightest], limits));
    std::vector<Light> few(candidates.begin(),
                           candidates.begin() + static_cast<std::ptrdiff_t>(std::min(limit, candidates.size())));
    if (brightest >= few.size()) few.back() = candidates[brightest];
    saved += static_cast<int>(candidates.size() - few.size());
    const Selection less = optimize(of_few, scene, few, limits);
    ASSERT_EQ(less.descriptor.residual.band, all.descriptor.residual.band) << "scene " << i;
    ASSERT_EQ(less.lights.size(), all.lights.size()) << "scene " << i;
  }
  EXPECT_GT(saved, 400) << "too few lights were omitted to test anything";
}

/// Uniform light with a pattern in band 4 of the given relative RMS.
Projection scene_with_pattern(double relative_rms) {
  Projection scene;
  scene.c[0] = {10, 10, 10};
  const double c = 10 * cosine_lobe(0) / cosine_lobe(4) * relative_rms;
  scene.c[18] = {c, c, c};
  return scene;
}

TEST(DescriptorOptimizer, BandIsStableForASceneNearTheLimit) {
  // Band 0 suffices up to 0.9 of the limit, minus rounding in quadrature.
  std::set<int> without_history;
  DescriptorOptimizer optimizer;
  int changes = 0, before = -1;
  for (int frame = 0; frame < 100; ++frame) {
    const Projection scene = scene_with_pattern(0.0088 * (1 + 0.03 * std::sin(frame)));
    DescriptorOptimizer fresh;
    without_history.insert(optimize(fresh, scene, {}, {}).descriptor.residual.band);
    const int band = optimize(optimizer, scene, {}, {}).descriptor.residual.band;
    changes += before >= 0 && band != before ? 1 : 0;
    before = band;
  }
  EXPECT_EQ(without_history.size(), 2U) << "the scene crosses the limit";
  EXPECT_LE(changes, 1);
}

TEST(DescriptorOptimizer, TwoSimilarLightsDoNotAlternate) {
  DescriptorOptimizer optimizer;
  std::set<std::uint32_t> without_history, with_history;
  for (int frame = 0; frame < 50; ++frame) {
    const auto variation = static_cast<float>(0.02 * std::sin(2.0 * frame));
    const Light candidates[] = {lamp({1, 1, 0}, 1 + variation, 1), lamp({-1, 1, 0}, 1 - variation, 2)};
    Projection scene;
    scene.c[0] = {1, 1, 1};
    for (const Light& light : candidates) add_cap(light, scene);
    DescriptorOptimizer fresh;
    const Selection one = optimize(fresh, scene, candidates, {.max_lights = 1});
    ASSERT_EQ(one.lights.size(), 1U);
    without_history.insert(one.lights[0].track);
    with_history.insert(optimize(optimizer, scene, candidates, {.max_lights = 1}).lights.at(0).track);
  }
  EXPECT_EQ(without_history.size(), 2U) << "the stronger of the two changes";
  EXPECT_EQ(with_history.size(), 1U);
}

}  // namespace
}  // namespace lightwell::estimate
