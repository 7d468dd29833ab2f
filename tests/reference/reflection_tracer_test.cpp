#include "reference/reflection_tracer.hpp"

#include <cmath>
#include <cstddef>
#include <optional>

#include <gtest/gtest.h>

#include "reference/quadrature.hpp"

namespace lightwell::reference {
namespace {

TriangleMesh sheet(double left, double bottom, double right, double top, double height) {
  return {{{left, bottom, height}, {right, bottom, height}, {right, top, height}, {left, top, height}},
          {{0, 1, 2}, {0, 2, 3}}};
}

TEST(ReflectionTracer, EqualsAQuadratureOverTheArea) {
  // A square 0.1 m above the plane whose radiance is linear in x; f n.l L cos dA / r² over its area by a Gauss rule.
  const TriangleMesh mesh = sheet(-0.03, 0.04, 0.07, 0.14, 0.1);
  const auto radiance = [](double x) { return 2 + 10 * x; };
  const double low = radiance(-0.03), high = radiance(0.07);
  ReflectedScene scene{mesh, {{low, 0, 1}, {high, 0, 1}, {high, 0, 1}, {low, 0, 1}}, {}};
  const V3 eye{0.05, -0.2, 0.2}, at{0.01, 0, 0}, v = normalised(eye - at);
  const GaussLegendre rule = gauss_legendre(64);
  for (const double alpha : {0.1, 0.2, 0.5}) {
    double object = 0, solid = 0;
    const Gloss gloss{alpha};
    for (std::size_t i = 0; i < rule.nodes.size(); ++i)
      for (std::size_t j = 0; j < rule.nodes.size(); ++j) {
        const V3 q{0.02 + 0.05 * rule.nodes[i], 0.09 + 0.05 * rule.nodes[j], 0.1}, to = q - at, l = normalised(to);
        const double weight =
            0.0025 * rule.weights[i] * rule.weights[j] * l.z / dot(to, to) * gloss_brdf(gloss, v, l) * l.z;
        object += weight * radiance(q.x);
        solid += weight;
      }
    const ReflectionTracer tracer(scene, gloss);
    constexpr double tiny = 1e-9;
    const TracedReflection traced = tracer.reflection({at.x, at.y, at.x + tiny, at.y + tiny}, eye, 1 << 16);
    // The statistical error of 65,536 quasi-random rays at an edge.
    EXPECT_NEAR(traced.object[0], object, 2e-3 * object) << alpha;
    EXPECT_NEAR(traced.object[2], solid, 2e-3 * solid) << alpha;
    EXPECT_EQ(traced.object[1], 0);
    EXPECT_NEAR(traced.hidden, solid / tracer.albedo(v.z), 3e-3 * traced.hidden) << alpha;
  }
}

TEST(ReflectionTracer, ARoomThatIsUniformIsReflectedByTheAlbedo) {
  const Gloss gloss{0.15};
  const V3 eye{0, -0.3, 0.2};
  const auto room = [](V3) { return Rgb{1, 2, 3}; };
  const ReflectionTracer tracer({sheet(-0.01, 0.1, 0.01, 0.2, 0.1), std::vector<Rgb>(4), room}, gloss);
  const TracedReflection traced = tracer.reflection({0, 0, 1e-9, 1e-9}, eye, 1 << 14);
  const double albedo = tracer.albedo(normalised(eye).z);
  // 1e-3: as above, of a smooth weight.
  EXPECT_NEAR(traced.whole_room[1], 2 * albedo, 1e-3 * albedo);
  EXPECT_GT(traced.hidden, 0.05);
  EXPECT_NEAR(traced.room[0] + traced.hidden * albedo, albedo, 1e-3 * albedo);
}

TEST(ReflectionTracer, TheMirrorShowsTheMirroredPoint) {
  // The ray from the mirrored eye (0, -0.3, -0.2) by (0.01, 0, 0) meets the sheet at (0.015, 0.15), beside its
  // diagonal.
  const ReflectionTracer tracer({sheet(-0.1, 0.1, 0.1, 0.2, 0.1), {{1, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 0, 0}}, {}},
                                Gloss{0.1});
  const V3 eye{0, -0.3, 0.2}, at{0.01, 0, 0};
  const TracedReflection traced = tracer.mirror({at.x - 1e-9, -1e-9, at.x + 1e-9, 1e-9}, eye, 16);
  EXPECT_NEAR(traced.object[0], 1.5 * tracer.albedo(normalised(eye - at).z), 1e-6);
  EXPECT_EQ(traced.hidden, 1);
  EXPECT_EQ(tracer.mirror({0, 0.1, 1e-9, 0.1 + 1e-9}, eye, 16).hidden, 0);
  // The sheet is between a point farther away and the eye.
  EXPECT_TRUE(tracer.hides({0.03, 0.6, 0}, eye));
  EXPECT_FALSE(tracer.hides(at, eye));
}

TEST(ShadowTracer, FindsTheNearestOfSeveralHits) {
  TriangleMesh mesh = joined(sheet(-1, -1, 1, 1, 0.3), joined(sheet(-1, -1, 1, 1, 0.1), sheet(-1, -1, 1, 1, 0.2)));
  const ShadowTracer tracer({mesh, {}, {}});
  const auto hit = tracer.nearest_hit({0.2, 0.1, 0}, {0, 0, 2});
  ASSERT_TRUE(hit.has_value());
  EXPECT_NEAR(hit->distance, 0.05, 1e-12);
  EXPECT_EQ(hit->triangle / 2, 1U);
  EXPECT_FALSE(tracer.nearest_hit({3, 0, 0}, {0, 0, 1}).has_value());
}

}  // namespace
}  // namespace lightwell::reference
