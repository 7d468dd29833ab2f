#include "pose/marker_bodies.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include <lightwell/text.hpp>

namespace lightwell {

namespace {

constexpr double kMaxSize_m = 10;
/// Polygons of a smaller area are rounding errors, not patches, m².
constexpr double kNoArea = 1e-12;

std::string brief(double value) { return formatted("%.6g", value); }

/// Rounding keeps the decimal numbers of body files short; + 0.0 turns -0 into 0.
double round_to_picometre(double metres) { return std::round(metres * 1e12) / 1e12 + 0.0; }
FacePoint round_to_picometre(FacePoint p) { return {round_to_picometre(p.x), round_to_picometre(p.y)}; }
Vec3d round_to_picometre(Vec3d v) {
  return {round_to_picometre(v.x), round_to_picometre(v.y), round_to_picometre(v.z)};
}

/// Points p with a x + b y <= c.
struct HalfPlane {
  double a = 0, b = 0, c = 0;
};

/// The part of a convex outline within the half plane (Sutherland & Hodgman 1974, one edge).
FaceOutline clipped(const FaceOutline& outline, HalfPlane h) {
  const auto beyond = [&](FacePoint p) { return h.a * p.x + h.b * p.y - h.c; };
  FaceOutline out;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const FacePoint p = outline[i], q = outline[(i + 1) % outline.size()];
    const double of_p = beyond(p), of_q = beyond(q);
    if (of_p <= 0) out.push_back(p);
    if ((of_p < 0 && of_q > 0) || (of_p > 0 && of_q < 0)) {
      const double t = of_p / (of_p - of_q);
      out.push_back({p.x + t * (q.x - p.x), p.y + t * (q.y - p.y)});
    }
  }
  return out;
}

double area_of(const FaceOutline& outline) {
  double twice = 0;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const FacePoint p = outline[i], q = outline[(i + 1) % outline.size()];
    twice += p.x * q.y - q.x * p.y;
  }
  return twice / 2;
}

/// `outline` minus the white square of half width `half`, by quadrants. A quadrant minus the square is not convex, so
/// it consists of two convex patches, above the square and beside it.
std::vector<MarkerPatch> patches_around(const FaceOutline& outline, double half, PaperKind kind) {
  const std::array<double, 4> albedos = quadrant_albedos(kind);
  std::vector<MarkerPatch> out;
  for (std::size_t k = 0; k < 4; ++k) {
    const double sx = k % 2 == 0 ? -1 : 1, sy = k < 2 ? 1 : -1;
    const FaceOutline quadrant = clipped(clipped(outline, {-sx, 0, 0}), {0, -sy, 0});
    const FaceOutline above = clipped(quadrant, {0, -sy, -half});
    const FaceOutline beside = clipped(clipped(quadrant, {0, sy, half}), {-sx, 0, -half});
    for (const FaceOutline& part : {above, beside}) {
      if (part.size() < 3 || area_of(part) < kNoArea) continue;
      MarkerPatch patch;
      for (const FacePoint& p : part) patch.outline.push_back(round_to_picometre(p));
      patch.albedo = {albedos[k], albedos[k], albedos[k]};
      out.push_back(std::move(patch));
    }
  }
  return out;
}

/// The rotation that maps a face's axes to these orthonormal vectors.
Quat rotation_of(Vec3d x, Vec3d y, Vec3d z) {
  Eigen::Matrix3d m;
  m << x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z;
  const Eigen::Quaterniond q(m);
  const auto zero = [](double v) { return std::abs(v) < 1e-15 ? 0.0 : v; };
  Quat out = Quat{zero(q.x()), zero(q.y()), zero(q.z()), zero(q.w())}.normalized();
  // q and -q are the same rotation: take the one whose last non-zero component, in the order x, y, z, w, is positive.
  for (const double v : {out.w, out.z, out.y, out.x}) {
    if (v == 0) continue;
    if (v < 0) out = {0.0 - out.x, 0.0 - out.y, 0.0 - out.z, 0.0 - out.w};
    break;
  }
  return out;
}

/// One face of a solid, computed from the normals of all faces and the inradius.
struct Shaped {
  Pose body_face;
  FaceOutline outline;
  std::vector<HalfPlane> edges;  ///< (a, b) is the unit normal, pointing outwards.
};

