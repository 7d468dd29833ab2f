// Equation 1: alpha, and sums of photographs.
#include <array>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <lightwell/relight.hpp>

#include "host_sdk/relight/wall_scene.hpp"

namespace lightwell::test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

std::vector<Radiance> relit(const AlphaMaps& alpha, const WallScene& scene) {
  const auto photographs = scene.photographs();
  std::vector<Radiance> out(scene.camera.pixels());
  EXPECT_TRUE(relight_direct(alpha, spans_of(photographs), out).ok());
  return out;
}

void expect_near(const Radiance& a, const Radiance& b, float relative) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], relative * b[c] + 1e-7F);
}

// A slide of two halves at the place of a basis light: the wall is 2 m wide there, as the slide, and each half has its
// colour.
TEST(AlphaMaps, ProjectsASlideFromABasisLight) {
  WallScene scene;
  scene.basis = {{{0.3, 0, 0}, LightDistance::finite, {3, 3, 3}}};
  const std::array<RgbFactor, 2> slide = {RgbFactor{1, 0.5F, 0}, RgbFactor{0, 0.25F, 1}};
  PatternLight pattern = pattern_at({0.3, 0, 0}, 2, 2, {});
  const std::array<RgbFactor, 4> picture = {slide[0], slide[1], slide[0], slide[1]};
  pattern.picture = picture;
  pattern.irradiance = {6, 6, 6};
  AlphaMaps alpha;
  const auto summary = alpha.compute(scene.subject(), scene.basis, std::array{pattern}, {});
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_EQ(summary->without_geometry, 0U);
  EXPECT_EQ(summary->limited, 0U);
  ASSERT_TRUE(alpha.has_map(0));
  // The slide covers x = -0.7 to 1.3. Away from its edges by half a texel (0.5 m) alpha is twice one texel: at x = -0.2
  // and 0.8.
  const auto alpha_at = [&](double x) { return alpha.at(0, 14 * 40 + static_cast<std::size_t>(20 + x / 0.05)); };
  EXPECT_NEAR(alpha_at(-0.2).r, 2, 0.11);  // A pixel of 0.05 m is a twentieth of a texel.
  EXPECT_NEAR(alpha_at(0.8).b, 2, 0.11);
  // Half-way between two texels: their mean.
  EXPECT_NEAR(alpha_at(0.3).r, 1, 0.06);
  // A slide of the same size with small texels ends at x = -0.7.
  const std::vector<RgbFactor> white(64 * 64, RgbFactor{1, 1, 1});
  ASSERT_TRUE(alpha.compute(scene.subject(), scene.basis, std::array{pattern_at({0.3, 0, 0}, 64, 64, white)}, {}).ok());
  EXPECT_EQ(alpha_at(-0.8).g, 0);
  EXPECT_NEAR(alpha_at(-0.6).g, 1.0 / 3, 1e-5);
}

TEST(AlphaMaps, FallOffOfBothLights) {
  WallScene scene;
  scene.basis = {{{0, 0, 1}, LightDistance::distant, {2, 2, 2}}};
  // One texel in the middle of black would blur: a slide that is white everywhere, wider than the wall.
  const std::vector<RgbFactor> white(64, RgbFactor{1, 1, 1});
  PatternLight pattern = pattern_at({0, 0, 0}, 8, 8, white);
  pattern.field_of_view_rad = 2.4;
  AlphaMaps alpha;
  ASSERT_TRUE(alpha.compute(scene.subject(), scene.basis, std::array{pattern}, {}).ok());
  const auto picture = relit(alpha, [&] {
    WallScene distant = scene;
    distant.basis[0].place = {0, 0, 1e6};
    distant.basis[0].irradiance = {2e12F, 2e12F, 2e12F};
    return distant;
  }());
  // In front of the pattern its own fall-off and cosine; the basis light has the cosine 1 instead of that of the
  // pattern aside, which panning corrects.
  for (const std::size_t p : {std::size_t{14 * 40 + 20}, std::size_t{14 * 40 + 30}})
    expect_near(picture[p], scene.lit(p, {0, 0, 0}, {1, 1, 1}), 0.01F);
}

