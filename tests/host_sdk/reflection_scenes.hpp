// Virtual objects on a captured glossy plane, for PlaneReflector and for the reference ray tracer.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <lightwell/captured_plane.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/plane_appearance.hpp>
#include <lightwell/plane_reflection.hpp>

#include "reference/reflection_tracer.hpp"

namespace lightwell::test {

/// The plane as a client has received it from a probe that sends images.
[[nodiscard]] PlaneAppearance received_plane(const CapturedPlane& plane,
                                             ImageRecipients images = ImageRecipients::all_clients);
/// linear_plane() with that gloss.
[[nodiscard]] PlaneAppearance glossy_plane(std::optional<float> alpha, std::optional<float> f0 = 0.04F);

struct ReflectionCaseOptions {
  std::string name;
  std::string object;  ///< One of shadow_objects().
  double alpha = 0.1;
  double elevation_deg = 35;  ///< Of the eye, which is at 0.6 m.
  int triangles = 2000;       ///< About.
  std::uint64_t seed = 1;
};

/// The same scene for both sides.
struct ReflectionCase {
  std::string name;
  reference::ReflectedScene scene;
  reference::Gloss gloss;
  PlaneAppearance plane;
  Vec3d eye;
  std::vector<Vec3f> positions;
  std::vector<std::uint32_t> indices;
  std::vector<Radiance> radiance;

  [[nodiscard]] static PlaneGrid grid(int texels) { return {{}, 0.3, 0.3, texels, texels}; }
  [[nodiscard]] RadiantMesh object() const { return {{positions, indices, {}}, radiance, RadiancePer::vertex}; }
};

/// The room has a gradient and a window of 40 x 40 degrees, nine times as bright. The object's radiance varies over its
/// surface from 0.1 to 1.9, with periods of some centimetres.
[[nodiscard]] ReflectionCase make_reflection_case(const ReflectionCaseOptions& options);

/// The cases whose errors are stated: standing, hovering and composite objects; alpha 0.03, 0.1 and 0.2; the eye at 60,
/// 30 and 10 degrees.
[[nodiscard]] std::vector<ReflectionCaseOptions> reflection_cases(int triangles);

/// What a texel shows, by the ray tracer.
struct TracedReflectionTexel {
  int column = 0, row = 0;
  reference::TracedReflection blurred;  ///< Under the lobe.
  reference::TracedReflection sharp;    ///< Of a mirror.
};

/// `count` random texels that the eye sees, in which the object or its mirror image is seen.
[[nodiscard]] std::vector<TracedReflectionTexel> trace_reflection(const ReflectionCase& test_case,
                                                                  const PlaneGrid& grid, int count, int rays);

/// Errors relative to the RMS of the true reflected radiance, over texels and channels; of the hidden share as they
/// are.
struct ReflectionErrors {
  double rms = 0;        ///< Of the rendered radiance.
  double sharp_rms = 0;  ///< Of the unblurred mirror image.
  double hidden_rms = 0;
  double sharp_hidden_rms = 0;
  double percentile_99 = 0;  ///< Of the rendered radiance.
  /// Of what remains of the room's reflection, relative to its RMS without the object: the room is not uniform over the
  /// lobe.
  double room_rms = 0, sharp_room_rms = 0;
};
[[nodiscard]] ReflectionErrors reflection_errors(const std::vector<TracedReflectionTexel>& truth, const PlaneGrid& grid,
                                                 const std::vector<Radiance>& reflected,
                                                 const std::vector<float>& hidden);

[[nodiscard]] reference::PlaneRectangle rectangle_of(const PlaneGrid& grid, int column, int row);

}  // namespace lightwell::test