Shaped shape(const std::vector<Vec3d>& normals, std::size_t index, double r, Vec3d wanted_up) {
  const Vec3d n = normals[index];
  double nearest = -1;
  for (std::size_t j = 0; j < normals.size(); ++j)
    if (j != index) nearest = std::max(nearest, dot(n, normals[j]));
  // Only adjacent faces: others meet this one at most in a corner.
  std::vector<Vec3d> neighbours;
  for (std::size_t j = 0; j < normals.size(); ++j)
    if (j != index && dot(n, normals[j]) > nearest - 1e-9) neighbours.push_back(normals[j]);

  Vec3d y;
  double best = -2;
  for (const Vec3d& m : neighbours) {
    const Vec3d along = normalized(m - n * dot(m, n));
    for (const Vec3d& axis : {along, -along})
      if (dot(axis, wanted_up) > best + 1e-9) best = dot(axis, wanted_up), y = axis;
  }
  const Vec3d x = cross(y, n);

  Shaped out;
  out.body_face = {rotation_of(x, y, n), round_to_picometre(n * r)};
  for (const Vec3d& m : neighbours) {
    // This face's plane is p = r n + u x + v y, the neighbour's is m.p = r.
    const double a = dot(m, x), b = dot(m, y), inclined = std::hypot(a, b);
    out.edges.push_back({a / inclined, b / inclined, r * (1 - dot(m, n)) / inclined});
  }
  // Sorted counter-clockwise, starting at the bottom; 1e-6 keeps an edge exactly at the bottom first despite rounding.
  const auto angle = [](const HalfPlane& e) {
    return std::fmod(std::atan2(e.b, e.a) + 2.5 * std::numbers::pi + 1e-6, 2 * std::numbers::pi);
  };
  std::ranges::sort(out.edges, {}, angle);
  for (std::size_t i = 0; i < out.edges.size(); ++i) {
    const HalfPlane& p = out.edges[(i + out.edges.size() - 1) % out.edges.size()];
    const HalfPlane& q = out.edges[i];
    const double d = p.a * q.b - q.a * p.b;
    out.outline.push_back(round_to_picometre(FacePoint{(p.c * q.b - q.c * p.b) / d, (p.a * q.c - q.a * p.c) / d}));
  }
  return out;
}

/// Half the side of the largest axis-parallel square, centred at the origin, within these edges.
double largest_half_square(const std::vector<HalfPlane>& edges) {
  double out = kMaxSize_m;
  for (const HalfPlane& e : edges) out = std::min(out, e.c / (std::abs(e.a) + std::abs(e.b)));
  return out;
}

Status check(double size_m, const std::string& field, TagFamily family, int first_id, std::size_t tags) {
  if (!(size_m > 0 && size_m <= kMaxSize_m))
    return invalid_argument(field + " is " + brief(size_m) + "; it is in metres, above 0 and at most 10");
  const int known = shape_of(family).tags, needed = static_cast<int>(tags);
  if (first_id < 0 || first_id > known - needed)
    return invalid_argument(formatted("first_id is %d and the body has %d tags; ", first_id, needed) +
                            std::string(to_string(family)) + " has numbers 0 to " + std::to_string(known - 1));
  return {};
}

/// `given` or, if that is 0, `chosen`. Error if the white square is wider than 2 * half.
Result<double> tag_size(double given, double chosen, TagFamily family, double half) {
  const double largest = 2 * half / white_square_m(family, 1);
  const double size = given == 0 ? chosen : given;
  if (given == 0 && size <= 0) return invalid_argument("size_m is too small for a tag with cells of 0.1 mm");
  if (!(size > 0) || !(size <= largest * (1 + 1e-9)))
    return invalid_argument("tag_size_m is " + brief(size) + "; on this face it is above 0 and at most " +
                            brief(largest));
  return size;
}

std::string in_mm(double metres) { return brief(1000 * metres) + " mm"; }

Result<MarkerBody> make_solid(const std::string& name, const std::vector<Vec3d>& normals, const SolidOptions& options) {
  if (const Status s = check(options.size_m, "size_m", options.family, options.first_id, normals.size()); !s.ok())
    return s;
  MarkerBody out;
  out.name = name + " " + in_mm(options.size_m) + " " + std::string(to_string(options.paper));
  out.tag_family = to_string(options.family);
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const Vec3d up = i == 0 ? Vec3d{0, 0, -1} : i + 1 == normals.size() ? Vec3d{0, 0, 1} : Vec3d{0, 1, 0};
    Shaped shaped = shape(normals, i, options.size_m / 2, up);
    const Result<double> tag = tag_size(options.tag_size_m, tag_size_for(options.family, shaped.edges[0].c),
                                        options.family, largest_half_square(shaped.edges));
    if (!tag) return tag.status();
    out.tag_size_m = round_to_picometre(*tag);
    MarkerFace face;
    face.tag_id = options.first_id + static_cast<int>(i);
    face.body_face = shaped.body_face;
    face.patches = patches_around(shaped.outline, white_square_m(options.family, out.tag_size_m) / 2, options.paper);
    face.outline = std::move(shaped.outline);
    out.faces.push_back(std::move(face));
  }
  if (const Status s = out.validate(); !s.ok()) return s;
  return out;
}

/// Unit vector from the sine of its elevation and its azimuth from +Z towards +X.
Vec3d normal_at(double height, double azimuth_rad) {
  const double level = std::sqrt(1 - height * height);
  return {level * std::sin(azimuth_rad), height, level * std::cos(azimuth_rad)};
}

