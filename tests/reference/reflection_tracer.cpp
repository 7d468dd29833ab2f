#include "reference/reflection_tracer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "reference/quadrature.hpp"

namespace lightwell::reference {
namespace {

void add_scaled(Rgb& to, double factor, const Rgb& value) {
  for (std::size_t c = 0; c < 3; ++c) to[c] += factor * value[c];
}

struct LobeSample {
  V3 direction;
  double weight = 0;  ///< f n.l / density; 0 below the horizon
};

/// Half vector by two numbers of [0, 1).
LobeSample sample_lobe(const Gloss& gloss, const V3& v, double a, double b) {
  const double slope = gloss.alpha * std::sqrt(a / (1 - a));
  const double z = 1 / std::sqrt(1 + slope * slope);
  const V3 h{slope * z * std::cos(2 * pi * b), slope * z * std::sin(2 * pi * b), z};
  const double v_dot_h = dot(v, h);
  const V3 l = (2 * v_dot_h) * h - v;
  if (v_dot_h <= 0 || l.z <= 0) return {l, 0};
  // The density of h is D n.h, of l that over 4 v.h (Walter et al. 2007, eq. 14).
  const double a2 = gloss.alpha * gloss.alpha, q = a2 * z * z + slope * slope * z * z;
  const double density = a2 / (pi * q * q) * z / (4 * v_dot_h);
  return {l, gloss_brdf(gloss, v, l) * l.z / density};
}

}  // namespace

ReflectionTracer::ReflectionTracer(ReflectedScene scene, const Gloss& gloss)
    : scene_(std::move(scene)), gloss_(gloss), tracer_(ShadowScene{scene_.mesh, {}, {}}) {}

void ReflectionTracer::trace(V3 at, V3 direction, double weight, TracedReflection& sum, double& weights) const {
  if (weight <= 0) return;
  weights += weight;
  const Rgb room = scene_.room ? scene_.room(direction) : Rgb{};
  add_scaled(sum.whole_room, weight, room);
  const auto hit = tracer_.nearest_hit(at, direction);
  if (!hit) {
    add_scaled(sum.room, weight, room);
    return;
  }
  const auto& corners = scene_.mesh.triangles[hit->triangle];
  const std::array<double, 3> share{1 - hit->u - hit->v, hit->u, hit->v};
  for (std::size_t k = 0; k < 3; ++k) add_scaled(sum.object, weight * share[k], scene_.radiance[corners[k]]);
  sum.hidden += weight;
}

template <class Sample>
TracedReflection ReflectionTracer::mean(const PlaneRectangle& rectangle, V3 eye, int rays, const Sample& sample) const {
  TracedReflection sum;
  double weights = 0;
  RectanglePoints(rectangle).next_set(rays, [&](V3 at, double a, double b) {
    const LobeSample ray = sample(normalised(eye - at), a, b);
    trace(at, ray.direction, ray.weight, sum, weights);
  });
  for (Rgb* value : {&sum.object, &sum.room, &sum.whole_room})
    for (double& channel : *value) channel /= rays;
  sum.hidden = weights > 0 ? sum.hidden / weights : 0;
  return sum;
}

TracedReflection ReflectionTracer::reflection(const PlaneRectangle& rectangle, V3 eye, int rays) const {
  return mean(rectangle, eye, rays, [&](const V3& v, double a, double b) { return sample_lobe(gloss_, v, a, b); });
}

TracedReflection ReflectionTracer::mirror(const PlaneRectangle& rectangle, V3 eye, int rays) const {
  const V3 middle{(rectangle.left + rectangle.right) / 2, (rectangle.bottom + rectangle.top) / 2, 0};
  const double share = albedo(normalised(eye - middle).z);
  return mean(rectangle, eye, rays, [&](const V3& v, double, double) { return LobeSample{{-v.x, -v.y, v.z}, share}; });
}

double ReflectionTracer::albedo(double v_z) const {
  const V3 v{std::sqrt(1 - v_z * v_z), 0, v_z};
  double sum = 0;
  constexpr int count = 4096;
  for (int i = 0; i < count; ++i)
    sum += sample_lobe(gloss_, v, (i + 0.5) / count, radical_inverse(std::uint64_t(i), 2)).weight;
  return sum / count;
}

}  // namespace lightwell::reference
