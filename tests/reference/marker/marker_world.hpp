// A MarkerScene prepared for ray tracing: faces as polygons in the probe frame, and occlusion tests. Internal to this
// folder.
//   MarkerWorld
#pragma once

#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include <lightwell/geometry.hpp>

#include "pose/tag_board.hpp"
#include "reference/marker/marker_scene.hpp"

namespace lightwell::reference {

/// A bounding sphere, to skip rays that cannot hit.
struct BoundingBall {
  Vec3d center;
  double radius = 0;
};

struct WorldPolygon {
  Vec3d origin, x, y, z;  ///< A frame; the polygon is in its plane z = 0, and z is its front.
  FaceOutline outline;    ///< Counter-clockwise seen from z.
  BoundingBall bounds;

  [[nodiscard]] Vec3d place(FacePoint p) const { return origin + x * p.x + y * p.y; }
  [[nodiscard]] FacePoint local(Vec3d p) const { return {dot(p - origin, x), dot(p - origin, y)}; }
};

struct SurfaceHit {
  Surface surface;
  double t = std::numeric_limits<double>::infinity();  ///< Ray parameter, in lengths of the ray's direction.
};

/// The surfaces that may occlude a lamp from a point.
struct Hiding {
  Surface own = {};  ///< The point's own surface; it is flat or convex, so it does not occlude.
  bool body = true;  ///< Whether the body may occlude.
  bool occluders = true;
};

class MarkerWorld {
 public:
  /// std::invalid_argument if the body has a tag that does not exist in its family.
  explicit MarkerWorld(const MarkerScene& scene);

  [[nodiscard]] const MarkerScene& scene() const { return *scene_; }
  [[nodiscard]] const std::vector<WorldPolygon>& faces() const { return faces_; }
  /// Faces, ball and occluders: everything that a ray may hit except the table.
  [[nodiscard]] const std::vector<std::pair<Surface, BoundingBall>>& bounded() const { return bounded_; }
  /// The ball's centre in the probe frame, if there is a ball.
  [[nodiscard]] Vec3d ball_center() const { return ball_center_; }

  /// First hit of a camera's ray: faces are visible only from their front, the table only from above.
  [[nodiscard]] SurfaceHit nearest(Vec3d start, Vec3d direction, const std::vector<Surface>& among) const;
  /// The surface's normal at a hit, towards the ray's start.
  [[nodiscard]] Vec3d normal_at(const Surface& surface, Vec3d point, Vec3d direction) const;
  /// The radiance reflected at a hit along -direction.
  [[nodiscard]] Rgb radiance(const SurfaceHit& hit, Vec3d start, Vec3d direction, const Rgb& table_ambient) const;

  [[nodiscard]] Rgb ambient(Vec3d normal) const;
  /// ambient() of the table; with ambient_directions above 0, reduced by the occlusion of body and occluders.
  [[nodiscard]] Rgb table_ambient(Vec3d point) const;
  /// Irradiance by one lamp.
  [[nodiscard]] Rgb lamp_irradiance(const MarkerLamp& lamp, Vec3d point, Vec3d normal, const Hiding& hiding) const;
  [[nodiscard]] Incident incident(Vec3d point, Vec3d normal, const Rgb& ambient, const Hiding& hiding) const;
  [[nodiscard]] const Rgb& face_ambient(std::size_t face) const { return face_ambient_[face]; }
  [[nodiscard]] Rgb face_albedo(std::size_t face, FacePoint p) const;

 private:
  [[nodiscard]] double distance_to(const Surface& surface, Vec3d start, Vec3d direction, bool front_only) const;
  [[nodiscard]] bool hidden(Vec3d point, Vec3d direction, double farthest, const Hiding& hiding) const;
  [[nodiscard]] bool clear_around(Vec3d point, Vec3d direction, double half_angle, const Hiding& hiding) const;
  [[nodiscard]] bool may_hide(const Surface& surface, const Hiding& hiding) const;

  const MarkerScene* scene_;
  std::vector<WorldPolygon> faces_;
  std::vector<WorldPolygon> occluders_;  ///< With empty outlines for spheres.
  std::vector<TagBitmap> bitmaps_;
  std::vector<Rgb> face_ambient_;
  std::vector<std::pair<Surface, BoundingBall>> bounded_;
  BoundingBall body_;  ///< Faces and ball together.
  Vec3d ball_center_;
  double cell_m_ = 0;
  bool convex_ = true;  ///< No part of the body occludes lamps from another part.
  Rgb plain_table_ambient_{};
};

/// Whether p is inside or on the edge of a convex counter-clockwise outline.
[[nodiscard]] bool lies_within(const FaceOutline& outline, FacePoint p);

}  // namespace lightwell::reference
