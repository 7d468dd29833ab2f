// Virtual objects in random light on a plane, for ShadowCaster and for the reference ray tracer.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <lightwell/geometry.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/shadows.hpp>

#include "reference/shadow_tracer.hpp"

namespace lightwell::test {

/// The same scene for both sides. The plane is a square of `side_m`.
struct ShadowCase {
  std::string name;
  double side_m = 0.3;
  reference::ShadowScene scene;  ///< In the plane's frame.
  Lighting lighting;             ///< The same light in the lighting's frame.
  Pose T_lighting_plane;
  std::vector<Vec3f> positions;
  std::vector<std::uint32_t> indices;

  [[nodiscard]] ShadowReceiver receiver(int texels) const { return {T_lighting_plane, side_m, side_m, texels, texels}; }
  [[nodiscard]] ShadowMesh mesh() const { return {positions, indices, {}}; }
};

/// Object and light of a case. The residual is uniform.
struct ShadowCaseOptions {
  std::string name;
  std::string object;             ///< One of shadow_objects().
  int triangles = 2000;           ///< About.
  std::vector<double> radii_deg;  ///< Angular radius of each light.
  double min_elevation_deg = 20;
  double max_elevation_deg = 80;
  double residual_share = 0.4;  ///< Of the plane's irradiance.
  std::uint64_t seed = 1;
};

[[nodiscard]] const std::vector<std::string>& shadow_objects();
/// One of shadow_objects(), or "leaves", on or above the plane.
[[nodiscard]] reference::TriangleMesh make_shadow_object(const std::string& object, int triangles, std::uint64_t seed);
[[nodiscard]] ShadowCase make_shadow_case(const ShadowCaseOptions& options);

/// The cases whose errors are stated: every object in four lights of 0.5 to 10 degrees, lights at grazing elevation,
/// residual alone, lights alone.
[[nodiscard]] std::vector<ShadowCaseOptions> shadow_cases(int triangles);

/// Separate triangles in random attitudes: the worst case, of which every edge is an outline.
[[nodiscard]] ShadowCaseOptions unconnected_case(int triangles);

/// Light of a scene, in the frame in which T_lighting_plane places the plane. Uniform residual radiance.
[[nodiscard]] Lighting lighting_of(const std::vector<reference::ShadowLight>& lights, reference::Rgb residual,
                                   const Pose& T_lighting_plane);

/// Error of the ratio, over texels and channels.
struct ShadowErrors {
  double rms = 0;
  double percentile_99 = 0;
  double largest = 0;
  double rms_shadowed = 0;  ///< Over those whose true ratio is below 0.995.
};

/// The true ratio of a texel.
struct TracedTexel {
  int column = 0, row = 0;
  reference::Rgb ratio{};
};

/// Random texels, `count` of them, by the ray tracer.
[[nodiscard]] std::vector<TracedTexel> trace_texels(const ShadowCase& test_case, const ShadowReceiver& receiver,
                                                    int count, int rays);

[[nodiscard]] ShadowErrors shadow_errors(const std::vector<TracedTexel>& truth, const ShadowReceiver& receiver,
                                         const std::vector<LightRatio>& ratios);

/// The rectangle of a texel.
[[nodiscard]] reference::PlaneRectangle rectangle_of(const ShadowReceiver& receiver, int column, int row);

}  // namespace lightwell::test
