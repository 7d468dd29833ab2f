#include "reference/shadow_tracer.hpp"

#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <utility>

#include <gtest/gtest.h>

namespace lightwell::reference {
namespace {

constexpr double degree = pi / 180;
constexpr PlaneRectangle small_square{-1e-4, -1e-4, 1e-4, 1e-4};

TEST(ShadowTracer, TheTreeFindsWhatAllTrianglesFind) {
  const TriangleMesh mesh = joined(make_chair({0, 0, 0}, 0.1, 0.3, 3), make_blob({0.1, 0, 0.1}, 0.05, 0.2, 8, 16));
  const ShadowTracer tracer({mesh, {}, {}});
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  int hits = 0;
  for (int i = 0; i < 5000; ++i) {
    const V3 origin{0.2 * uniform(random), 0.2 * uniform(random), 0};
    const V3 direction = normalised({uniform(random), uniform(random), 1 + uniform(random)});
    const double limit = i % 2 == 0 ? 1e9 : 0.1;
    const bool hit = tracer.hits(origin, direction, limit);
    EXPECT_EQ(hit, tracer.hits_by_brute_force(origin, direction, limit));
    hits += hit ? 1 : 0;
  }
  EXPECT_GT(hits, 300);
  EXPECT_LT(hits, 4500);
}

TEST(ShadowTracer, RaysMeetTrianglesByHand) {
  const ShadowTracer tracer({{{{0, 0, 1}, {1, 0, 1}, {0, 1, 1}}, {{0, 1, 2}}}, {}, {}});
  EXPECT_TRUE(tracer.hits({0.2, 0.2, 0}, {0, 0, 1}, 2));
  EXPECT_FALSE(tracer.hits({0.2, 0.2, 0}, {0, 0, 1}, 0.9));
  EXPECT_FALSE(tracer.hits({0.6, 0.6, 0}, {0, 0, 1}, 2));
  EXPECT_FALSE(tracer.hits({0.2, 0.2, 2}, {0, 0, 1}, 2));
}

TEST(ShadowTracer, ABallAboveThePointHidesItsFormFactor) {
  // A ball whose cap of angular radius rho is at the zenith hides sin² rho of a uniform hemisphere's irradiance.
  const double rho = 30 * degree, height = 0.2;
  ShadowScene scene{make_blob({0, 0, height}, height * std::sin(rho), 0, 60, 120), {}, {}};
  scene.residual = [](V3) { return Rgb{1, 2, 3}; };
  // 0.003: 60 rings are a polyhedron within the ball, and 20,000 quasi-random rays.
  EXPECT_NEAR(ShadowTracer(scene).ratio(small_square, 20000)[1], 1 - std::pow(std::sin(rho), 2), 0.003);
}

TEST(ShadowTracer, ABallBeforeALargerLightHidesTheirRatio) {
  const double ball = 5 * degree, light = 10 * degree, height = 0.2;
  const ShadowScene scene{
      make_blob({0, 0, height}, height * std::sin(ball), 0, 60, 120), {{{0, 0, 1}, light, {1, 1, 1}}}, {}};
  const double hidden = std::pow(std::sin(ball) / std::sin(light), 2);
  EXPECT_NEAR(ShadowTracer(scene).ratio(small_square, 20000)[0], 1 - hidden, 0.003);
}

TEST(ShadowTracer, LightsWeighByTheirIrradianceOfThePlane) {
  // A sheet hides the zenith alone; the near lamp, 60 degrees away, has E D² cos / r².
  TriangleMesh sheet{{{-0.1, -0.1, 1}, {0.1, -0.1, 1}, {0.1, 0.1, 1}, {-0.1, 0.1, 1}}, {{0, 1, 2}, {0, 2, 3}}};
  const V3 aside{std::sin(60 * degree), 0, std::cos(60 * degree)};
  const ShadowScene scene{sheet, {{{0, 0, 1}, 0, {1, 1, 1}}, {aside, 1 * degree, {1, 2, 0}, 3}}, {}};
  const Rgb ratio = ShadowTracer(scene).ratio(small_square, 1000);
  EXPECT_NEAR(ratio[0], 0.5 / 1.5, 1e-3);
  EXPECT_NEAR(ratio[1], 1.0 / 2.0, 1e-3);
  EXPECT_EQ(ratio[2], 0);
  // One metre nearer to the lamp's foot.
  const double x = 1, r2 = std::pow(3 * aside.x - x, 2) + std::pow(3 * aside.z, 2);
  ShadowScene two = scene;
  for (V3& p : two.mesh.positions) p.x += x;
  const double lamp = 9 * 3 * aside.z / std::pow(r2, 1.5);
  EXPECT_NEAR(ShadowTracer(two).ratio({x, 0, x + 1e-4, 1e-4}, 1000)[0], lamp / (1 + lamp), 1e-3);
}

TEST(ShadowTracer, WithoutLightTheRatioIsOne) {
  const TriangleMesh box = make_box({-1, -1, 0.1}, {1, 1, 0.2}, 1);
  EXPECT_EQ(ShadowTracer({box, {}, {}}).ratio(small_square, 10), (Rgb{1, 1, 1}));
  EXPECT_EQ(ShadowTracer({box, {{{0, 0, -1}, 0.1, {1, 1, 1}}}, {}}).ratio(small_square, 10), (Rgb{1, 1, 1}));
  EXPECT_EQ(ShadowTracer({box, {{{0, 0, 1}, 0.1, {1, 0, 1}}}, {}}).ratio(small_square, 10), (Rgb{0, 1, 0}));
}

TEST(ShadowTracer, MeshesAreClosedAndHaveTheStatedNumberOfTriangles) {
  EXPECT_EQ(make_blob({}, 1, 0.1, 7, 9).triangles.size(), 2U * 6 * 9);
  EXPECT_EQ(make_box({}, {1, 1, 1}, 3).triangles.size(), 12U * 9);
  EXPECT_EQ(make_pole({}, {0, 0, 1}, 0.1, 5, 4).triangles.size(), 2U * 5 * 4);
  EXPECT_EQ(make_chair({}, 1, 0, 2).triangles.size(), 72U * 4);
  for (const TriangleMesh& mesh : {make_blob({}, 1, 0.1, 7, 9), make_box({}, {1, 2, 3}, 3)}) {
    // Every directed edge has one in the other direction, and the enclosed volume is positive: triangles look outwards.
    std::map<std::array<std::array<double, 3>, 2>, int> edges;
    double volume = 0;
    for (const auto& t : mesh.triangles) {
      const V3 a = mesh.positions[t[0]], b = mesh.positions[t[1]], c = mesh.positions[t[2]];
      volume += dot(a, cross(b, c)) / 6;
      for (const auto& [p, q] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) {
        ++edges[{std::array{p.x, p.y, p.z}, std::array{q.x, q.y, q.z}}];
        --edges[{std::array{q.x, q.y, q.z}, std::array{p.x, p.y, p.z}}];
      }
    }
    for (const auto& [edge, count] : edges) EXPECT_EQ(count, 0);
    EXPECT_GT(volume, 1);
  }
}

}  // namespace
}  // namespace lightwell::reference