// A white pattern between three lights: panning reproduces Lambert's law.
TEST(AlphaMaps, BlendsLightsAroundAPattern) {
  WallScene scene;
  for (const Vec3d& d : {Vec3d{1, 0.8, 1}, Vec3d{-1, 0.7, 1.2}, Vec3d{0.1, -1, 1}})
    scene.basis.push_back({Vec3d{0, 0, -2} + normalized(d) * 3.0, LightDistance::finite, {3, 2, 1}});
  const std::vector<RgbFactor> white(64, RgbFactor{1, 1, 1});
  PatternLight pattern = pattern_at({0.2, 0.1, 0.9}, 8, 8, white);
  pattern.field_of_view_rad = 2;
  AlphaMaps alpha;
  const auto summary = alpha.compute(scene.subject(), scene.basis, std::array{pattern}, {});
  ASSERT_TRUE(summary.ok());
  EXPECT_EQ(summary->modelled, 0U);
  EXPECT_GT(summary->widest_rad, 0.3);
  const auto picture = relit(alpha, scene);
  for (std::size_t p = 0; p < picture.size(); p += 7)
    expect_near(picture[p], scene.lit(p, {0.2, 0.1, 0.9}, {1, 1, 1}), 1e-3F);
}

// What stands between wall and pattern throws its shadow, though none of the photographs has it.
TEST(AlphaMaps, PatternsBetweenLightsThrowShadows) {
  WallScene scene;
  for (const Vec3d& d : {Vec3d{1, 0.8, 1}, Vec3d{-1, 0.7, 1.2}, Vec3d{0.1, -1, 1}})
    scene.basis.push_back({normalized(d), LightDistance::distant, {1, 1, 1}});
  // A board from x = -0.2 to 0.2 at z = -1, seen in columns 12 to 27, hides from a pattern at (1, 0, 0) the wall from x
  // = -1.4 to -0.6.
  std::vector<float> depth = scene.depth();
  for (std::size_t p = 0; p < depth.size(); ++p)
    if (p % 40 >= 12 && p % 40 < 28) depth[p] = 1;
  const auto subject = RelightSubject::from_depth(scene.camera, depth, {scene.albedos(), {}});
  ASSERT_TRUE(subject.ok());
  const std::vector<RgbFactor> white(64, RgbFactor{1, 1, 1});
  PatternLight pattern = pattern_at({1, 0, 0}, 8, 8, white);
  pattern.field_of_view_rad = 2.4;
  AlphaMaps alpha;
  ASSERT_TRUE(alpha.compute(*subject, scene.basis, std::array{pattern}, {}).ok());
  const auto sum = [&](double x) {
    const std::size_t pixel = 14 * 40 + static_cast<std::size_t>(20 + x / 0.05);
    return alpha.at(0, pixel).r + alpha.at(1, pixel).r + alpha.at(2, pixel).r;
  };
  EXPECT_EQ(sum(-0.9), 0);
  EXPECT_GT(sum(0.9), 0);
}

// A board in front of a wall, as a mesh: the board has one colour of the pattern, the wall around it the other one. A
// pixel at the edge of the board has a mean of both, by what each shows.
TEST(AlphaMaps, MixesSurfacesWithinAPixel) {
  WallScene scene;
  scene.basis = {{{0, 0, 0}, LightDistance::finite, {1, 1, 1}}};
  // In pixels the board ends at column 30.5: at x = 0.2625 m in a depth of 1 m.
  const std::vector<Vec3f> vertices = {{-9, -9, -2},   {9, -9, -2},          {9, 9, -2},          {-9, 9, -2},
                                       {0, -0.2F, -1}, {0.2625F, -0.2F, -1}, {0.2625F, 0.2F, -1}, {0, 0.2F, -1}};
  const std::vector<std::uint32_t> indices = {0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7};
  for (const bool with_albedo : {true, false}) {
    const auto albedo = scene.albedos();
    const auto subject =
        RelightSubject::from_mesh(scene.camera, {vertices, indices},
                                  {with_albedo ? std::span<const Albedo>(albedo) : std::span<const Albedo>(), {}});
    ASSERT_TRUE(subject.ok());
    // The slide from the camera's place: 64 texels across 2 m at the wall, green right of the board's edge, red left of
    // it.
    std::vector<RgbFactor> slide(64 * 64);
    for (std::size_t t = 0; t < slide.size(); ++t) slide[t] = t % 64 < 49 ? RgbFactor{1, 0, 0} : RgbFactor{0, 1, 0};
    AlphaMaps alpha;
    ASSERT_TRUE(alpha.compute(*subject, scene.basis, std::array{pattern_at({0, 0, 0}, 64, 64, slide)}, {}).ok());
    const auto at = [&](std::size_t column) { return alpha.at(0, 15 * 40 + column); };
    EXPECT_NEAR(at(28).r, 1, 1e-5);
    EXPECT_NEAR(at(33).g, 1, 1e-5);
    // The board is four times as bright as the wall, and the slide changes at column 30.6: red dominates.
    EXPECT_GT(at(30).r, 0.7);
    EXPECT_LT(at(30).r, 1);
    EXPECT_GT(at(30).g, 0);
    EXPECT_NEAR(at(30).r + at(30).g, 1, 0.05);
  }
}

