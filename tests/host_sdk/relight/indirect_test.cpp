// Equation 5 and its simulated parts.
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <lightwell/relight.hpp>

#include "host_sdk/relight/wall_scene.hpp"

namespace lightwell::test {
namespace {

/// A matte sphere of radius 2 around camera and lamp: I = albedo / pi E (1 + albedo + albedo^2 + ...), without the
/// first term.
struct SphereScene {
  RelightCamera camera{48, 32, 24, 24, 16, {}};
  std::vector<Vec3f> vertices;
  std::vector<std::uint32_t> indices;
  std::array<BasisLight, 1> basis{BasisLight{{0, 0, 0.01}, LightDistance::finite, {4, 4, 4}}};
  Albedo albedo{0.6F, 0.3F, 0};

  SphereScene() {
    constexpr std::uint32_t kColumns = 120, kRows = 60;
    for (std::uint32_t j = 0; j <= kRows; ++j)
      for (std::uint32_t i = 0; i <= kColumns; ++i) {
        const double polar = std::numbers::pi * j / kRows, azimuth = 2 * std::numbers::pi * i / kColumns;
        vertices.push_back(vec_cast<float>(Vec3d{2 * std::sin(polar) * std::cos(azimuth), 2 * std::cos(polar),
                                                 2 * std::sin(polar) * std::sin(azimuth)}));
      }
    for (std::uint32_t j = 0; j < kRows; ++j)
      for (std::uint32_t i = 0; i < kColumns; ++i) {
        const std::uint32_t at = j * (kColumns + 1) + i;
        for (const std::uint32_t k : {at, at + 1, at + kColumns + 2, at, at + kColumns + 2, at + kColumns + 1})
          indices.push_back(k);
      }
  }
  [[nodiscard]] RelightSubject subject() const {
    return RelightSubject::from_mesh(camera, {vertices, indices}, {std::vector<Albedo>(camera.pixels(), albedo), {}})
        .value();
  }
};

const std::vector<RgbFactor> kWhite(64, RgbFactor{1, 1, 1});

PatternLight white_at(Vec3d place, float irradiance) {
  PatternLight out = pattern_at(place, 8, 8, kWhite);
  out.field_of_view_rad = 3;
  out.irradiance = {irradiance, irradiance, irradiance};
  return out;
}

TEST(SimulateIndirect, IntegratingSphere) {
  const SphereScene scene;
  const RelightSubject subject = scene.subject();
  EXPECT_EQ(subject.pixels_without_geometry(), 0U);
  AlphaMaps alpha;
  ASSERT_TRUE(alpha.compute(subject, scene.basis, std::array{white_at(scene.basis[0].place, 4)}, {}).ok());
  for (const int bounces : {1, 30}) {
    IndirectOptions options;
    options.bounces = bounces;
    options.surface_reflectance = 0;
    const auto indirect = simulate_indirect(subject, scene.basis, {}, alpha, options);
    ASSERT_TRUE(indirect.ok()) << indirect.status().message();
    ASSERT_EQ(indirect->existing.size(), 1U);
    // The camera sees an eighth of the sphere; what it does not see is lit once.
    for (const std::size_t p : {std::size_t{16 * 48 + 24}, std::size_t{5}, std::size_t{31 * 48 + 47}}) {
      const Radiance i = indirect->existing[0][p];
      const float direct = 1 / std::numbers::pi_v<float>;
      for (int c = 0; c < 2; ++c) {
        const float a = c == 0 ? 0.6F : 0.3F, first = a * a * direct;
        // Facets of 3 degrees and the offset of rays: 1 %.
        if (bounces == 1) {
          EXPECT_NEAR(i[c], first, 0.01F * first);
        } else {
          EXPECT_GT(i[c], 1.02F * first);
          EXPECT_LT(i[c], 1.01F * first / (1 - a));
        }
      }
      EXPECT_EQ(i.b, 0);
    }
    for (const Radiance& r : indirect->spatial) EXPECT_EQ(r, Radiance{});
  }
}

/// A wall and a board that meet at a right angle along x = 0, seen from in front: depth 2 m at the sides, 3 m at the
/// fold.
std::vector<float> folded_depth(const RelightCamera& camera) {
  std::vector<float> out(camera.pixels());
  for (std::size_t p = 0; p < out.size(); ++p) {
    const double tangent = std::abs(static_cast<double>(p % 40) + 0.5 - 20) / 40;
    // z = -3 + |x|, |x| = tangent * depth.
    out[p] = static_cast<float>(3 / (1 + tangent));
  }
  return out;
}

TEST(RelightCorrected, AWhitePatternReturnsThePhotograph) {
  WallScene scene;
  scene.basis = {{{0.2, 0.3, 0}, LightDistance::finite, {3, 3, 3}}};
  const auto subject = RelightSubject::from_depth(scene.camera, folded_depth(scene.camera), {scene.albedos(), {}});
  ASSERT_TRUE(subject.ok());
  const std::array patterns = {white_at({0.2, 0.3, 0}, 3)};
  AlphaMaps alpha;
  ASSERT_TRUE(alpha.compute(*subject, scene.basis, patterns, {}).ok());
  const auto indirect = simulate_indirect(*subject, scene.basis, patterns, alpha);
  ASSERT_TRUE(indirect.ok());
  EXPECT_LT(indirect->simulated_pixels, scene.camera.pixels() / 2);
  const std::vector<std::vector<Radiance>> photographs(1, std::vector<Radiance>(scene.camera.pixels(), {1, 1, 1}));
  std::vector<Radiance> out(scene.camera.pixels());
  ASSERT_TRUE(relight_corrected(alpha, spans_of(photographs), *indirect, out).ok());
  double indirect_sum = 0;
  for (std::size_t p = 0; p < out.size(); ++p) {
    indirect_sum += static_cast<double>(indirect->spatial[p].r);
    // The pattern's picture is interpolated where the basis light is even: rounding alone.
    EXPECT_NEAR(out[p].r, 1, 1e-4);
  }
  EXPECT_GT(indirect_sum, 0);
}

TEST(RelightCorrected, LightsWhatThePatternDoesNotReach) {
  WallScene scene;
  scene.basis = {{{0, 0, 0}, LightDistance::finite, {3, 3, 3}}};
  const auto subject = RelightSubject::from_depth(scene.camera, folded_depth(scene.camera), {scene.albedos(), {}});
  ASSERT_TRUE(subject.ok());
  // The left half is lit, and shines on the right one.
  std::vector<RgbFactor> left(64);
  for (std::size_t t = 0; t < 64; ++t)
    if (t % 8 < 4) left[t] = {1, 1, 1};
  PatternLight pattern = pattern_at({0, 0, 0}, 8, 8, left);
  pattern.field_of_view_rad = 2;
  AlphaMaps alpha;
  ASSERT_TRUE(alpha.compute(*subject, scene.basis, std::array{pattern}, {}).ok());
  IndirectOptions options;
  options.surface_reflectance = 0;
  const auto indirect = simulate_indirect(*subject, scene.basis, std::array{pattern}, alpha, options);
  ASSERT_TRUE(indirect.ok());
  const std::vector<std::vector<Radiance>> black(1, std::vector<Radiance>(scene.camera.pixels()));
  std::vector<Radiance> out(scene.camera.pixels());
  ASSERT_TRUE(relight_corrected(alpha, spans_of(black), *indirect, out).ok());
  // Photographs that are black have L - I below 0, which counts as 0: what is left is the indirect light.
  const std::size_t dark = 15 * 40 + 28;
  EXPECT_GT(out[dark].r, 0);
  EXPECT_EQ(out[dark], indirect->spatial[dark]);
  // Colours of two reflections.
  EXPECT_NEAR(out[dark].b / out[dark].r, 0.04 / 0.64, 0.02);
}

TEST(RelightCorrected, WithoutAlbedoItIsEquation1) {
  WallScene scene;
  scene.basis = {{{0, 0, 0}, LightDistance::finite, {3, 3, 3}}};
  const auto subject = RelightSubject::from_depth(scene.camera, folded_depth(scene.camera), {});
  ASSERT_TRUE(subject.ok());
  const std::array patterns = {white_at({0, 0, 0}, 1)};
  AlphaMaps alpha;
  ASSERT_TRUE(alpha.compute(*subject, scene.basis, patterns, {}).ok());
  IndirectOptions options;
  options.surface_reflectance = 0;
  const auto indirect = simulate_indirect(*subject, scene.basis, patterns, alpha, options);
  ASSERT_TRUE(indirect.ok());
  const auto photographs = scene.photographs();
  std::vector<Radiance> one(scene.camera.pixels()), five = one;
  ASSERT_TRUE(relight_direct(alpha, spans_of(photographs), one).ok());
  ASSERT_TRUE(relight_corrected(alpha, spans_of(photographs), *indirect, five).ok());
  EXPECT_EQ(one, five);
}

TEST(SimulateIndirect, IsDeterministic) {
  WallScene scene;
  scene.basis = {{{0, 0, 0}, LightDistance::finite, {3, 3, 3}}};
  const auto subject = RelightSubject::from_depth(scene.camera, folded_depth(scene.camera), {scene.albedos(), {}});
  ASSERT_TRUE(subject.ok());
  AlphaMaps alpha;
  ASSERT_TRUE(alpha.compute(*subject, scene.basis, {}, {}).ok());
  const std::array patterns = {white_at({0.5, 0, 0}, 1)};
  IndirectOptions options;
  options.samples = 8;
  const auto a = simulate_indirect(*subject, scene.basis, patterns, alpha, options);
  const auto b = simulate_indirect(*subject, scene.basis, patterns, alpha, options);
  options.seed = 2;
  const auto c = simulate_indirect(*subject, scene.basis, patterns, alpha, options);
  ASSERT_TRUE(a.ok() && b.ok() && c.ok());
  EXPECT_EQ(a->spatial, b->spatial);
  EXPECT_NE(a->spatial, c->spatial);
  EXPECT_TRUE(a->existing[0].empty());
}

TEST(SimulateIndirect, RefusesOptionsByName) {
  WallScene scene;
  scene.basis = {{{0, 0, 0}, LightDistance::finite, {3, 3, 3}}};
  AlphaMaps alpha;
  ASSERT_TRUE(alpha.compute(scene.subject(), scene.basis, {}, {}).ok());
  for (const auto& [options, part] : {std::pair{IndirectOptions{0, 1, 1, 1, 0}, "samples"},
                                      {IndirectOptions{1, 65, 1, 1, 0}, "bounces"},
                                      {IndirectOptions{1, 1, 17, 1, 0}, "step"},
                                      {IndirectOptions{1, 1, 1, 1, 2}, "surface_reflectance"}}) {
    const auto refused = simulate_indirect(scene.subject(), scene.basis, {}, alpha, options).status();
    EXPECT_EQ(refused.code(), StatusCode::invalid_argument);
    EXPECT_NE(refused.message().find(part), std::string::npos) << refused.message();
  }
  EXPECT_FALSE(simulate_indirect(scene.subject(), std::vector<BasisLight>(2), {}, alpha).ok());
}

// Nothing but one pixel, and nothing at all.
TEST(SimulateIndirect, SubjectsWithoutSurface) {
  const RelightCamera camera{1, 1, 1, 0.5, 0.5, {}};
  const std::array<BasisLight, 1> basis = {BasisLight{{0, 0, 1}, LightDistance::distant, {1, 1, 1}}};
  for (const float depth : {0.0F, 2.0F, std::numeric_limits<float>::quiet_NaN()}) {
    const auto subject = RelightSubject::from_depth(camera, std::array{depth}, {std::array{Albedo{1, 1, 1}}, {}});
    ASSERT_TRUE(subject.ok());
    AlphaMaps alpha;
    ASSERT_TRUE(alpha.compute(*subject, basis, std::array{white_at({0, 0, 0}, 1)}, {}).ok());
    const auto indirect = simulate_indirect(*subject, basis, std::array{white_at({0, 0, 0}, 1)}, alpha);
    ASSERT_TRUE(indirect.ok());
    EXPECT_EQ(indirect->spatial[0], Radiance{});
  }
}

}  // namespace
}  // namespace lightwell::test
