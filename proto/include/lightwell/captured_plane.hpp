// The appearance of a captured glossy plane as a value: L(x, v) = D(x) + S(v), a diffuse texture D and a specular
// lumisphere S (Jachnik, Newcombe & Davison 2012, "Real-Time Surface Light-field Capture for Augmentation of Planar
// Specular Surfaces", section 5).
//
// Plane frame: right-handed, m; origin in the middle of the captured square, z = 0 is the surface, +Z its normal on the
// viewer's side, +X right, +Y to the top of the texture.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <lightwell/color.hpp>
#include <lightwell/descriptor.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/hemisphere_grid.hpp>
#include <lightwell/result.hpp>
#include <lightwell/time.hpp>

namespace lightwell {

inline constexpr int kMaxPlaneTextureEdge = 256;
inline constexpr int kMaxPlaneLevels = 128;

/// A point of the plane, m, in the plane's frame; z is 0.
struct PlanePoint {
  double x = 0, y = 0;

  friend constexpr bool operator==(PlanePoint, PlanePoint) = default;
};

/// What the radiance of a texel or of a direction rests on.
enum class SampleState : std::uint8_t {
  unseen = 0,    ///< No frame saw it. The radiance is an extrapolation, or 0.
  measured = 1,  ///< Measured.
  clipped = 2,   ///< Mostly saturated: the radiance is a lower bound.
};

/// D: the diffuse radiance of edge x edge texels, row by row from the top.
struct PlaneTexture {
  int edge = 0;                    ///< Texels along a side, at most kMaxPlaneTextureEdge; 0: there is no texture.
  std::vector<Radiance> radiance;  ///< edge² elements.
  std::vector<SampleState> state;  ///< edge² elements.

  [[nodiscard]] std::size_t count() const { return static_cast<std::size_t>(edge) * static_cast<std::size_t>(edge); }
};

/// S: the specular radiance by direction towards the viewer, linear between the nodes of a grid in the plane's frame.
struct PlaneLumisphere {
  HemisphereGrid grid;             ///< At most kMaxPlaneLevels levels.
  std::vector<Radiance> radiance;  ///< grid.size() elements.
  std::vector<SampleState> state;  ///< grid.size() elements.
};

/// Directions towards the viewer from which frames were taken.
struct PlaneCoverage {
  HemisphereGrid grid;             ///< At most kMaxPlaneLevels levels.
  std::vector<std::uint8_t> seen;  ///< grid.size() elements, 0 or 1.
};

/// Where the captured texture lies on the plane: p_plane = scale R(rotation) p_texture + (x, y). R turns +X towards +Y.
struct PlaneSimilarity {
  double x_m = 0, y_m = 0;
  double rotation_rad = 0;
  double scale = 1;  ///< 0.5 to 2.

  [[nodiscard]] PlanePoint plane_point(PlanePoint texture) const {
    const double c = scale * std::cos(rotation_rad), s = scale * std::sin(rotation_rad);
    return {c * texture.x - s * texture.y + x_m, s * texture.x + c * texture.y + y_m};
  }
  /// The inverse.
  [[nodiscard]] PlanePoint texture_point(PlanePoint plane) const {
    const double c = std::cos(rotation_rad) / scale, s = std::sin(rotation_rad) / scale;
    const double x = plane.x - x_m, y = plane.y - y_m;
    return {c * x + s * y, c * y - s * x};
  }
  friend constexpr bool operator==(const PlaneSimilarity&, const PlaneSimilarity&) = default;
};

/// What holds for the whole plane.
struct PlaneInfo {
  std::uint32_t capture = 0;  ///< Number of the capture, not 0; another one for each new capture, random at the start.
  ProbeTime mid_exposure;     ///< Of the newest frame that contributed.
  Units units = Units::relative;
  double size_m = 0;                  ///< Side of the texture's square in its own frame: 1e-6 to 1000 m.
  std::optional<Pose> T_probe_plane;  ///< At mid_exposure, with a unit quaternion. None: not known.
  PlaneSimilarity texture_to_plane;
  std::optional<float> gloss_alpha;  ///< GGX alpha of the gloss, 0 to 1.
  /// Specular reflectance at normal incidence, 0 to 1, as gloss_alpha was estimated with; may be an assumption (0.04).
  std::optional<float> f0;

  friend bool operator==(const PlaneInfo&, const PlaneInfo&) = default;
};

/// A plane as an estimator has captured it so far.
struct CapturedPlane {
  PlaneInfo info;
  PlaneTexture texture;
  PlaneLumisphere lumisphere;
  PlaneCoverage coverage;
};

/// Who may receive images. The texture of a plane is a photograph.
enum class ImageRecipients : std::uint8_t { nobody, all_clients };

/// invalid_argument, naming the member, if a value violates the limits above.
[[nodiscard]] Status plane_info_problem(const PlaneInfo& info);
/// The same for the whole plane; also if an array has the wrong length, or a radiance is not finite or above 1e30.
[[nodiscard]] Status captured_plane_problem(const CapturedPlane& plane);

}  // namespace lightwell