TEST(AlphaMaps, ConstantWeightsNeedNoGeometry) {
  WallScene scene;
  scene.basis = {{{0.3, 0, 0}, LightDistance::finite, {3, 3, 3}}, {{-1, 1, 0}, LightDistance::finite, {1, 1, 1}}};
  const auto subject = RelightSubject::from_depth(scene.camera, std::vector<float>(scene.camera.pixels()), {});
  ASSERT_TRUE(subject.ok());
  AlphaMaps alpha;
  const auto summary = alpha.compute(*subject, scene.basis, {}, std::array{RgbFactor{2, 0, 1}, RgbFactor{0, 3, 1}});
  ASSERT_TRUE(summary.ok());
  EXPECT_EQ(summary->without_geometry, scene.camera.pixels());
  const auto picture = relit(alpha, scene);
  const auto photographs = scene.photographs();
  EXPECT_FLOAT_EQ(picture[5].r, 2 * photographs[0][5].r);
  EXPECT_FLOAT_EQ(picture[5].g, 3 * photographs[1][5].g);
  EXPECT_FLOAT_EQ(picture[5].b, photographs[0][5].b + photographs[1][5].b);
}

TEST(AlphaMaps, LightsWithoutIrradianceAndLightsAtTheSurface) {
  WallScene scene;
  scene.basis = {{{0.025, 0.025, -1.9995}, LightDistance::finite, {0, 1, 1e-30F}}};
  const std::vector<RgbFactor> white(4, RgbFactor{1, 1, 1});
  AlphaMaps alpha;
  // The pattern is there too, in front of one pixel: both are limited to the irradiance at a millimetre.
  PatternLight pattern = pattern_at({0.025, 0.025, -1.9995}, 2, 2, white);
  pattern.field_of_view_rad = 3;
  const auto summary = alpha.compute(scene.subject(), scene.basis, std::array{pattern}, {});
  ASSERT_TRUE(summary.ok());
  EXPECT_GT(summary->limited, 0U);
  for (std::size_t p = 0; p < scene.camera.pixels(); ++p) {
    const RgbFactor a = alpha.at(0, p);
    EXPECT_EQ(a.r, 0);
    EXPECT_TRUE(a.g >= 0 && a.g <= AlphaSummary::kMaxAlpha && a.b >= 0 && a.b <= AlphaSummary::kMaxAlpha) << p;
  }
  EXPECT_EQ(alpha.at(1, 0), RgbFactor{});
  EXPECT_EQ(alpha.at(0, scene.camera.pixels()), RgbFactor{});
}

// Geometry and lights far beyond what makes sense: answers are finite, or refused.
TEST(AlphaMaps, ExtremeSizes) {
  WallScene scene;
  const std::vector<RgbFactor> white(4, RgbFactor{1, 1, 1});
  for (const double focal : {1e-30, 1e-3, 1e9})
    for (const float depth : {1e-30F, 1.0F, 1e11F})
      for (const double place : {0.0, 1e8}) {
        RelightCamera camera = scene.camera;
        camera.focal_px = focal;
        std::vector<float> depths(camera.pixels(), depth);
        depths[3] = std::numeric_limits<float>::infinity();
        depths[4] = -depth;
        const auto subject = RelightSubject::from_depth(camera, depths, {scene.albedos(), {}});
        ASSERT_TRUE(subject.ok());
        EXPECT_GE(subject->pixels_without_geometry(), 2U);
        scene.basis = {{{place, 0, 0}, LightDistance::finite, {1e30F, 1, 1e-30F}},
                       {{0, 1, 1}, LightDistance::distant, {1, 1, 1}}};
        AlphaMaps alpha;
        const std::array patterns = {pattern_at({place, 0, 0}, 2, 2, white), pattern_at({0, 0, place}, 2, 2, white)};
        ASSERT_TRUE(alpha.compute(*subject, scene.basis, patterns, {}).ok());
        const std::vector<std::vector<Radiance>> photographs(2, std::vector<Radiance>(camera.pixels(), {1, 1, 1}));
        const auto indirect = simulate_indirect(*subject, scene.basis, patterns, alpha, {.samples = 4});
        ASSERT_TRUE(indirect.ok());
        std::vector<Radiance> out(camera.pixels());
        ASSERT_TRUE(relight_corrected(alpha, spans_of(photographs), *indirect, out).ok());
        for (const Radiance& r : out) ASSERT_TRUE(std::isfinite(r.r + r.g + r.b) && std::min({r.r, r.g, r.b}) >= 0);
      }
}

