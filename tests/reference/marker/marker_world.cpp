#include "reference/marker/marker_world.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace lightwell::reference {

namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
/// Minimum distance of an occluding hit in m, so that a surface does not occlude points on it.
constexpr double kTouching = 1e-9;
/// Tolerance in m for rounding in a body file, when testing whether the body is convex.
constexpr double kFlush = 1e-6;

BoundingBall bounds_of(const std::vector<Vec3d>& points) {
  BoundingBall out;
  for (const Vec3d& p : points) out.center += p * (1.0 / static_cast<double>(points.size()));
  for (const Vec3d& p : points) out.radius = std::max(out.radius, length(p - out.center));
  return out;
}

std::vector<Vec3d> corners_of(const WorldPolygon& polygon) {
  std::vector<Vec3d> out;
  for (const FacePoint& p : polygon.outline) out.push_back(polygon.place(p));
  return out;
}

WorldPolygon face_polygon(const MarkerFace& face, const Pose& probe_body) {
  const Pose at = compose(probe_body, face.body_face);
  WorldPolygon out{at.translation,
                   rotate(at.rotation, Vec3d{1, 0, 0}),
                   rotate(at.rotation, Vec3d{0, 1, 0}),
                   rotate(at.rotation, Vec3d{0, 0, 1}),
                   face.outline,
                   {}};
  out.bounds = bounds_of(corners_of(out));
  return out;
}

WorldPolygon occluder_polygon(const PolygonOccluder& occluder) {
  if (occluder.corners.size() < 3) throw std::invalid_argument("a polygon has three corners or more");
  const Vec3d& a = occluder.corners[0];
  WorldPolygon out;
  out.origin = a;
  out.x = normalized(occluder.corners[1] - a);
  // Orders the corners counter-clockwise about the frame's z, whatever their orientation.
  out.z = normalized(cross(out.x, occluder.corners[2] - a));
  out.y = cross(out.z, out.x);
  for (const Vec3d& p : occluder.corners) out.outline.push_back(out.local(p));
  out.bounds = bounds_of(occluder.corners);
  return out;
}

/// Ray parameter of the hit with the polygon; kNever if there is none.
double polygon_distance(const WorldPolygon& polygon, Vec3d start, Vec3d direction, bool front_only) {
  const double along = dot(polygon.z, direction);
  if (along == 0 || (front_only && along > 0)) return kNever;
  const double t = dot(polygon.z, polygon.origin - start) / along;
  return t > 0 && lies_within(polygon.outline, polygon.local(start + direction * t)) ? t : kNever;
}

/// Ray parameter at which a ray enters a sphere, or leaves it if it starts inside.
double ball_distance(Vec3d center, double radius, Vec3d start, Vec3d direction) {
  const Vec3d to = center - start;
  const double a = dot(direction, direction), half = dot(direction, to), c = dot(to, to) - radius * radius;
  const double root = half * half - a * c;
  if (root < 0) return kNever;
  const double near = (half - std::sqrt(root)) / a, far = (half + std::sqrt(root)) / a;
  return near > 0 ? near : far > 0 ? far : kNever;
}

/// Caches tag bitmaps: AprilTag takes milliseconds to draw one, and hundreds of scenes are made.
const TagBitmap& bitmap_of(TagFamily family, int id) {
  static std::mutex mutex;
  static std::map<std::pair<TagFamily, int>, TagBitmap> known;
  const std::lock_guard lock(mutex);
  const auto at = std::make_pair(family, id);
  if (const auto found = known.find(at); found != known.end()) return found->second;
  const Result<TagBitmap> drawn = tag_bitmap(family, id);
  if (!drawn) throw std::invalid_argument(drawn.status().message());
  return known.emplace(at, *drawn).first->second;
}

void add(Rgb& to, const Rgb& what, double factor = 1) {
  for (std::size_t c = 0; c < 3; ++c) to[c] += factor * what[c];
}

/// Y of band 0, of band 1 in its order y, z, x.
std::array<double, 4> two_bands(Vec3d d) {
  const double even = std::sqrt(1 / (4 * pi)), odd = std::sqrt(3 / (4 * pi));
  return {even, odd * d.y, odd * d.z, odd * d.x};
}

/// A lamp as the disc that is visible from a point.
struct Disc {
  Vec3d direction;
  double half_angle = 0, distance = kNever;
  Rgb irradiance{};   ///< At normal incidence.
  double radius = 0;  ///< Radius of the spherical lamp; 0 for a distant one.
};

