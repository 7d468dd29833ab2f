// A scene with a marker body, a table and lamps, and its true irradiance.
//   MarkerScene             the body at its pose, DistantLamp and NearLamp, MarkerAmbient, MarkerTable, MarkerOccluder
//   ambient_from_function, ambient_from_panorama   ambient light as small patches of the sky
//   table_under             the plane on which a face of the body lies
//   face_irradiance, irradiance_at, patch_radiance, lamp_truths, outline_centre   ground truth
//   (images: marker_picture.hpp; bytes: marker_exposure.hpp)
//
// Everything is in the probe frame, in metres, with linear light in any one unit. Each surface is matte and reflects
// albedo / pi of the DIRECT light of lamps and ambient. Not modelled: interreflections; occlusion of ambient light (but
// see MarkerTable); occlusion by the table, so lamps below it shine through. Lamps are occluded exactly, by rays
// against polygons and spheres, by occluders and by the body (seen from the table, and from the body itself if it is
// not convex).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <variant>
#include <vector>

#include <lightwell/geometry.hpp>
#include <lightwell/marker_body.hpp>

#include "reference/panorama.hpp"
#include "reference/vector.hpp"

namespace lightwell::reference {

/// A lamp at infinity.
struct DistantLamp {
  Vec3d direction;                ///< Towards the lamp; any length but zero.
  Rgb irradiance{};               ///< At normal incidence.
  double angular_radius_rad = 0;  ///< Above 0: a uniform disc, with a penumbra; less than pi / 2.
};

/// An isotropic lamp at a position: irradiance = intensity cos / distance².
struct NearLamp {
  Vec3d position;
  Rgb intensity{};
  double radius_m = 0;  ///< Above 0: a Lambertian ball, with a penumbra. Nothing may be inside.
};

using MarkerLamp = std::variant<DistantLamp, NearLamp>;

/// A small piece of the sky.
struct SkyPatch {
  Vec3d direction;  ///< Unit vector towards it.
  Rgb radiance{};
  double solid_angle = 0;  ///< sr.
};

/// Ambient light: the sum of both members.
struct MarkerAmbient {
  /// Radiance as real orthonormal spherical harmonics of bands 0 and 1 in the order constant, y, z, x.
  std::array<Rgb, 4> sh{};
  /// Patches of the sky, for light that bands 0 and 1 cannot represent.
  std::vector<SkyPatch> sky;
};

/// Uniform radiance, as `sh`.
[[nodiscard]] MarkerAmbient even_ambient(const Rgb& radiance);
/// `rows` of a Gauss-Legendre rule in height (about +Y) times 2 `rows` azimuths: for smooth functions of direction.
[[nodiscard]] MarkerAmbient ambient_from_function(const RadianceFunction& radiance, int rows = 64);
/// A panorama rotated by R_probe_panorama. Every block x block pixels are one patch with the same energy and vector
/// irradiance.
[[nodiscard]] MarkerAmbient ambient_from_panorama(const Panorama& panorama, const Quat& probe_panorama, int block = 8);

/// An infinite plane or a disc, visible only from the side of its normal.
struct MarkerTable {
  Vec3d point;
  Vec3d normal{0, 1, 0};  ///< Up, unit.
  Rgb albedo{0.2, 0.2, 0.2};
  double radius_m = std::numeric_limits<double>::infinity();  ///< Radius of the disc around `point`.
  /// Above 0: body and occluders also occlude its ambient light, computed at pixel centres by a quadrature of this many
  /// directions over the hemisphere. Takes seconds per image.
  int ambient_directions = 0;
};

struct SphereOccluder {
  Vec3d center;
  double radius_m = 0;
  Rgb albedo{};
};
/// A flat convex polygon, visible and lit from both sides.
struct PolygonOccluder {
  std::vector<Vec3d> corners;  ///< In order, of either orientation.
  Rgb albedo{};
};
using MarkerOccluder = std::variant<SphereOccluder, PolygonOccluder>;

/// Albedos of a face: ink in the tag's dark cells; otherwise that of the patch at the point; otherwise paper.
struct MarkerInk {
  double paper = 0.80, ink = 0.04;
};

struct MarkerScene {
  MarkerBody body;  ///< Must have passed validate(); its tags must exist in their family.
  Pose probe_body;  ///< T_probe_body.
  MarkerInk ink;
  std::vector<MarkerLamp> lamps;
  MarkerAmbient ambient;
  std::optional<MarkerTable> table;
  std::vector<MarkerOccluder> occluders;
  Rgb background{};        ///< Radiance where no surface is hit.
  int penumbra_rings = 8;  ///< A lamp with a radius is sampled by rings² points, the same for every lit point.
};

/// The plane of the face with tag `tag_id`, facing the body; `point` is the centre of the face's tag. std::out_of_range
/// if the body has no such face.
[[nodiscard]] MarkerTable table_under(const MarkerBody& body, const Pose& probe_body, int tag_id, const Rgb& albedo);

enum class SurfaceKind : std::uint8_t { none, face, ball, occluder, table };

/// A surface of the scene; `index`: of the face or the occluder.
struct Surface {
  SurfaceKind kind = SurfaceKind::none;
  std::size_t index = 0;

  friend bool operator==(const Surface&, const Surface&) = default;
};

/// Irradiance of a small flat surface.
struct Incident {
  Rgb ambient{};
  std::vector<Rgb> lamps;  ///< Per lamp, in the scene's order.

  [[nodiscard]] Rgb total() const;
};

/// Irradiance at a point with a unit normal (probe frame), occluded only by occluders, not by body or table.
[[nodiscard]] Incident irradiance_at(const MarkerScene& scene, Vec3d point, Vec3d normal);
/// Irradiance of a face of scene.body.faces, occluded by occluders and by other parts of the body. Face frame, m.
[[nodiscard]] Incident face_irradiance(const MarkerScene& scene, std::size_t face, FacePoint point);
/// Irradiance of the ball where its normal is `normal` (unit, body frame), occluded likewise. The body must have a
/// ball.
[[nodiscard]] Incident ball_irradiance(const MarkerScene& scene, Vec3d normal);
/// Irradiance of the table, occluded by body and occluders; its ambient light also, if ambient_directions is above 0.
[[nodiscard]] Incident table_irradiance(const MarkerScene& scene, Vec3d point);

/// Mean radiance of a convex part of a face with this albedo, by quadrature: each triangle of the outline is divided
/// into steps² triangles, sampled at their centroids.
[[nodiscard]] Rgb patch_radiance(const MarkerScene& scene, std::size_t face, const FaceOutline& outline,
                                 const Rgb& albedo, int steps = 8);
/// Mean radiance of a patch of the body with its albedo.
[[nodiscard]] Rgb patch_radiance(const MarkerScene& scene, std::size_t face, std::size_t patch, int steps = 8);
/// Centroid of an outline's area, m.
[[nodiscard]] FacePoint outline_centre(const FaceOutline& outline);

/// A lamp relative to the origin of the body frame.
struct LampTruth {
  Vec3d direction_probe, direction_body;  ///< Unit.
  double distance_m = std::numeric_limits<double>::infinity();
  Rgb irradiance{};  ///< At normal incidence there, without occlusion.
};
[[nodiscard]] std::vector<LampTruth> lamp_truths(const MarkerScene& scene);

}  // namespace lightwell::reference