TEST(RelightDirect, PhotographsThatAreDamaged) {
  WallScene scene;
  scene.basis = {{{0, 0, 0}, LightDistance::finite, {1, 1, 1}}};
  AlphaMaps alpha;
  ASSERT_TRUE(alpha.compute(scene.subject(), scene.basis, {}, std::array{RgbFactor{1, 1, 1}}).ok());
  std::vector<Radiance> photograph(scene.camera.pixels(), {1, 2, 3});
  photograph[0] = {kNan, -1, std::numeric_limits<float>::infinity()};
  std::vector<Radiance> out(scene.camera.pixels());
  const std::array<std::span<const Radiance>, 1> basis = {photograph};
  ASSERT_TRUE(relight_direct(alpha, basis, out).ok());
  EXPECT_EQ(out[0], Radiance{});
  EXPECT_EQ(out[1], (Radiance{1, 2, 3}));
  EXPECT_FALSE(relight_direct(alpha, {}, out).ok());
  EXPECT_FALSE(relight_direct(alpha, basis, std::span(out).first(3)).ok());
}

TEST(Relight, RefusesInputByName) {
  WallScene scene;
  const auto refused = [](const Status& status, const std::string& part) {
    EXPECT_EQ(status.code(), StatusCode::invalid_argument);
    EXPECT_NE(status.message().find(part), std::string::npos) << status.message();
  };
  RelightCamera camera = scene.camera;
  camera.focal_px = 0;
  refused(RelightSubject::from_depth(camera, scene.depth(), {}).status(), "focal_px");
  refused(RelightSubject::from_depth(scene.camera, std::vector<float>(3), {}).status(), "depth");
  refused(RelightSubject::from_depth(scene.camera, scene.depth(), {std::vector<Albedo>(2), {}}).status(), "albedo");
  std::vector<Albedo> albedo = scene.albedos();
  albedo[7].g = kNan;
  refused(RelightSubject::from_depth(scene.camera, scene.depth(), {albedo, {}}).status(), "pixel 7");
  std::vector<Vec3f> normals(scene.camera.pixels());
  normals[3].x = kNan;
  refused(RelightSubject::from_depth(scene.camera, scene.depth(), {{}, normals}).status(), "normal of pixel 3");
  const std::array<std::uint32_t, 3> outside = {0, 1, 2};
  refused(RelightSubject::from_mesh(scene.camera, {std::vector<Vec3f>(2), outside}, {}).status(), "index 2");

  AlphaMaps alpha;
  const auto status_of = [&](const BasisLight& light, const PatternLight& pattern) {
    return alpha.compute(scene.subject(), std::array{light}, std::array{pattern}, {}).status();
  };
  const BasisLight lamp{{0, 0, 1}, LightDistance::finite, {1, 1, 1}};
  const std::vector<RgbFactor> white(4, RgbFactor{1, 1, 1});
  const PatternLight slide = pattern_at({0, 0, 0}, 2, 2, white);
  ASSERT_TRUE(status_of(lamp, slide).ok());
  BasisLight dark = lamp;
  dark.irradiance.r = -1;
  refused(status_of(dark, slide), "basis light 0: irradiance");
  refused(status_of({{}, LightDistance::distant, {1, 1, 1}}, slide), "direction");
  PatternLight wide = slide;
  wide.field_of_view_rad = 3.2;
  refused(status_of(lamp, wide), "field_of_view_rad");
  PatternLight small = slide;
  small.rows = 1;
  refused(status_of(lamp, small), "picture");
  const std::vector<RgbFactor> negative(4, RgbFactor{1, -1, 1});
  refused(status_of(lamp, pattern_at({}, 2, 2, negative)), "transmittance");
  refused(alpha.compute(scene.subject(), {}, {}, {}).status(), "no basis light");
  refused(alpha.compute(scene.subject(), std::array{lamp}, {}, std::array{RgbFactor{1, kNan, 1}}).status(), "weight");
}

}  // namespace
}  // namespace lightwell::test
