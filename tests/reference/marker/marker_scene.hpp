// A marker body, a table and lamps as values, and what is true of them: how much light falls where.
//   MarkerScene             the body at its pose, DistantLamp and NearLamp, MarkerAmbient, MarkerTable, MarkerOccluder
//   ambient_from_function, ambient_from_panorama   light from everywhere as small patches of the sky
//   table_under             the plane that a face of the body lies on
//   face_irradiance, irradiance_at, patch_radiance, lamp_truths, outline_centre   the truths
//   (pictures: marker_picture.hpp; bytes: marker_exposure.hpp)
//
// Everything of a scene is in the probe's frame, metres, light linear in any one unit. What is computed: each surface
// is matte and sends back albedo / pi of the light that reaches it STRAIGHT from lamps and ambient. What is left out:
// light that surfaces send to each other; shadows of ambient light (but see MarkerTable); shadows that the table casts,
// so that lamps below it shine through. Lamps are hidden by the body (from the table, and from itself where it is not
// convex) and by occluders, exactly: rays against polygons and spheres.
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

/// As far away as makes no difference.
struct DistantLamp {
  Vec3d direction;                ///< Towards the lamp; any length but zero.
  Rgb irradiance{};               ///< At normal incidence.
  double angular_radius_rad = 0;  ///< Above 0: a uniform disc with a penumbra; below pi / 2.
};

/// At a place, shining alike in all directions: irradiance = intensity cos / distance².
struct NearLamp {
  Vec3d position;
  Rgb intensity{};
  double radius_m = 0;  ///< Above 0: a matte shining ball with a penumbra. Nothing may be inside.
};

using MarkerLamp = std::variant<DistantLamp, NearLamp>;

/// A small piece of the sky.
struct SkyPatch {
  Vec3d direction;  ///< Unit vector towards it.
  Rgb radiance{};
  double solid_angle = 0;  ///< sr.
};

/// Light from everywhere: the sum of both members.
struct MarkerAmbient {
  /// Radiance as real spherical harmonics of bands 0 and 1, the house's convention: constant, y, z, x, orthonormal.
  std::array<Rgb, 4> sh{};
  /// Summed at their directions; for light that bands 0 and 1 do not tell.
  std::vector<SkyPatch> sky;
};

/// sh with the same radiance from everywhere.
[[nodiscard]] MarkerAmbient even_ambient(const Rgb& radiance);
/// `rows` of a Gauss-Legendre rule in height (about +Y) times 2 `rows` azimuths: for smooth functions of direction.
[[nodiscard]] MarkerAmbient ambient_from_function(const RadianceFunction& radiance, int rows = 64);
/// A panorama turned by R_probe_panorama. Every block x block of its pixels is one patch: energy and vector irradiance
/// of a block are kept, its shape is not.
[[nodiscard]] MarkerAmbient ambient_from_panorama(const Panorama& panorama, const Quat& probe_panorama, int block = 8);

/// An endless plane, seen from the side of its normal only.
struct MarkerTable {
  Vec3d point;
  Vec3d normal{0, 1, 0};  ///< Up, unit.
  Rgb albedo{0.2, 0.2, 0.2};
  double radius_m = std::numeric_limits<double>::infinity();  ///< A round one about `point`.
  /// Above 0: body and occluders dim its ambient light too, by a quadrature of so many directions over its hemisphere,
  /// at pixels' centres. Takes seconds a picture.
  int ambient_directions = 0;
};

struct SphereOccluder {
  Vec3d center;
  double radius_m = 0;
  Rgb albedo{};
};
/// Flat, convex, seen and lit from both sides.
struct PolygonOccluder {
  std::vector<Vec3d> corners;  ///< In order, either way round.
  Rgb albedo{};
};
using MarkerOccluder = std::variant<SphereOccluder, PolygonOccluder>;

/// Albedo of a point of a face: ink in the tag's dark cells; else the patch's that it lies in; else paper.
struct MarkerInk {
  double paper = 0.80, ink = 0.04;
};

struct MarkerScene {
  MarkerBody body;  ///< Has passed validate(); its tags exist in their family.
  Pose probe_body;  ///< T_probe_body.
  MarkerInk ink;
  std::vector<MarkerLamp> lamps;
  MarkerAmbient ambient;
  std::optional<MarkerTable> table;
  std::vector<MarkerOccluder> occluders;
  Rgb background{};        ///< Radiance where there is nothing.
  int penumbra_rings = 8;  ///< A lamp with a radius is rings² points, alike for every point that it lights. Half is a
                           ///< quarter of the time.
};

/// The plane of the face of tag `tag_id`, facing the body; `point` below the face's tag. std::out_of_range where the
/// body has no such face.
[[nodiscard]] MarkerTable table_under(const MarkerBody& body, const Pose& probe_body, int tag_id, const Rgb& albedo);

enum class SurfaceKind : std::uint8_t { none, face, ball, occluder, table };

/// Which surface; `index` counts faces or occluders.
struct Surface {
  SurfaceKind kind = SurfaceKind::none;
  std::size_t index = 0;

  friend bool operator==(const Surface&, const Surface&) = default;
};

/// Light on a small flat surface.
struct Incident {
  Rgb ambient{};
  std::vector<Rgb> lamps;  ///< In the scene's order.

  [[nodiscard]] Rgb total() const;
};

/// On a surface at a point with unit normal (probe's frame), hidden by nothing but occluders: not by body or table.
[[nodiscard]] Incident irradiance_at(const MarkerScene& scene, Vec3d point, Vec3d normal);
/// On a face of scene.body.faces, hidden by occluders and by other parts of the body. Face's frame, m.
[[nodiscard]] Incident face_irradiance(const MarkerScene& scene, std::size_t face, FacePoint point);
/// On the ball where its normal is `normal` (unit, body's frame), hidden likewise. The body has a ball.
[[nodiscard]] Incident ball_irradiance(const MarkerScene& scene, Vec3d normal);
/// On the table; hidden by body and occluders, its ambient too where the table asks for it.
[[nodiscard]] Incident table_irradiance(const MarkerScene& scene, Vec3d point);

/// Mean radiance that leaves a convex part of a face with this albedo, by quadrature: the outline's triangles, each cut
/// in steps² with one point in the middle of each.
[[nodiscard]] Rgb patch_radiance(const MarkerScene& scene, std::size_t face, const FaceOutline& outline,
                                 const Rgb& albedo, int steps = 8);
/// Of a patch of the body, with its own albedo.
[[nodiscard]] Rgb patch_radiance(const MarkerScene& scene, std::size_t face, std::size_t patch, int steps = 8);
/// Of an outline's area, m.
[[nodiscard]] FacePoint outline_centre(const FaceOutline& outline);

/// A lamp as seen from the origin of the body's frame.
struct LampTruth {
  Vec3d direction_probe, direction_body;  ///< Unit.
  double distance_m = std::numeric_limits<double>::infinity();
  Rgb irradiance{};  ///< At normal incidence there, hidden by nothing.
};
[[nodiscard]] std::vector<LampTruth> lamp_truths(const MarkerScene& scene);

}  // namespace lightwell::reference
