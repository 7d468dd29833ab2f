// The reflection of a radiant mesh in a glossy plane, by ray tracing in double.
#pragma once

#include <functional>
#include <vector>

#include "reference/glossy_plane.hpp"
#include "reference/shadow_tracer.hpp"
#include "reference/vector.hpp"

namespace lightwell::reference {

/// A mesh in the plane's frame that emits the same radiance in all directions and on both sides.
struct ReflectedScene {
  TriangleMesh mesh;
  std::vector<Rgb> radiance;    ///< Of each vertex, linear between them.
  std::function<Rgb(V3)> room;  ///< Radiance from a unit direction where no object is; 0 if empty.
};

/// What a plane sends to an eye, without its diffuse radiance.
struct TracedReflection {
  Rgb object{};       ///< The integral of f n.l L over the directions in which the mesh lies.
  double hidden = 0;  ///< The integral of f n.l over these directions, divided by that over all.
  Rgb room{};         ///< The integral of f n.l L over the others.
  Rgb whole_room{};   ///< The same without the mesh.
};

class ReflectionTracer {
 public:
  ReflectionTracer(ReflectedScene scene, const Gloss& gloss);

  /// Mean over the rectangle of the plane, towards the eye. Half vectors are drawn from GGX (Walter et al. 2007, eq.
  /// 35) by quasi-random points; each ray has the weight f n.l / density. The statistical error at the edge of an
  /// object is about 0.5 % of its radiance at 4,096 rays.
  [[nodiscard]] TracedReflection reflection(const PlaneRectangle& rectangle, V3 eye, int rays) const;

  /// The same for a perfect mirror that reflects the share albedo(n.v) of all light: the unblurred mirror image.
  [[nodiscard]] TracedReflection mirror(const PlaneRectangle& rectangle, V3 eye, int rays) const;

  /// Whether the mesh is between a point of the plane and the eye.
  [[nodiscard]] bool hides(V3 point, V3 eye) const { return tracer_.hits(point, eye - point, 1); }

  /// The integral of f n.l over the hemisphere, v.z > 0.
  [[nodiscard]] double albedo(double v_z) const;

 private:
  /// Adds a ray of that weight.
  void trace(V3 at, V3 direction, double weight, TracedReflection& sum, double& weights) const;
  template <class Sample>
  [[nodiscard]] TracedReflection mean(const PlaneRectangle& rectangle, V3 eye, int rays, const Sample& sample) const;

  ReflectedScene scene_;
  Gloss gloss_;
  ShadowTracer tracer_;
};

}  // namespace lightwell::reference