Disc disc_of(const MarkerLamp& lamp, Vec3d point) {
  if (const auto* far = std::get_if<DistantLamp>(&lamp))
    return {normalized(far->direction), far->angular_radius_rad, kNever, far->irradiance, 0};
  const auto& near = std::get<NearLamp>(lamp);
  const Vec3d to = near.position - point;
  const double squared = dot(to, to), distance = std::sqrt(squared);
  Disc out{to * (1 / distance), std::asin(std::min(1.0, near.radius_m / distance)), distance, {}, near.radius_m};
  for (std::size_t c = 0; c < 3; ++c) out.irradiance[c] = near.intensity[c] / squared;
  return out;
}

}  // namespace

bool lies_within(const FaceOutline& outline, FacePoint p) {
  for (std::size_t i = 0, last = outline.size() - 1; i < outline.size(); last = i++) {
    const FacePoint &a = outline[last], &b = outline[i];
    if ((b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x) < 0) return false;
  }
  return true;
}

MarkerWorld::MarkerWorld(const MarkerScene& scene) : scene_(&scene) {
  const Result<TagFamily> family = parse_tag_family(scene.body.tag_family);
  if (!family) throw std::invalid_argument(family.status().message());
  cell_m_ = scene.body.tag_size_m / shape_of(*family).edge_cells;

  std::vector<Vec3d> all;
  for (const MarkerFace& face : scene.body.faces) {
    faces_.push_back(face_polygon(face, scene.probe_body));
    bitmaps_.push_back(bitmap_of(*family, face.tag_id));
    face_ambient_.push_back(ambient(faces_.back().z));
    bounded_.push_back({{SurfaceKind::face, faces_.size() - 1}, faces_.back().bounds});
    for (const Vec3d& p : corners_of(faces_.back())) all.push_back(p);
  }
  for (const WorldPolygon& face : faces_)
    for (const Vec3d& p : all) convex_ = convex_ && dot(face.z, p - face.origin) < kFlush;
  body_ = bounds_of(all);
  if (scene.body.ball) {
    convex_ = false;
    ball_center_ = transformed(scene.probe_body, scene.body.ball->center);
    const double radius = scene.body.ball->radius_m;
    bounded_.push_back({{SurfaceKind::ball, 0}, {ball_center_, radius}});
    body_.radius = std::max(body_.radius, length(ball_center_ - body_.center) + radius);
  }
  for (const MarkerOccluder& occluder : scene.occluders) {
    const Surface surface{SurfaceKind::occluder, occluders_.size()};
    if (const auto* ball = std::get_if<SphereOccluder>(&occluder)) {
      occluders_.emplace_back();
      bounded_.push_back({surface, {ball->center, ball->radius_m}});
    } else {
      occluders_.push_back(occluder_polygon(std::get<PolygonOccluder>(occluder)));
      bounded_.push_back({surface, occluders_.back().bounds});
    }
  }
  if (scene.table) plain_table_ambient_ = ambient(scene.table->normal);
}

double MarkerWorld::distance_to(const Surface& surface, Vec3d start, Vec3d direction, bool front_only) const {
  switch (surface.kind) {
    case SurfaceKind::face:
      return polygon_distance(faces_[surface.index], start, direction, front_only);
    case SurfaceKind::ball:
      return ball_distance(ball_center_, scene_->body.ball->radius_m, start, direction);
    case SurfaceKind::occluder:
      if (const auto* ball = std::get_if<SphereOccluder>(&scene_->occluders[surface.index]))
        return ball_distance(ball->center, ball->radius_m, start, direction);
      return polygon_distance(occluders_[surface.index], start, direction, false);
    case SurfaceKind::table: {
      const MarkerTable& table = *scene_->table;
      const double along = dot(table.normal, direction);
      if (!(along < 0)) return kNever;
      const double t = dot(table.normal, table.point - start) / along;
      return t > 0 && length(start + direction * t - table.point) <= table.radius_m ? t : kNever;
    }
    case SurfaceKind::none:
      break;
  }
  return kNever;
}

SurfaceHit MarkerWorld::nearest(Vec3d start, Vec3d direction, const std::vector<Surface>& among) const {
  SurfaceHit out;
  for (const Surface& surface : among)
    if (const double t = distance_to(surface, start, direction, true); t < out.t) out = {surface, t};
  return out;
}

