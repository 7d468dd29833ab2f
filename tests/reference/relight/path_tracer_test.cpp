#include "reference/relight/path_tracer.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace lightwell::reference {
namespace {

/// A sphere of radius 2 around the origin, of triangles of 3 degrees.
TracedMesh sphere(const TracedMaterial& material) {
  constexpr int kColumns = 120, kRows = 60;
  TracedMesh mesh;
  for (int j = 0; j <= kRows; ++j)
    for (int i = 0; i <= kColumns; ++i) {
      const double polar = pi * j / kRows, azimuth = 2 * pi * i / kColumns;
      const V3 d{std::sin(polar) * std::cos(azimuth), std::cos(polar), std::sin(polar) * std::sin(azimuth)};
      mesh.positions.push_back(2.0 * d);
      mesh.normals.push_back(d);
    }
  for (int j = 0; j < kRows; ++j)
    for (int i = 0; i < kColumns; ++i) {
      const auto at = [&](int k, int l) { return static_cast<std::uint32_t>(l * (kColumns + 1) + k); };
      if (j > 0) mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      if (j + 1 < kRows) mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  mesh.material = [material](std::uint32_t, const V3&) { return material; };
  return mesh;
}

const TracedCamera kInside{24, 16, 20, {}};
const TracedLight kLamp{{}, {4, 4, 4}, LightPattern::none, {}, 0};

double mean(const std::vector<std::array<float, 3>>& picture, std::size_t channel) {
  double sum = 0;
  for (const auto& pixel : picture) sum += static_cast<double>(pixel[channel]);
  return sum / static_cast<double>(picture.size());
}

// A lamp in the middle of a matte sphere: E = I / r^2 directly, E / (1 - albedo) with all reflections.
TEST(PathTracer, IntegratingSphere) {
  const PathTracer tracer(sphere({{0.6, 0.3, 0.0}, 0.5, 0}));
  const TracedPictures pictures = tracer.trace(kInside, {kLamp}, {64, 60, 1, 1});
  // Triangles of 3 degrees are 0.05 % nearer than the sphere; noise of 384 pixels of 64 paths: 0.3 %.
  for (const std::size_t c : {0, 1}) {
    const double albedo = c == 0 ? 0.6 : 0.3;
    EXPECT_NEAR(mean(pictures.direct[0], c), albedo / pi, 0.002 * albedo / pi);
    EXPECT_NEAR(mean(pictures.light[0], c), albedo / pi / (1 - albedo), 0.01 * albedo / pi / (1 - albedo));
  }
  EXPECT_EQ(mean(pictures.light[0], 2), 0);
}

// A coat reflects less than it gets: with a white base and light from everywhere nothing is gained.
TEST(PathTracer, CoatConservesEnergy) {
  const PathTracer tracer(sphere({{1, 1, 1}, 0.4, 0.04}));
  const TracedPictures one = tracer.trace(kInside, {kLamp}, {256, 1, 1, 1});
  const double direct = mean(one.direct[0], 0), bounced = mean(one.light[0], 0) - direct;
  EXPECT_LT(bounced, 1.01 * direct);
  EXPECT_GT(bounced, 0.85 * direct);
}

TEST(PathTracer, ThreadsDoNotChangeThePicture) {
  const PathTracer tracer(traced_figurine());
  const TracedCamera camera{20, 16, 6 * 10 / 1.4, {0, 0, 6}};
  const std::vector<TracedLight> lights = {{{2, 2, 4}, {9, 9, 9}, LightPattern::blinds, {}, 0.2}};
  const TracedPictures a = tracer.trace(camera, lights, {16, 4, 7, 1}), b = tracer.trace(camera, lights, {16, 4, 7, 3});
  EXPECT_EQ(a.light, b.light);
  EXPECT_GT(mean(a.light[0], 0), mean(a.direct[0], 0));
}

TEST(LightPattern, IsATransmittance) {
  for (const LightPattern pattern : {LightPattern::blinds, LightPattern::stained_glass}) {
    Rgb sum{};
    for (int j = 0; j < 100; ++j)
      for (int i = 0; i < 100; ++i) {
        const Rgb t = transmittance(pattern, 0.02 * (i - 49.5), 0.02 * (j - 49.5));
        for (std::size_t c = 0; c < 3; ++c) {
          EXPECT_GE(t[c], 0);
          EXPECT_LE(t[c], 1);
          sum[c] += t[c] / 1e4;
        }
      }
    for (const double mean_value : sum) EXPECT_TRUE(mean_value > 0.15 && mean_value < 0.6) << mean_value;
    EXPECT_EQ(transmittance(pattern, 1.01, 0), Rgb{});
  }
}

}  // namespace
}  // namespace lightwell::reference
