// Shadows against the reference ray tracer.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/descriptor.hpp>
#include <lightwell/shadows.hpp>

#include "host_sdk/shadow_casts.hpp"
#include "host_sdk/shadow_scenes.hpp"
#include "reference/shadow_tracer.hpp"

namespace lightwell::test {
namespace {

using reference::ShadowLight;
using reference::TriangleMesh;

TEST(Shadows, AgreeWithTheRayTracer) {
  // Measured by measure_shadows at the default setting over the same scenes with 10,000 triangles: RMS at most 0.010,
  // 99 % at most 0.03, largest 0.05 of ten times as many texels (96 directions of the residual, and pieces of outlines
  // that overlap within a texel). The ray tracer's own error is about 0.003 at 1,024 rays.
  for (const ShadowCaseOptions& options : shadow_cases(2000)) {
    SCOPED_TRACE(options.name);
    const ShadowCase test_case = make_shadow_case(options);
    const ShadowReceiver receiver = test_case.receiver(256);
    std::vector<LightRatio> ratios(256 * 256);
    ShadowCaster caster = make_caster();
    ASSERT_TRUE(caster.cast(test_case.lighting, receiver, test_case.mesh(), ratios).ok());
    const ShadowErrors errors = shadow_errors(trace_texels(test_case, receiver, 150, 1024), receiver, ratios);
    EXPECT_LT(errors.rms, 0.012);
    EXPECT_LT(errors.percentile_99, 0.036);
    EXPECT_LT(errors.largest, 0.05);
  }
}

TEST(Shadows, MoreSamplesAreMoreExact) {
  ShadowCaseOptions options{"chair", "chair", 2000, {3, 10}, 20, 80, 0.4, 5};
  const ShadowCase test_case = make_shadow_case(options);
  const ShadowReceiver receiver = test_case.receiver(256);
  const std::vector<TracedTexel> truth = trace_texels(test_case, receiver, 150, 2048);
  double before = 1;
  for (const ShadowOptions setting : {ShadowOptions{4, 16, 4}, ShadowOptions{32, 96, 1}, ShadowOptions{256, 512, 1}}) {
    std::vector<LightRatio> ratios(256 * 256);
    ShadowCaster caster = make_caster(setting);
    ASSERT_TRUE(caster.cast(test_case.lighting, receiver, test_case.mesh(), ratios).ok());
    const double rms = shadow_errors(truth, receiver, ratios).rms;
    EXPECT_LT(rms, 0.8 * before);
    before = rms;
  }
  // The ray tracer's own error at 2,048 rays, and as much again.
  EXPECT_LT(before, 0.004);
}

/// Against the ray tracer at about 1,000 texels.
void expect_as_traced(const Scene& scene, const reference::ShadowScene& traced, double tolerance, int rays) {
  const reference::ShadowTracer tracer(traced);
  const Cast result = cast(scene, {256, 256, 1});
  double largest = 0;
  const std::size_t step = scene.texels() > 1100 ? 31 : 1;
  for (std::size_t i = 0; i < scene.texels(); i += step) {
    const int column = static_cast<int>(i) % scene.receiver.columns, row = static_cast<int>(i) / scene.receiver.columns;
    const reference::Rgb truth = tracer.ratio(rectangle_of(scene.receiver, column, row), rays);
    for (int c = 0; c < 3; ++c)
      largest = std::max(largest, std::abs(result.at(scene, column, row)[c] - truth[static_cast<std::size_t>(c)]));
  }
  EXPECT_LT(largest, tolerance);
}

TEST(Shadows, TrianglesOfAnyPositionAreCutAtTheBorders) {
  // A triangle hides what its projection covers; 1,024 points in a texel estimate an area to about 0.02 at worst.
  std::uint32_t state = 7;
  const auto random = [&] {
    state = state * 1664525 + 1013904223;
    return 1.2 * (static_cast<double>(state >> 8) / (1 << 24) - 0.5);
  };
  for (int k = 0; k < 20; ++k) {
    SCOPED_TRACE(k);
    const double scale = k % 4 == 0 ? 30 : 1;
    TriangleMesh mesh;
    for (int i = 0; i < 3; ++i) mesh.positions.push_back({scale * random(), scale * random(), 0.1 + 0.1 * random()});
    mesh.triangles.push_back({0, 1, 2});
    const std::vector<ShadowLight> lights{{{random(), random(), 1}, 0, {1, 1, 1}}};
    expect_as_traced(scene_of(mesh, lights), {mesh, lights, {}}, 0.03, 1024);
  }
}

TEST(Shadows, TexelsThatAreNotSquareAndRowsThatAreNotColumns) {
  const TriangleMesh mesh = reference::make_chair({0.01, 0.02, 0}, 0.06, 0.4, 2);
  const std::vector<ShadowLight> lights{{{0.5, 0.3, 1}, 3 * kDegree, {1, 2, 1}}};
  Scene scene = scene_of(mesh, lights, {0.2, 0.2, 0.1});
  scene.receiver = {{}, 0.4, 0.2, 120, 180};
  expect_as_traced(scene, {mesh, lights, [](reference::V3) { return reference::Rgb{0.2, 0.2, 0.1}; }}, 0.03, 2048);
}

TEST(Shadows, CapsAreClippedAtTheHorizon) {
  const TriangleMesh mesh = reference::make_box({-0.02, -0.02, 0}, {0.02, 0.02, 0.01}, 2);
  for (const double elevation : {4.0, 0.5, -3.0}) {
    SCOPED_TRACE(elevation);
    const double a = kDegree * elevation;
    const std::vector<ShadowLight> lights{{{std::cos(a), 0, std::sin(a)}, 10 * kDegree, {1, 1, 1}}};
    // Of the cap, directions near the horizon weigh little and cast the longest shadows.
    expect_as_traced(scene_of(mesh, lights).with_texels(160), {mesh, lights, {}}, 0.04, 4096);
  }
}

TEST(Shadows, NearLampsCastFromTheirPositionAndFallOff) {
  const TriangleMesh mesh = reference::make_blob({0.02, -0.03, 0.05}, 0.03, 0.2, 12, 24);
  const std::vector<ShadowLight> lights{{{0.3, 0.2, 1}, 4 * kDegree, {1, 2, 1}, 0.3},
                                        {{-0.5, 0.2, 0.6}, 2 * kDegree, {2, 1, 1}}};
  // The lamp's disc is sampled as it is seen from the object, not from each texel: 0.01.
  expect_as_traced(scene_of(mesh, lights).with_texels(160), {mesh, lights, {}}, 0.03, 2048);
}

TEST(Shadows, ALampBelowTheTopOfTheObjectLightsWhatIsBelowIt) {
  const TriangleMesh mesh = reference::make_box({-0.12, -0.02, 0}, {-0.08, 0.02, 0.4}, 3);
  const std::vector<ShadowLight> lights{{{0.05, 0, 1}, 1 * kDegree, {1, 1, 1}, 0.2}};
  expect_as_traced(scene_of(mesh, lights).with_texels(160), {mesh, lights, {}}, 0.03, 2048);
}

TEST(Shadows, ResidualOfAnyDirectionWeighsItsOcclusion) {
  // Brighter towards +X: band 1, positive everywhere.
  Scene scene = scene_of(reference::make_chair({0, 0, 0}, 0.08, 0.3, 2), {}).with_texels(160);
  Descriptor d;
  d.radiance.band = 1;
  for (int c = 0; c < 3; ++c) {
    d.radiance.c[0][c] = 3;
    d.radiance.c[3][c] = static_cast<float>(0.5 * c);
  }
  scene.lighting = Lighting::of(d);
  const Lighting lighting = scene.lighting;
  const auto residual = [lighting](reference::V3 v) {
    const Radiance l =
        lighting.radiance({static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)}, 0).value;
    return reference::Rgb{l.r, l.g, l.b};
  };
  ASSERT_GT(residual({1, 0, 0})[2], 1.5 * residual({-1, 0, 0})[2]);
  expect_as_traced(scene, {reference::make_chair({0, 0, 0}, 0.08, 0.3, 2), {}, residual}, 0.03, 1024);
}

TEST(Shadows, ThreeSheetsMayMeetInOneEdge) {
  TriangleMesh mesh = quad({0, -0.05, 0.05}, {0, 0.05, 0.05}, {0.08, 0.05, 0.08}, {0.08, -0.05, 0.08});
  mesh.positions.insert(mesh.positions.end(),
                        {{-0.08, 0.05, 0.08}, {-0.08, -0.05, 0.08}, {0, 0.05, 0.2}, {0, -0.05, 0.2}});
  for (const auto& t : {std::array<std::uint32_t, 3>{0, 5, 4}, {0, 4, 1}, {0, 1, 6}, {0, 6, 7}})
    mesh.triangles.push_back(t);
  const std::vector<ShadowLight> lights{{{0.3, 0.1, 1}, 0, {1, 1, 1}}};
  // Where outlines of front and back meet in a texel, the larger area counts instead of both: 0.15 in a corner.
  expect_as_traced(scene_of(mesh, lights).with_texels(160), {mesh, lights, {}}, 0.15, 1024);
}

}  // namespace
}  // namespace lightwell::test