bool MarkerWorld::may_hide(const Surface& surface, const Hiding& hiding) const {
  if (surface == hiding.own) return false;
  if (surface.kind == SurfaceKind::occluder) return hiding.occluders;
  return hiding.body && !(convex_ && hiding.own.kind == SurfaceKind::face);
}

bool MarkerWorld::hidden(Vec3d point, Vec3d direction, double farthest, const Hiding& hiding) const {
  const auto near = [&](const BoundingBall& ball) {
    const Vec3d to = ball.center - point;
    const double along = dot(to, direction);
    return dot(to, to) - along * along <= ball.radius * ball.radius && along >= -ball.radius;
  };
  const bool near_body = near(body_);
  for (const auto& [surface, bounds] : bounded_) {
    if (!may_hide(surface, hiding)) continue;
    if (surface.kind != SurfaceKind::occluder && !near_body) continue;
    if (!near(bounds)) continue;
    const double t = distance_to(surface, point, direction, false);
    if (t > kTouching && t < farthest - kTouching) return true;
  }
  return false;
}

bool MarkerWorld::clear_around(Vec3d point, Vec3d direction, double half_angle, const Hiding& hiding) const {
  const auto apart = [&](const BoundingBall& ball) {
    const Vec3d to = ball.center - point;
    const double distance = length(to);
    return distance > ball.radius && angle_between(to, direction) > half_angle + std::asin(ball.radius / distance);
  };
  const bool apart_from_body = apart(body_);
  return std::all_of(bounded_.begin(), bounded_.end(), [&](const auto& one) {
    if (!may_hide(one.first, hiding)) return true;
    return (one.first.kind != SurfaceKind::occluder && apart_from_body) || apart(one.second);
  });
}

Rgb MarkerWorld::ambient(Vec3d normal) const {
  Rgb out{};
  // Ramamoorthi & Hanrahan 2001, eq. 7 and 8: the cosine lobe scales bands 0 and 1 by pi and 2 pi / 3.
  const std::array<double, 4> y = two_bands(normal);
  for (std::size_t k = 0; k < 4; ++k) add(out, scene_->ambient.sh[k], (k == 0 ? pi : 2 * pi / 3) * y[k]);
  for (const SkyPatch& patch : scene_->ambient.sky)
    add(out, patch.radiance, patch.solid_angle * std::max(0.0, dot(normal, patch.direction)));
  return out;
}

Rgb MarkerWorld::table_ambient(Vec3d point) const {
  Rgb out = plain_table_ambient_;
  const MarkerTable& table = *scene_->table;
  const int count = table.ambient_directions;
  if (count <= 0) return out;
  const Hiding hiding{{SurfaceKind::table, 0}};
  const auto [u, v] = tangent_basis(table.normal);
  // Occluded light is subtracted, so that without occlusion the closed form remains exact. Directions have the density
  // cos / pi: Malley's method on a spiral of equal areas.
  for (int i = 0; i < count; ++i) {
    const double r = std::sqrt((i + 0.5) / count), phi = i * pi * (3 - std::sqrt(5.0));
    const Vec3d d = u * (r * std::cos(phi)) + v * (r * std::sin(phi)) + table.normal * std::sqrt(1 - r * r);
    if (!hidden(point, d, kNever, hiding)) continue;
    const std::array<double, 4> y = two_bands(d);
    for (std::size_t k = 0; k < 4; ++k) add(out, scene_->ambient.sh[k], -y[k] * pi / count);
  }
  for (const SkyPatch& patch : scene_->ambient.sky) {
    const double cosine = dot(table.normal, patch.direction);
    if (cosine > 0 && hidden(point, patch.direction, kNever, hiding))
      add(out, patch.radiance, -patch.solid_angle * cosine);
  }
  return out;
}

