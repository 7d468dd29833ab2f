// Shadows against closed forms; input that is hostile, empty or extreme.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
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
using testing::HasSubstr;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();

const ShadowLight kZenith{{0, 0, 1}, 0, {1, 2, 3}};

Status refusal(const Scene& scene) {
  ShadowCaster caster = make_caster();
  std::vector<LightRatio> ratios(scene.texels(), {-1, -1, -1});
  const Status status = caster.cast(scene.lighting, scene.receiver, scene.mesh(), ratios).status();
  EXPECT_EQ(status.code(), StatusCode::invalid_argument);
  for (const LightRatio& r : ratios) EXPECT_EQ(r, (LightRatio{-1, -1, -1}));
  return status;
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

TEST(Shadows, ManyVerticesThatAreNaNTakeNoLonger) {
  Scene scene = scene_of(sheet(-0.05, -0.05, 0.05, 0.05, 0.1), {kZenith});
  scene.positions.resize(400'000, {kNan, kNan, kNan});
  const std::clock_t start = std::clock();
  const Cast result = cast(scene);
  // Takes a tenth of a second. If each vertex were compared with all before it, more than half a minute.
  EXPECT_LT(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC, 10);
  EXPECT_LT(lowest(result), 1e-5);
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

TEST(Shadows, ProjectionsThatOverflowCastNothing) {
  // A wall along X stands on the plane. Texels 10^40 times as long as high: the light's slope along Y is infinite, and
  // the wall's foot is at 0 times that.
  const std::vector<ShadowLight> lights{{{0, 0.4, 1}, 0, {1, 1, 1}}};
  Scene scene = scene_of(quad({-0.05, 0, 0}, {0.05, 0, 0}, {0.05, 0, 0.1}, {-0.05, 0, 0.1}), lights, {0.1, 0.1, 0.1});
  scene.receiver.width_m = 1e20;
  scene.receiver.height_m = 1e-20;
  EXPECT_EQ(lowest(cast(scene)), 1);
}

TEST(Shadows, NearLightsWhosePositionOverflowsCastNothing) {
  // At 10^37 m: in texels infinite.
  for (const Vec3d far : {Vec3d{0, 1e37, 0}, Vec3d{1e37, 0, 0}, Vec3d{-1e37, -1e37, 0}}) {
    SCOPED_TRACE(far.x);
    Scene near = scene_of(quad({-0.05, 0, 0}, {0.05, 0, 0}, {0.05, 0, 0.1}, {-0.05, 0, 0.1}),
                          {{{0.1, 0.4, 1}, 2 * kDegree, {1, 1, 1}, 0.5}});
    near.receiver.T_lighting_plane.translation = far;
    EXPECT_EQ(lowest(cast(near)), 1);
  }
  // Positions on the plane overflow, too.
  Scene huge = scene_of(quad({-0.05, 0, 0}, {0.05, 0, 0}, {0.05, 0, 0.1}, {-0.05, 0, 0.1}),
                        {{{0.1, 0.4, 1}, 2 * kDegree, {1, 1, 1}, 0.5}}, {0.1, 0.1, 0.1});
  for (const double size : {1e-320, 1e-300, 1e300, 1e308}) {
    SCOPED_TRACE(size);
    huge.receiver.width_m = huge.receiver.height_m = size;
    (void)cast(huge);
  }
}

TEST(Shadows, ANearLightThatIsVeryFarCastsAsADistantOne) {
  // Irradiance times the squared distance would overflow.
  const TriangleMesh mesh = sheet(-0.05, -0.05, 0.05, 0.05, 0.1);
  const Vec3d towards{0.3, 0.1, 1};
  const auto lit_from = [&](double distance) {
    return cast(scene_of(mesh, {{{towards.x, towards.y, towards.z}, 3 * kDegree, {1, 1, 1}, distance}, kZenith}));
  };
  const Cast distant = lit_from(0);
  EXPECT_LT(lowest(distant), 0.1);
  // Both sample the light, and one of them by a disc of equal weights: 0.01.
  for (const double distance : {1e6, 1e20, 1e30}) EXPECT_LT(largest_difference(lit_from(distance), distant), 0.01);
}

TEST(Shadows, HugeRadianceLeavesNoRatioThatIsNotANumber) {
  const TriangleMesh mesh = sheet(-0.05, -0.05, 0.05, 0.05, 0.1);
  const double huge = std::numeric_limits<float>::max();
  const reference::Rgb residual{0.25 * huge, 0.25 * huge, 0.25 * huge};
  const ShadowLight above{{0, 0, 1}, 0, {huge, huge, huge}}, near{{0, 0, 1}, 0, {huge, huge, huge}, 0.3};
  // Sums that overflow; and one light, which does not.
  EXPECT_EQ(lowest(cast(scene_of(mesh, {above}, residual))), 1);
  EXPECT_EQ(lowest(cast(scene_of(mesh, {above, above}))), 1);
  EXPECT_EQ(lowest(cast(scene_of(mesh, {near, near}))), 1);
  EXPECT_LT(lowest(cast(scene_of(mesh, {above}))), 1e-5);
}

TEST(Shadows, ANearLightPartlyBelowTheHorizonIsHiddenWhole) {
  // Its centre is half its radius above the plane, and a sheet hides the plane.
  const double rho = 10 * kDegree, sine = 0.5 * std::sin(rho);
  const ShadowLight low{{std::sqrt(1 - sine * sine), 0, sine}, rho, {1, 1, 1}, 0.4};
  for (const double height : {1e-5, 1e-4}) {
    const Cast result = cast(scene_of(sheet(-5, -5, 5, 5, height), {low}));
    for (const LightRatio& r : result.ratios) EXPECT_LT(r.r, 1e-5);
  }
}

TEST(Shadows, LargeSheetsAndSmallTexelsAreExact) {
  // A ceiling of 800 m over a plane of 32 cm: everything is dark. And a texture of one texel.
  Scene scene = scene_of(sheet(-400, -400, 400, 400, 2), {{{0.4, 0.1, 1}, 3 * kDegree, {1, 1, 1}}});
  float highest = 0;
  for (const LightRatio& r : cast(scene).ratios) highest = std::max({highest, r.r, r.g, r.b});
  EXPECT_LT(highest, 1e-4);
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
