#include "estimate/common/descriptor_optimizer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include <lightwell/cap.hpp>
#include <lightwell/query.hpp>

#include "reference/irradiance.hpp"
#include "reference/panorama.hpp"

namespace lightwell::estimate {
namespace {

namespace ref = reference;

/// A panorama's projection by plain sums over its pixels.
Projection projected(const ref::Panorama& p) {
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

/// What a cap adds to a projection.
void put(const Light& light, Projection& scene) {
  const BasisRow y = basis_row(vec_cast<double>(light.direction));
  std::size_t at = 0;
  const auto add = [&](int l) {
    for (int m = -l; m <= l; ++m, ++at)
      for (int c = 0; c < 3; ++c)
        scene.c[at][static_cast<std::size_t>(c)] +=
            light.irradiance[c] * cap_zonal(l, light.angular_radius_rad) * y[at];
  };
  for (int l = 0; l <= kMaxBand; ++l) add(l);
  for (const int l : kTailBands) add(l);
}

Light lamp(Vec3f direction, float irradiance, std::uint32_t track) {
  Light out;
  out.direction = normalized(direction);
  out.angular_radius_rad = 0.05F;
  out.irradiance = {irradiance, irradiance, irradiance};
  out.track = track;
  return out;
}

struct Answer {
  OptimizedDescriptor chosen;
  std::vector<Light> lights;
};

Answer optimize(DescriptorOptimizer& optimizer, const Projection& scene, std::span<const Light> found, const OptimizerOptions& limits,
              int required = -1) {
  Answer out;
  optimizer.optimize(scene, found, required, limits, out.lights, out.chosen);
  return out;
}

/// Up to a band, with all the lights, however small the error is.
Answer stop_at(int band, const Projection& scene, std::span<const Light> found) {
  DescriptorOptimizer optimizer;
  return optimize(optimizer, scene, found, {.band = band, .epsilon = 0});
}

double stated(const Answer& answer) { return relative(answer.chosen.truncation, answer.chosen.whole); }

double true_error(const ref::Panorama& p, const RadianceSh& rest, std::span<const Light> lights) {
  const auto normals = ref::fibonacci_normals(2048);
  const auto truth = ref::irradiance_at(p, normals);
  Descriptor d;
  d.radiance = rest;
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

TEST(DescriptorOptimizer, StatesTheErrorOfStoppingAtEachBand) {
  const ref::Panorama p = sky_and_lamp();
  const Projection scene = projected(p);
  for (const int band : {0, 1, 2, 3, 4, 5, 6}) {
    const Answer answer = stop_at(band, scene, {});
    const double truth = true_error(p, answer.chosen.rest, {});
    // Parseval is exact for the bands looked at; above 12 a point's spectrum is taken, a few percent of the rest.
    EXPECT_NEAR(stated(answer) / truth, 1, 0.05)
        << "band " << band << " stated " << stated(answer) << " true " << truth;
  }
}

TEST(DescriptorOptimizer, CountsWhatACapMissesOfItsLamp) {
  const ref::Panorama p = sky_and_lamp();
  const Projection scene = projected(p);
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
    const Answer answer = stop_at(4, scene, std::span(&light, 1));
    ASSERT_EQ(answer.lights.size(), 1U);
    const double error = stated(answer), truth = true_error(p, answer.chosen.rest, answer.lights);
    // The true error of the right cap is what floats leave, 1e-5.
    EXPECT_GT(error + 1e-4, 0.9 * truth);
    EXPECT_LT(error, 1.5 * truth + 1e-3);
    if (before > 0)
      EXPECT_GT(error, before) << "a worse cap is a larger error";
    else
      before = error;
  }
}

TEST(DescriptorOptimizer, OfASceneThatIsItsLightsLeavesNothing) {
  Light light;
  light.direction = normalized(Vec3f{0.2F, -0.3F, 0.9F});
  light.irradiance = {5, 4, 3};
  light.angular_radius_rad = 0.1F;
  Projection scene;
  put(light, scene);
  const Answer answer = stop_at(4, scene, std::span(&light, 1));
  EXPECT_LT(stated(answer), 1e-6);
  for (std::size_t i = 0; i < 25; ++i) EXPECT_NEAR(answer.chosen.rest.c[i].r, 0, 1e-5);
}

TEST(DescriptorOptimizer, OfDarknessIsNoError) {
  const Answer answer = stop_at(4, {}, {});
  EXPECT_EQ(answer.chosen.whole.plain, 0);
  EXPECT_EQ(stated(answer), 0);
}

TEST(DescriptorOptimizer, EvenLightIsBandZeroAndNoLight) {
  Projection scene;
  scene.c[0] = {3, 2, 1};
  DescriptorOptimizer optimizer;
  const Answer answer = optimize(optimizer, scene, {}, {});
  EXPECT_EQ(answer.chosen.rest.band, 0);
  EXPECT_TRUE(answer.lights.empty());
  EXPECT_EQ(stated(answer), 0);
}

TEST(DescriptorOptimizer, KeepsTheLimitAndIsRicherWhereItIsMuchTighter) {
  const ref::Panorama p = sky_and_lamp();
  const Projection scene = projected(p);
  Light sun = lamp({1, 2, 0.5F}, 0, 1);
  const auto e = static_cast<float>(std::numbers::pi * std::sin(0.05) * std::sin(0.05));
  sun.irradiance = {300 * e, 280 * e, 200 * e};
  std::vector<std::size_t> numbers;
  for (const double epsilon : {0.5, 0.1, 0.01, 0.002}) {
    DescriptorOptimizer optimizer;
    const Answer answer = optimize(optimizer, scene, std::span(&sun, 1), {.epsilon = epsilon});
    EXPECT_LE(true_error(p, answer.chosen.rest, answer.lights), epsilon);
    numbers.push_back(3 * static_cast<std::size_t>(sh_count(answer.chosen.rest.band)) + 7 * answer.lights.size());
  }
  EXPECT_LT(numbers.front(), numbers.back());
}

TEST(DescriptorOptimizer, ABrighterSceneIsDescribedAlike) {
  // What a number takes on the wire depends on how far its step lies from a power of two; the choice must not.
  for (int i = 0; i < 300; ++i) {
    // One light that may as well be described by band 4: the bytes decide.
    const auto a = static_cast<float>(i);
    Projection scene;
    for (std::size_t k = 0; k < 9; ++k)
      for (double& v : scene.c[k]) v = k == 0 ? 3 : 0.8 * std::sin(static_cast<double>(a) + 5 * static_cast<double>(k));
    const std::vector<Light> found = {
        lamp({std::sin(7 * a), std::cos(11 * a), std::sin(3 * a + 1)}, 0.3F + 0.02F * a, 1)};
    put(found[0], scene);
    const OptimizerOptions limits{.epsilon = 0.005 * (1 + i % 8)};
    DescriptorOptimizer first;
    const Answer one = optimize(first, scene, found, limits);
    for (const float factor : {1e-6F, 3e-3F, 1.2F, 1.5F, 1.9F, 1e7F}) {
      Projection brighter = scene;
      for (auto& c : brighter.c)
        for (double& v : c) v *= static_cast<double>(factor);
      std::vector<Light> lights = found;
      for (Light& light : lights) light.irradiance = light.irradiance * factor;
      DescriptorOptimizer afresh;
      const Answer same = optimize(afresh, brighter, lights, limits);
      ASSERT_EQ(same.lights.size(), one.lights.size()) << "scene " << i << " times " << factor;
      ASSERT_EQ(same.chosen.rest.band, one.chosen.rest.band) << "scene " << i << " times " << factor;
    }
  }
}

TEST(DescriptorOptimizer, BandsWithoutIrradianceAreSentForReflectionsAlone) {
  const Projection scene = projected(sky_and_lamp());
  DescriptorOptimizer plain, glossy;
  const Answer matte = optimize(plain, scene, {}, {.epsilon = 1e-4});
  ASSERT_GE(matte.chosen.rest.band, 4);
  for (const std::size_t l : {3U, 5U})
    for (std::size_t i = l * l; i < (l + 1) * (l + 1); ++i) EXPECT_EQ(matte.chosen.rest.c[i], (Radiance{})) << i;
  const Answer shiny = optimize(glossy, scene, {}, {.epsilon = 1e-4, .radiance_epsilon = 1e-4});
  float third = 0;
  for (std::size_t i = 9; i < 16; ++i) third += std::abs(shiny.chosen.rest.c[i].g);
  EXPECT_GT(third, 0);
}

TEST(DescriptorOptimizer, ALightThatMustBeKeptIsKept) {
  Projection scene;
  scene.c[0] = {300, 300, 300};
  const Light faint = lamp({0, 1, 0}, 1e-4F, 7);
  put(faint, scene);
  DescriptorOptimizer without, with;
  EXPECT_TRUE(optimize(without, scene, std::span(&faint, 1), {}).lights.empty());
  const Answer answer = optimize(with, scene, std::span(&faint, 1), {}, 0);
  ASSERT_EQ(answer.lights.size(), 1U);
  EXPECT_EQ(answer.lights[0].track, 7U);
}

TEST(DescriptorOptimizer, AskedForMoreThanItMaySendItComesAsNearAsItMay) {
  const Projection scene = projected(sky_and_lamp());
  DescriptorOptimizer optimizer;
  const Answer answer = optimize(optimizer, scene, {}, {.band = 2, .epsilon = 1e-4});
  EXPECT_EQ(answer.chosen.rest.band, 2);
  EXPECT_GT(stated(answer), 1e-4) << "and says that it is not as good as was asked";
}

TEST(DescriptorOptimizer, OfEvenLightNoLampButTheBrightestIsWorthFinding) {
  Projection scene;
  scene.c[0] = {3, 2, 1};
  Light faint = lamp({0, 1, 0}, 1e-4F, 0);
  put(faint, scene);
  DescriptorOptimizer optimizer;
  EXPECT_EQ(optimizer.max_lights_to_find(scene, &faint, {}), 1);
  EXPECT_EQ(optimizer.max_lights_to_find(scene, nullptr, {}), 1);
}

TEST(DescriptorOptimizer, WithoutALimitEveryLampIsWorthFinding) {
  Projection scene;
  scene.c[0] = {3, 2, 1};
  DescriptorOptimizer optimizer;
  EXPECT_EQ(optimizer.max_lights_to_find(scene, nullptr, {.max_lights = 64, .epsilon = 0}), 64);
}

TEST(DescriptorOptimizer, WhereNoBandKeepsTheLimitEveryLampIsWorthFinding) {
  Projection scene;
  for (const Vec3f& d : {Vec3f{1, 0, 0}, Vec3f{0, 1, 0}, Vec3f{0, 0, 1}}) put(lamp(d, 1, 0), scene);
  const Light one = lamp({1, 0, 0}, 1, 0);
  DescriptorOptimizer optimizer;
  EXPECT_EQ(optimizer.max_lights_to_find(scene, &one, {.max_lights = 9, .epsilon = 0.002}), 9);
}

TEST(DescriptorOptimizer, WhereNoiseIsMoreThanTheLimitLampsDoNotHelp) {
  Projection scene;
  scene.c[0] = {10, 10, 10};
  const Light one = lamp({1, 0, 0}, 0.01F, 0);
  put(one, scene);
  put(lamp({0, 1, 0}, 0.01F, 0), scene);
  DescriptorOptimizer optimizer;
  EXPECT_EQ(optimizer.max_lights_to_find(scene, &one, {.epsilon = 0.01, .independent_error = 0.1}), 1);
}

TEST(DescriptorOptimizer, WhatWasSentStaysWorthFinding) {
  std::vector<Light> found;
  Projection scene;
  for (const Vec3f& d : {Vec3f{1, 0, 0}, Vec3f{0, 1, 0}, Vec3f{0, 0, 1}}) {
    found.push_back(lamp(d, 1, static_cast<std::uint32_t>(found.size() + 1)));
    put(found.back(), scene);
  }
  DescriptorOptimizer optimizer;
  ASSERT_EQ(optimize(optimizer, scene, found, {.epsilon = 0.002}).lights.size(), 3U);
  Projection even;
  even.c[0] = {3, 2, 1};
  EXPECT_EQ(optimizer.max_lights_to_find(even, nullptr, {}), 3);
}

TEST(DescriptorOptimizer, LampsThatWereNotWorthFindingWouldNotHaveBeenSent) {
  // Lamps of all strengths over smooth light; the one that is brightest to the eye need not give the most.
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(0, 1);
  std::normal_distribution<float> normal;
  int saved = 0;
  for (int i = 0; i < 400; ++i) {
    Projection scene;
    scene.c[0] = {10, 10, 10};
    for (std::size_t k = 1; k < 9; ++k)
      for (double& v : scene.c[k]) v = normal(random);
    std::vector<Light> found(static_cast<std::size_t>(1 + i % 12));
    for (Light& light : found) {
      light = lamp({normal(random), normal(random), normal(random)}, 3 * std::pow(uniform(random), 4.0F), 0);
      put(light, scene);
    }
    std::sort(found.begin(), found.end(),
              [](const Light& a, const Light& b) { return a.irradiance.r > b.irradiance.r; });
    for (std::size_t k = 0; k < found.size(); ++k) found[k].track = static_cast<std::uint32_t>(k + 1);
    const std::size_t brightest = static_cast<std::size_t>(i) % found.size();
    const OptimizerOptions limits{.epsilon = i % 2 == 0 ? 0.01 : 0.03};

    DescriptorOptimizer of_all, of_few;
    const Answer all = optimize(of_all, scene, found, limits);
    const auto worth = static_cast<std::size_t>(of_few.max_lights_to_find(scene, &found[brightest], limits));
    std::vector<Light> few(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(std::min(worth, found.size())));
    if (brightest >= few.size()) few.back() = found[brightest];
    saved += static_cast<int>(found.size() - few.size());
    const Answer less = optimize(of_few, scene, few, limits);
    ASSERT_EQ(less.chosen.rest.band, all.chosen.rest.band) << "scene " << i;
    ASSERT_EQ(less.lights.size(), all.lights.size()) << "scene " << i;
  }
  EXPECT_GT(saved, 400) << "and many were not";
}

/// Even light with a pattern of band 4 of the relative RMS that is given.
Projection patterned(double share) {
  Projection scene;
  scene.c[0] = {10, 10, 10};
  const double c = 10 * cosine_lobe(0) / cosine_lobe(4) * share;
  scene.c[18] = {c, c, c};
  return scene;
}

TEST(DescriptorOptimizer, ASceneThatWaversAboutTheLimitDoesNotMakeItsBandFlicker) {
  // Band 0 may be stopped at up to 0.9 of the limit less what rounding takes.
  std::set<int> afresh;
  DescriptorOptimizer optimizer;
  int changes = 0, before = -1;
  for (int frame = 0; frame < 100; ++frame) {
    const Projection scene = patterned(0.0088 * (1 + 0.03 * std::sin(frame)));
    DescriptorOptimizer new_one;
    afresh.insert(optimize(new_one, scene, {}, {}).chosen.rest.band);
    const int band = optimize(optimizer, scene, {}, {}).chosen.rest.band;
    changes += before >= 0 && band != before ? 1 : 0;
    before = band;
  }
  EXPECT_EQ(afresh.size(), 2U) << "the scene crosses the limit";
  EXPECT_LE(changes, 1);
}

TEST(DescriptorOptimizer, TwoLampsThatAreAlikeDoNotTakeTurns) {
  DescriptorOptimizer optimizer;
  std::set<std::uint32_t> afresh, kept;
  for (int frame = 0; frame < 50; ++frame) {
    const auto waver = static_cast<float>(0.02 * std::sin(2.0 * frame));
    const Light found[] = {lamp({1, 1, 0}, 1 + waver, 1), lamp({-1, 1, 0}, 1 - waver, 2)};
    Projection scene;
    scene.c[0] = {1, 1, 1};
    for (const Light& light : found) put(light, scene);
    DescriptorOptimizer new_one;
    const Answer one = optimize(new_one, scene, found, {.max_lights = 1});
    ASSERT_EQ(one.lights.size(), 1U);
    afresh.insert(one.lights[0].track);
    kept.insert(optimize(optimizer, scene, found, {.max_lights = 1}).lights.at(0).track);
  }
  EXPECT_EQ(afresh.size(), 2U) << "the stronger of the two changes";
  EXPECT_EQ(kept.size(), 1U);
}

}  // namespace
}  // namespace lightwell::estimate