Rgb MarkerWorld::lamp_irradiance(const MarkerLamp& lamp, Vec3d point, Vec3d normal, const Hiding& hiding) const {
  const Disc disc = disc_of(lamp, point);
  const double cosine = dot(normal, disc.direction), reach = std::sin(disc.half_angle);
  Rgb out{};
  if (cosine <= -reach || !(disc.distance > 0)) return out;
  if (disc.half_angle == 0) {
    if (cosine > 0 && !hidden(point, disc.direction, disc.distance, hiding)) add(out, disc.irradiance, cosine);
    return out;
  }
  // The whole disc is visible: in closed form, a point source at its centre.
  if (cosine >= reach && clear_around(point, disc.direction, disc.half_angle, hiding)) {
    add(out, disc.irradiance, cosine);
    return out;
  }
  // Rings of equal solid angle: their mean vector is along the axis with the correct length, so that a fully visible
  // disc reproduces the closed form.
  const int rings = std::max(2, scene_->penumbra_rings);
  const auto [u, v] = tangent_basis(disc.direction);
  const double depth = 2 * std::pow(std::sin(disc.half_angle / 2), 2);  // 1 - cos
  const double weight = 2 * depth / (reach * reach * rings * rings);
  double seen = 0;
  for (int i = 0; i < rings; ++i) {
    const double z = 1 - depth * (i + 0.5) / rings, r = std::sqrt(1 - z * z);
    for (int j = 0; j < rings; ++j) {
      const double phi = 2 * pi * (j + 0.5 * (i % 2)) / rings;
      const Vec3d d = u * (r * std::cos(phi)) + v * (r * std::sin(phi)) + disc.direction * z;
      const double c = dot(normal, d);
      if (c <= 0) continue;
      const double surface =
          disc.distance * z - std::sqrt(std::max(0.0, disc.radius * disc.radius - std::pow(disc.distance * r, 2)));
      if (!hidden(point, d, disc.radius > 0 ? surface : kNever, hiding)) seen += c;
    }
  }
  add(out, disc.irradiance, weight * seen);
  return out;
}

Incident MarkerWorld::incident(Vec3d point, Vec3d normal, const Rgb& ambient, const Hiding& hiding) const {
  Incident out{ambient, {}};
  for (const MarkerLamp& lamp : scene_->lamps) out.lamps.push_back(lamp_irradiance(lamp, point, normal, hiding));
  return out;
}

Rgb MarkerWorld::face_albedo(std::size_t face, FacePoint p) const {
  const TagBitmap& bitmap = bitmaps_[face];
  const int column = static_cast<int>(std::floor(p.x / cell_m_ + bitmap.cells / 2.0));
  const int row = static_cast<int>(std::floor(bitmap.cells / 2.0 - p.y / cell_m_));
  const bool in_tag = column >= 0 && row >= 0 && column < bitmap.cells && row < bitmap.cells;
  if (in_tag && bitmap.is_dark(column, row)) return {scene_->ink.ink, scene_->ink.ink, scene_->ink.ink};
  for (const MarkerPatch& patch : scene_->body.faces[face].patches)
    if (lies_within(patch.outline, p)) return patch.albedo;
  return {scene_->ink.paper, scene_->ink.paper, scene_->ink.paper};
}

Vec3d MarkerWorld::normal_at(const Surface& surface, Vec3d point, Vec3d direction) const {
  switch (surface.kind) {
    case SurfaceKind::face:
      return faces_[surface.index].z;
    case SurfaceKind::ball:
      return normalized(point - ball_center_);
    case SurfaceKind::occluder: {
      if (const auto* ball = std::get_if<SphereOccluder>(&scene_->occluders[surface.index]))
        return normalized(point - ball->center);
      const Vec3d& z = occluders_[surface.index].z;
      return dot(z, direction) < 0 ? z : -z;
    }
    case SurfaceKind::table:
      return scene_->table->normal;
    case SurfaceKind::none:
      break;
  }
  return {};
}

Rgb MarkerWorld::radiance(const SurfaceHit& hit, Vec3d start, Vec3d direction, const Rgb& table_ambient) const {
  const Vec3d point = start + direction * hit.t;
  const Vec3d normal = normal_at(hit.surface, point, direction);
  Rgb light{}, albedo{};
  switch (hit.surface.kind) {
    case SurfaceKind::none:
      return scene_->background;
    case SurfaceKind::face:
      light = face_ambient_[hit.surface.index];
      albedo = face_albedo(hit.surface.index, faces_[hit.surface.index].local(point));
      break;
    case SurfaceKind::ball:
      light = ambient(normal);
      albedo = scene_->body.ball->albedo;
      break;
    case SurfaceKind::occluder:
      light = ambient(normal);
      albedo = std::visit([](const auto& one) { return one.albedo; }, scene_->occluders[hit.surface.index]);
      break;
    case SurfaceKind::table:
      light = table_ambient;
      albedo = scene_->table->albedo;
      break;
  }
  for (const MarkerLamp& lamp : scene_->lamps) add(light, lamp_irradiance(lamp, point, normal, {hit.surface}));
  for (std::size_t c = 0; c < 3; ++c) light[c] *= albedo[c] / pi;
  return light;
}

}  // namespace lightwell::reference