constexpr double degrees(double d) { return d * std::numbers::pi / 180; }

}  // namespace

std::string_view to_string(PaperKind kind) { return kind == PaperKind::white ? "white" : "grey"; }

Result<PaperKind> parse_paper_kind(std::string_view name) {
  for (const PaperKind kind : {PaperKind::white, PaperKind::grey})
    if (name == to_string(kind)) return kind;
  return invalid_argument("'" + std::string(name) + "' is not a kind of paper; known are white and grey");
}

std::array<double, 4> quadrant_albedos(PaperKind kind) {
  if (kind == PaperKind::grey) return {kPaperAlbedo, 0.60, 0.40, 0.20};
  return {kPaperAlbedo, kPaperAlbedo, kPaperAlbedo, kPaperAlbedo};
}

double white_square_m(TagFamily family, double tag_size_m) {
  const TagShape shape = shape_of(family);
  // The cells of tag36h11 include a white rim. The outermost cells of tagStandard41h12 are data, so a rim is added.
  const int cells = shape.dark_inside ? shape.cells : shape.cells + 2;
  return tag_size_m * cells / shape.edge_cells;
}

double tag_size_for(TagFamily family, double radius_m) {
  constexpr double kStep = 1e-4;
  const double cells = std::round(white_square_m(family, 1) * shape_of(family).edge_cells);
  return std::floor(radius_m / cells / kStep + 1e-6) * kStep * shape_of(family).edge_cells;
}

Result<MarkerBody> make_dodecahedron(const SolidOptions& options) {
  std::vector<Vec3d> normals = {{0, 1, 0}};
  const double height = 1 / std::sqrt(5.0);
  for (int k = 0; k < 5; ++k) normals.push_back(normal_at(height, degrees(72 * k)));
  for (std::size_t k = 1; k <= 5; ++k) normals.push_back(-normals[k]);
  normals.push_back({0, -1, 0});
  return make_solid("dodecahedron", normals, options);
}

Result<MarkerBody> make_cube(const SolidOptions& options) {
  return make_solid("cube", {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}, {0, 0, -1}, {-1, 0, 0}, {0, -1, 0}}, options);
}

Result<MarkerBody> make_icosahedron(const SolidOptions& options) {
  std::vector<Vec3d> normals = {{0, 1, 0}};
  for (int k = 0; k < 3; ++k) normals.push_back(normal_at(std::sqrt(5.0) / 3, degrees(120 * k)));
  // The dot product of neighbouring normals is sqrt(5)/3, which this azimuth difference gives at height 1/3.
  const double turn = std::acos(std::sqrt(5.0 / 8));
  for (int k = 0; k < 3; ++k) {
    normals.push_back(normal_at(1.0 / 3, degrees(120 * k) + turn));
    normals.push_back(normal_at(1.0 / 3, degrees(120 * (k + 1)) - turn));
  }
  for (std::size_t k = 4; k <= 9; ++k) normals.push_back(-normals[k]);
  for (std::size_t k = 1; k <= 3; ++k) normals.push_back(-normals[k]);
  normals.push_back({0, -1, 0});
  return make_solid("icosahedron", normals, options);
}

Result<MarkerBody> make_ball_on_tag(const BallOnTagOptions& options) {
  const double d = options.ball_diameter_m;
  if (const Status s = check(d, "ball_diameter_m", options.family, options.id, 1); !s.ok()) return s;
  // From above, the ball covers the sheet from 0.5 d behind the tag's centre; the white square ends before that.
  const Result<double> tag =
      tag_size(options.tag_size_m, tag_size_for(options.family, 0.75 * d), options.family, 0.45 * d);
  if (!tag) return tag.status();
  MarkerBody out;
  out.name = "ball " + in_mm(d) + " on a tag, " + std::string(to_string(options.paper));
  out.tag_family = to_string(options.family);
  out.tag_size_m = round_to_picometre(*tag);
  out.ball = MarkerBall{{0, 0, 0}, d / 2, {options.ball_albedo, options.ball_albedo, options.ball_albedo}};
  MarkerFace face;
  face.tag_id = options.id;
  face.body_face = {rotation_of({1, 0, 0}, {0, 0, -1}, {0, 1, 0}), round_to_picometre(Vec3d{0, -d / 2, d})};
  const double half = white_square_m(options.family, out.tag_size_m) / 2;
  for (const FacePoint& p : {FacePoint{-1.25 * d, -0.75 * d}, FacePoint{1.25 * d, -0.75 * d},
                             FacePoint{1.25 * d, 1.75 * d}, FacePoint{-1.25 * d, 1.75 * d}})
    face.outline.push_back(round_to_picometre(p));
  face.patches = patches_around(clipped(face.outline, {0, 1, half}), half, options.paper);
  out.faces.push_back(std::move(face));
  if (const Status s = out.validate(); !s.ok()) return s;
  return out;
}

}  // namespace lightwell
