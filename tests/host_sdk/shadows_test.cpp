// Shadows against closed forms and the reference ray tracer; input that is hostile, empty or extreme.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/descriptor.hpp>
#include <lightwell/shadows.hpp>

#include "host_sdk/shadow_scenes.hpp"
#include "reference/shadow_tracer.hpp"

namespace lightwell::test {
namespace {

using reference::ShadowLight;
using reference::TriangleMesh;
using testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();

const ShadowLight kZenith{{0, 0, 1}, 0, {1, 2, 3}};

/// A mesh in the plane's frame, and its light in the same frame.
struct Scene {
  std::vector<Vec3f> positions;
  std::vector<std::uint32_t> indices;
  Lighting lighting;
  ShadowReceiver receiver{{}, 0.32, 0.32, 32, 32};

  [[nodiscard]] Scene with_texels(int side) const {
    Scene out = *this;
    out.receiver.columns = out.receiver.rows = side;
    return out;
  }
  [[nodiscard]] ShadowMesh mesh() const { return {positions, indices, {}}; }
  [[nodiscard]] std::size_t texels() const { return static_cast<std::size_t>(receiver.columns * receiver.rows); }
};

Scene scene_of(const TriangleMesh& mesh, const std::vector<ShadowLight>& lights, reference::Rgb residual = {}) {
  Scene out;
  for (const reference::V3& p : mesh.positions)
    out.positions.push_back({static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
  for (const auto& t : mesh.triangles) out.indices.insert(out.indices.end(), t.begin(), t.end());
  out.lighting = lighting_of(lights, residual, {});
  return out;
}

TriangleMesh quad(reference::V3 a, reference::V3 b, reference::V3 c, reference::V3 d) {
  return {{a, b, c, d}, {{0, 1, 2}, {0, 2, 3}}};
}

/// A horizontal rectangle.
TriangleMesh sheet(double left, double bottom, double right, double top, double height) {
  return quad({left, bottom, height}, {right, bottom, height}, {right, top, height}, {left, top, height});
}

ShadowCaster make_caster(const ShadowOptions& options = {}) {
  Result<ShadowCaster> made = ShadowCaster::make(options);
  EXPECT_TRUE(made.ok()) << made.status().message();
  return std::move(*made);
}

struct Cast {
  std::vector<LightRatio> ratios;
  Answer<ShadowSummary> answer;

  [[nodiscard]] LightRatio at(const Scene& scene, int column, int row) const {
    return ratios[static_cast<std::size_t>(row * scene.receiver.columns + column)];
  }
};

Cast cast(ShadowCaster& caster, const Scene& scene) {
  Cast out;
  out.ratios.assign(scene.texels(), {-1, -1, -1});
  const Result<Answer<ShadowSummary>> answer = caster.cast(scene.lighting, scene.receiver, scene.mesh(), out.ratios);
  EXPECT_TRUE(answer.ok()) << answer.status().message();
  if (answer.ok()) out.answer = *answer;
  for (const LightRatio& r : out.ratios)
    for (int c = 0; c < 3; ++c)
      if (!(r[c] >= 0 && r[c] <= 1)) ADD_FAILURE() << "a ratio is " << r[c];
  return out;
}

Cast cast(const Scene& scene, const ShadowOptions& options = {}) {
  ShadowCaster caster = make_caster(options);
  return cast(caster, scene);
}

float lowest(const Cast& cast) {
  float out = 1;
  for (const LightRatio& r : cast.ratios) out = std::min({out, r.r, r.g, r.b});
  return out;
}

float largest_difference(const Cast& a, const Cast& b) {
  float out = 0;
  for (std::size_t i = 0; i < a.ratios.size(); ++i)
    for (int c = 0; c < 3; ++c) out = std::max(out, std::abs(a.ratios[i][c] - b.ratios[i][c]));
  return out;
}

Status refusal(const Scene& scene) {
  ShadowCaster caster = make_caster();
  std::vector<LightRatio> ratios(scene.texels(), {-1, -1, -1});
  const Status status = caster.cast(scene.lighting, scene.receiver, scene.mesh(), ratios).status();
  EXPECT_EQ(status.code(), StatusCode::invalid_argument);
  for (const LightRatio& r : ratios) EXPECT_EQ(r, (LightRatio{-1, -1, -1}));
  return status;
}

// ---- accuracy ----

TEST(Shadows, AgreeWithTheRayTracer) {
  // Measured by measure_shadows at the default setting over the same scenes with 10,000 triangles: RMS at most 0.010,
  // 99 % at most 0.03, largest 0.03 (96 directions of the residual, and pieces of outlines that overlap within a
  // texel). The ray tracer's own error is about 0.003 at 1,024 rays.
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

// ---- closed forms ----

TEST(Shadows, AreaOfATexelThatASheetCovers) {
  // Texels of 1 cm; column 16 begins at x = 0, row 15 ends at y = 0.
  const Cast result = cast(scene_of(sheet(0.0025, -0.05, 0.045, 0.0975, 0.1), {kZenith}));
  const Scene scene = scene_of({}, {});
  // 1e-5: sums of floats.
  EXPECT_NEAR(result.at(scene, 16, 10).r, 0.25, 1e-5);
  EXPECT_NEAR(result.at(scene, 17, 10).g, 0, 1e-5);
  EXPECT_NEAR(result.at(scene, 20, 10).b, 0.5, 1e-5);
  EXPECT_NEAR(result.at(scene, 18, 6).r, 0.25, 1e-5);
  EXPECT_NEAR(result.at(scene, 16, 6).r, 1 - 0.75 * 0.75, 1e-5);
  EXPECT_EQ(result.at(scene, 15, 10).r, 1);
  EXPECT_EQ(result.at(scene, 21, 10).r, 1);
  EXPECT_EQ(result.at(scene, 18, 5).r, 1);
  EXPECT_NEAR(result.at(scene, 18, 21).r, 1, 1e-5);
}

TEST(Shadows, PenumbraOfAStraightEdge) {
  // A sheet over x < 0 at the height h under a cap of radius rho at the zenith: at x, the light's disc of radius
  // h tan(rho) is cut at the distance x from its middle (to first order in rho²).
  const double h = 0.5, rho = 5 * kDegree, radius = h * std::tan(rho);
  const Cast result = cast(scene_of(sheet(-5, -5, 0, 5, h), {{{0, 0, 1}, rho, {1, 1, 1}}}), {256, 16, 1});
  const Scene scene = scene_of({}, {});
  for (int column = 0; column < 32; ++column) {
    const double x = (column + 0.5) * 0.01 - 0.16, u = std::clamp(x / radius, -1.0, 1.0);
    const double free = 0.5 + (u * std::sqrt(1 - u * u) + std::asin(u)) / std::numbers::pi;
    // Half of one of 18 samples: two for each texel of the penumbra.
    EXPECT_NEAR(result.at(scene, column, 16).r, free, 0.028) << x;
  }
}

TEST(Shadows, ATallWallHidesHalfTheHemisphere) {
  // A wall along Y beyond x = 0.1 m: from a point at its foot it hides all directions of its side, half of the
  // irradiance. 1 km high and wide.
  const Scene scene = scene_of(quad({0.1, -500, 0}, {0.1, 500, 0}, {0.1, 500, 1000}, {0.1, -500, 1000}), {}, {1, 1, 2});
  const Cast result = cast(scene, {1, 512, 1});
  // 1/512 of each direction, of which a few are along the wall.
  EXPECT_NEAR(result.at(scene, 20, 16).r, 0.5, 0.01);
  EXPECT_NEAR(result.at(scene, 5, 3).b, 0.5, 0.01);
}

TEST(Shadows, LightsAddUpByTheirIrradianceOfThePlane) {
  // The sheet hides the light at the zenith; the other is 60 degrees from the normal, and passes beside it.
  const double s = std::sin(60 * kDegree), c = std::cos(60 * kDegree);
  const Scene scene = scene_of(sheet(-0.02, -0.02, 0.02, 0.02, 0.1), {kZenith, {{s, 0, c}, 0, {2, 2, 0}}});
  const Cast result = cast(scene);
  EXPECT_NEAR(result.at(scene, 16, 16).r, 1.0 / (1 + 1), 1e-5);
  EXPECT_NEAR(result.at(scene, 16, 16).g, 1.0 / (1 + 2), 1e-5);
  EXPECT_NEAR(result.at(scene, 16, 16).b, 0, 1e-5);
  EXPECT_EQ(result.answer.value.lights, 2);
  EXPECT_FALSE(result.answer.value.no_light);
}

// ---- geometry ----

TEST(Shadows, NothingBelowThePlaneCasts) {
  const std::vector<ShadowLight> lights{{{0.4, 0.1, 1}, 3 * kDegree, {1, 1, 1}}};
  const reference::Rgb residual{0.1, 0.1, 0.1};
  EXPECT_EQ(lowest(cast(scene_of(reference::make_box({-0.05, -0.05, -0.2}, {0.05, 0.05, -0.01}, 3), lights, residual))),
            1);
  EXPECT_EQ(lowest(cast(scene_of(sheet(-0.05, -0.05, 0.05, 0.05, 0), lights, residual))), 1);
  const Cast sunk = cast(scene_of(reference::make_box({-0.05, -0.05, -0.2}, {0.05, 0.05, 0.04}, 3), lights, residual));
  const Cast standing = cast(scene_of(reference::make_box({-0.05, -0.05, 0}, {0.05, 0.05, 0.04}, 3), lights, residual));
  // 1e-4: vertices at the plane differ by the rounding of their intersection.
  EXPECT_LT(largest_difference(sunk, standing), 1e-4);
  EXPECT_LT(lowest(sunk), 1e-4);
}

TEST(Shadows, WindingOrderAndSharedVerticesDoNotMatter) {
  const std::vector<ShadowLight> lights{{{0.4, 0.1, 1}, 3 * kDegree, {1, 1, 1}}};
  Scene scene = scene_of(reference::make_blob({0, 0, 0.03}, 0.04, 0.2, 10, 20), lights, {0.1, 0.1, 0.1});
  const Cast shared = cast(scene);
  EXPECT_LT(lowest(shared), 0.2F);
  Scene inward = scene;
  for (std::size_t i = 0; i < inward.indices.size(); i += 3) std::swap(inward.indices[i], inward.indices[i + 1]);
  EXPECT_LT(largest_difference(cast(inward), shared), 1e-4);
  Scene separate = scene;
  separate.positions.clear();
  for (std::uint32_t& i : separate.indices) {
    separate.positions.push_back(scene.positions[i]);
    i = static_cast<std::uint32_t>(separate.positions.size() - 1);
  }
  EXPECT_LT(largest_difference(cast(separate), shared), 1e-4);
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

TEST(Shadows, TheMeshMayBeInTheFrameOfTheLighting) {
  const ShadowCase test_case = make_shadow_case({"chair", "chair", 500, {3}, 20, 80, 0.4, 9});
  const ShadowReceiver receiver = test_case.receiver(64);
  std::vector<LightRatio> in_plane(64 * 64), in_lighting(64 * 64), in_world(64 * 64);
  ShadowCaster caster = make_caster();
  ASSERT_TRUE(caster.cast(test_case.lighting, receiver, test_case.mesh(), in_plane).ok());
  std::vector<Vec3f> moved;
  for (const Vec3f p : test_case.positions)
    moved.push_back(vec_cast<float>(transformed(test_case.T_lighting_plane, vec_cast<double>(p))));
  const ShadowMesh mesh{moved, test_case.indices, inverse(test_case.T_lighting_plane)};
  ASSERT_TRUE(caster.cast(test_case.lighting, receiver, mesh, in_lighting).ok());
  const Pose T_world_lighting{Quat::about(normalized(Vec3d{1, 2, 3}), 1), {4, 5, 6}};
  ShadowReceiver world = receiver;
  world.T_lighting_plane = compose(T_world_lighting, receiver.T_lighting_plane);
  ASSERT_TRUE(caster.cast(test_case.lighting.in_world(T_world_lighting), world, test_case.mesh(), in_world).ok());
  for (std::size_t i = 0; i < in_plane.size(); ++i) {
    // 1e-3: positions are floats about 2 m from the origin, 1e-7 m, 1e-4 of a texel; edges of many samples add up.
    EXPECT_NEAR(in_lighting[i].g, in_plane[i].g, 1e-3);
    EXPECT_NEAR(in_world[i].g, in_plane[i].g, 1e-3);
  }
}

TEST(Shadows, AReusedCasterAnswersAsANewOne) {
  const std::vector<ShadowLight> lights{{{0.4, 0.1, 1}, 3 * kDegree, {1, 1, 1}}};
  const reference::Rgb residual{0.1, 0.1, 0.1};
  std::vector<Scene> scenes{scene_of(reference::make_blob({0, 0, 0.05}, 0.04, 0.2, 10, 20), lights, residual),
                            scene_of(reference::make_box({0, 0, 0}, {0.1, 0.1, 0.02}, 2), lights, residual),
                            scene_of({}, lights, residual), scene_of(sheet(-1, -1, 0, 0, 0.1), {kZenith})};
  // The same indices with other positions, and with vertices that no longer coincide.
  scenes.push_back(scenes[1]);
  for (Vec3f& p : scenes.back().positions) p = p * 0.7F;
  scenes.push_back(scenes[1]);
  for (std::size_t i = 0; i < 9; ++i) scenes.back().positions[i].z += 0.05F;
  scenes.push_back(scenes[0]);
  scenes.back().receiver.columns = scenes.back().receiver.rows = 20;
  ShadowCaster caster = make_caster();
  for (int round = 0; round < 2; ++round)
    for (const Scene& scene : scenes) EXPECT_EQ(largest_difference(cast(caster, scene), cast(scene)), 0);
}

// ---- extremes ----

TEST(Shadows, WithoutAnObjectAllLightRemains) {
  const Cast result = cast(scene_of({}, {kZenith}, {1, 1, 1}));
  EXPECT_EQ(lowest(result), 1);
  EXPECT_FALSE(result.answer.value.no_light);
  EXPECT_EQ(result.answer.validity, Validity::valid);
}

TEST(Shadows, WithoutLightTheRatioIsOne) {
  const TriangleMesh mesh = sheet(-1, -1, 1, 1, 0.1);
  for (const std::vector<ShadowLight>& lights : {std::vector<ShadowLight>{},
                                                 {{{0, 0, -1}, 0.1, {1, 1, 1}}},
                                                 {{{1, 0, -0.2}, 0.1, {1, 1, 1}}},
                                                 {{{0, 0, 1}, 0.1, {0, 0, 0}}},
                                                 {{{0, 0, -1}, 0.1, {1, 1, 1}, 0.5}}}) {
    const Cast result = cast(scene_of(mesh, lights));
    EXPECT_EQ(lowest(result), 1);
    EXPECT_TRUE(result.answer.value.no_light);
    EXPECT_EQ(result.answer.value.lights, 0);
    EXPECT_EQ(result.answer.validity, Validity::valid);
  }
  // One channel without light.
  const Scene scene = scene_of(mesh, {{{0, 0, 1}, 0, {1, 1, 0}}});
  const Cast red_green = cast(scene);
  EXPECT_NEAR(red_green.at(scene, 3, 3).r, 0, 1e-5);
  EXPECT_EQ(red_green.at(scene, 3, 3).b, 1);
  Scene none = scene;
  none.lighting = Lighting();
  const Cast unknown = cast(none);
  EXPECT_EQ(lowest(unknown), 1);
  EXPECT_EQ(unknown.answer.validity, Validity::none);
  EXPECT_TRUE(unknown.answer.value.no_light);
}

TEST(Shadows, ValidityAndBoundAreTheLightings) {
  Scene scene = scene_of(sheet(-1, -1, 1, 1, 0.1), {kZenith});
  Descriptor d = scene.lighting.descriptor();
  d.bound.total = 0.02F;
  d.flags.set(Flag::clipped);
  scene.lighting = Lighting::of(d, Duration{300'000'000});
  const Cast stale = cast(scene);
  EXPECT_EQ(stale.answer.validity, Validity::stale);
  EXPECT_EQ(stale.answer.age.ns, 300'000'000);
  EXPECT_EQ(stale.answer.error_bound, 0.02F);
  EXPECT_TRUE(stale.answer.flags.has(Flag::clipped));
  EXPECT_LT(lowest(stale), 1e-5);
}

TEST(Shadows, LightThatIsNotFiniteCountsAsNone) {
  Scene scene = scene_of(sheet(-0.05, -0.05, 0.05, 0.05, 0.1), {});
  for (const Light& light : {Light{{0, 0, 1}, {kNan, kInf, -1}}, Light{{0, 0, 1}, {1, 1, 1}, kNan},
                             Light{{0, 0, kNan}, {1, 1, 1}}, Light{{0, 0, 0}, {1, 1, 1}}}) {
    Descriptor d;
    d.lights.push_back(light);
    scene.lighting = Lighting::of(d);
    const Cast result = cast(scene);
    EXPECT_EQ(lowest(result), 1);
    EXPECT_TRUE(result.answer.value.no_light);
  }
}

TEST(Shadows, TrianglesThatCannotBePlacedAreIgnoredAndCounted) {
  const std::vector<ShadowLight> lights{{{0.4, 0.1, 1}, 3 * kDegree, {1, 1, 1}}};
  const Scene plain = scene_of(sheet(-0.05, -0.05, 0.05, 0.05, 0.1), lights, {0.1, 0.1, 0.1});
  Scene scene = plain;
  for (const Vec3f bad : {Vec3f{kNan, 0, 0.1F}, Vec3f{0, kInf, 0.1F}, Vec3f{0, 0, 1e30F}, Vec3f{-3e38F, 0, 0.1F}}) {
    scene.positions.push_back(bad);
    const auto last = static_cast<std::uint32_t>(scene.positions.size() - 1);
    scene.indices.insert(scene.indices.end(), {0, 1, last});
  }
  const Cast result = cast(scene);
  EXPECT_EQ(result.answer.value.ignored_triangles, 4U);
  EXPECT_LT(largest_difference(result, cast(plain)), 1e-5);
}

TEST(Shadows, DegenerateTrianglesCastNothing) {
  const std::vector<ShadowLight> lights{{{0.4, 0.1, 1}, 3 * kDegree, {1, 1, 1}}};
  Scene scene = scene_of(sheet(-0.05, -0.05, 0.05, 0.05, 0.1), lights, {0.1, 0.1, 0.1});
  const Cast plain = cast(scene);
  scene.positions.insert(scene.positions.end(), {{-0.1F, 0, 0.1F}, {0, 0, 0.1F}, {0.1F, 0, 0.1F}, {-0.1F, 0, 0.1F}});
  // Two equal vertices, two at the same position, three on a line, all the same.
  scene.indices.insert(scene.indices.end(), {4, 4, 6, 4, 7, 6, 4, 5, 6, 2, 2, 2});
  const Cast result = cast(scene);
  EXPECT_LT(largest_difference(result, plain), 1e-4);
  EXPECT_EQ(result.answer.value.ignored_triangles, 0U);
}

TEST(Shadows, LargeSheetsAndSmallTexelsAreExact) {
  // A ceiling of 800 m over a plane of 32 cm: everything is dark. And a texture of one texel.
  Scene scene = scene_of(sheet(-400, -400, 400, 400, 2), {{{0.4, 0.1, 1}, 3 * kDegree, {1, 1, 1}}});
  EXPECT_LT(lowest(cast(scene)), 1e-4);
  float highest = 0;
  for (const LightRatio& r : cast(scene).ratios) highest = std::max(highest, r.r);
  EXPECT_LT(highest, 1e-3);
  scene.receiver.columns = scene.receiver.rows = 1;
  EXPECT_LT(cast(scene).ratios[0].r, 1e-3);
}

TEST(Shadows, ArgumentsAreChecked) {
  const Scene good = scene_of(sheet(-0.05, -0.05, 0.05, 0.05, 0.1), {kZenith});
  Scene bad = good;
  bad.indices[4] = 4;
  EXPECT_THAT(refusal(bad).message(), HasSubstr("index 4 is out of range: there are 4"));
  bad = good;
  bad.indices.pop_back();
  EXPECT_THAT(refusal(bad).message(), HasSubstr("5 indices"));
  for (const double size : {0.0, -1.0, static_cast<double>(kNan), static_cast<double>(kInf)}) {
    bad = good;
    bad.receiver.height_m = size;
    EXPECT_THAT(refusal(bad).message(), HasSubstr("above 0 and finite"));
  }
  for (const int side : {0, -3, 4097}) {
    bad = good;
    bad.receiver.rows = side;
    ShadowCaster caster = make_caster();
    std::vector<LightRatio> ratios(64);
    EXPECT_THAT(caster.cast(bad.lighting, bad.receiver, bad.mesh(), ratios).status().message(),
                HasSubstr("ShadowReceiver::rows"));
  }
  bad = good;
  bad.receiver.T_lighting_plane.rotation = {0, 0, 0, 0};
  EXPECT_THAT(refusal(bad).message(), HasSubstr("T_lighting_plane"));
  bad = good;
  bad.receiver.T_lighting_plane.translation.x = static_cast<double>(kNan);
  EXPECT_THAT(refusal(bad).message(), HasSubstr("T_lighting_plane"));
  ShadowCaster caster = make_caster();
  std::vector<LightRatio> few(5);
  EXPECT_THAT(caster.cast(good.lighting, good.receiver, good.mesh(), few).status().message(), HasSubstr("5 texels"));
  ShadowMesh mesh = good.mesh();
  mesh.T_plane_mesh.translation.z = static_cast<double>(kInf);
  std::vector<LightRatio> ratios(good.texels());
  EXPECT_THAT(caster.cast(good.lighting, good.receiver, mesh, ratios).status().message(), HasSubstr("T_plane_mesh"));
  for (const ShadowOptions& options : {ShadowOptions{0, 64, 2}, ShadowOptions{8, 1025, 2}, ShadowOptions{8, 64, 17}})
    EXPECT_EQ(ShadowCaster::make(options).status().code(), StatusCode::invalid_argument);
}

}  // namespace
}  // namespace lightwell::test
