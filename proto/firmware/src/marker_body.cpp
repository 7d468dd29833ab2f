#include <cmath>
#include <set>

#include <lightwell/marker_body.hpp>

#include "lightwell/v1/marker_body.pb.h"
#include "messages.hpp"
#include "text_message.hpp"

namespace lightwell {
namespace {

constexpr std::size_t kMaxFaces = 64;
/// Tolerance for patches at the edge of their face, for numbers rounded in a file, m.
constexpr double kEdgeTolerance_m = 1e-6;

/// Twice the signed area of the triangle a, b, c; positive if it is counter-clockwise.
double turn(FacePoint a, FacePoint b, FacePoint c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); }

Status validate_outline(const FaceOutline& outline, const std::string& who) {
  if (outline.size() < 3) return invalid_argument(who + ": outline_m needs three points or more, x and y of each");
  for (const FacePoint& p : outline)
    if (!std::isfinite(p.x) || !std::isfinite(p.y)) return invalid_argument(who + ": outline_m must be finite");
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const FacePoint& a = outline[i];
    const FacePoint& b = outline[(i + 1) % outline.size()];
    if (a == b) return invalid_argument(who + ": outline_m has point " + std::to_string(i) + " twice");
    for (const FacePoint& c : outline)
      if (turn(a, b, c) < -kEdgeTolerance_m * std::hypot(b.x - a.x, b.y - a.y))
        return invalid_argument(who + ": outline_m must be convex and counter-clockwise seen from outside");
  }
  double area = 0;
  for (std::size_t i = 2; i < outline.size(); ++i) area += turn(outline[0], outline[i - 1], outline[i]);
  return area > 1e-12 ? Status() : invalid_argument(who + ": outline_m has no area");
}

Status validate_albedo(const std::array<double, 3>& albedo, const std::string& who) {
  for (const double a : albedo)
    if (!(a > 0) || !(a <= 1)) return invalid_argument(who + ": albedo must be above 0 and at most 1");
  return {};
}

bool within(const FaceOutline& outline, FacePoint p) {
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const FacePoint& a = outline[i];
    const FacePoint& b = outline[(i + 1) % outline.size()];
    if (turn(a, b, p) < -kEdgeTolerance_m * std::hypot(b.x - a.x, b.y - a.y)) return false;
  }
  return true;
}

Result<FaceOutline> outline_from(const google::protobuf::RepeatedField<double>& numbers, const std::string& who) {
  if (numbers.size() % 2 != 0)
    return invalid_argument(who + ": outline_m has an odd number of numbers; it is x, y, x, y, ...");
  FaceOutline out;
  for (int i = 0; i < numbers.size(); i += 2) out.push_back({numbers[i], numbers[i + 1]});
  return out;
}

Result<std::array<double, 3>> albedo_from(const google::protobuf::RepeatedField<double>& numbers,
                                          const std::string& who) {
  if (numbers.size() == 1) return std::array<double, 3>{numbers[0], numbers[0], numbers[0]};
  if (numbers.size() == 3) return std::array<double, 3>{numbers[0], numbers[1], numbers[2]};
  return invalid_argument(who + ": albedo is one number, or r, g, b");
}

Result<MarkerFace> face_from(const v1::MarkerFace& m) {
  const std::string who = "face of tag " + std::to_string(m.tag_id());
  MarkerFace out;
  out.tag_id = static_cast<int>(m.tag_id());
  out.body_face = pose_from(m.pose());
  if (Status s = outline_from(m.outline_m(), who).assign_to(out.outline); !s.ok()) return s;
  for (int i = 0; i < m.patch_size(); ++i) {
    const std::string which = who + ", patch " + std::to_string(i);
    MarkerPatch& patch = out.patches.emplace_back();
    if (Status s = outline_from(m.patch(i).outline_m(), which).assign_to(patch.outline); !s.ok()) return s;
    if (Status s = albedo_from(m.patch(i).albedo(), which).assign_to(patch.albedo); !s.ok()) return s;
  }
  return out;
}

void set_albedo(const std::array<double, 3>& albedo, google::protobuf::RepeatedField<double>& out) {
  if (albedo[0] == albedo[1] && albedo[1] == albedo[2])
    out.Add(albedo[0]);
  else
    for (const double a : albedo) out.Add(a);
}

void set_outline(const FaceOutline& outline, google::protobuf::RepeatedField<double>& out) {
  for (const FacePoint& p : outline) out.Add(p.x), out.Add(p.y);
}

}  // namespace

Status MarkerBody::validate() const {
  if (tag_family != "tag36h11" && tag_family != "tagStandard41h12")
    return invalid_argument("tag_family: '" + tag_family + "' is not known; tag36h11 and tagStandard41h12 are");
  if (!(tag_size_m > 0) || !std::isfinite(tag_size_m))
    return invalid_argument("tag_size_m must be positive and finite");
  if (faces.empty()) return invalid_argument("no face: a body needs at least one, with a tag for its pose");
  if (faces.size() > kMaxFaces) return invalid_argument("more than " + std::to_string(kMaxFaces) + " faces");
  std::set<int> ids;
  for (const MarkerFace& face : faces) {
    const std::string who = "face of tag " + std::to_string(face.tag_id);
    if (face.tag_id < 0) return invalid_argument(who + ": tag_id must not be negative");
    if (!ids.insert(face.tag_id).second) return invalid_argument(who + ": occurs twice; each face needs its own tag");
    if (const Status s = pose_problem(face.body_face); !s.ok()) return s.in(who);
    if (const Status s = validate_outline(face.outline, who); !s.ok()) return s;
    for (std::size_t i = 0; i < face.patches.size(); ++i) {
      const std::string which = who + ", patch " + std::to_string(i);
      if (const Status s = validate_outline(face.patches[i].outline, which); !s.ok()) return s;
      if (const Status s = validate_albedo(face.patches[i].albedo, which); !s.ok()) return s;
      for (const FacePoint& p : face.patches[i].outline)
        if (!within(face.outline, p)) return invalid_argument(which + ": lies outside of its face");
    }
  }
  if (ball) {
    if (!is_finite(ball->center)) return invalid_argument("ball: center_m must be finite");
    if (!(ball->radius_m > 0) || !std::isfinite(ball->radius_m))
      return invalid_argument("ball: radius_m must be positive and finite");
    if (const Status s = validate_albedo(ball->albedo, "ball"); !s.ok()) return s;
  }
  return {};
}

Result<MarkerBody> parse_marker_body(std::string_view text, const std::string& name) {
  v1::MarkerBody m;
  if (const Status s = parse_text_message(text, name, m); !s.ok()) return s;
  MarkerBody out;
  out.name = m.name();
  out.tag_family = m.tag_family();
  out.tag_size_m = m.tag_size_m();
  for (const v1::MarkerFace& face : m.face()) {
    if (Status s = face_from(face).assign_to(out.faces.emplace_back()); !s.ok()) return s.in(name);
  }
  if (m.has_ball()) {
    if (m.ball().center_m_size() != 3) return invalid_argument(name + ": ball: center_m is x, y, z");
    out.ball = MarkerBall{{m.ball().center_m(0), m.ball().center_m(1), m.ball().center_m(2)}, m.ball().radius_m(), {}};
    if (Status s = albedo_from(m.ball().albedo(), "ball").assign_to(out.ball->albedo); !s.ok()) return s.in(name);
  }
  if (const Status s = out.validate(); !s.ok()) return s.in(name);
  for (MarkerFace& face : out.faces) face.body_face.rotation = unit_rotation(face.body_face.rotation);
  return out;
}

Result<MarkerBody> load_marker_body(const std::string& path) { return load_text(path, parse_marker_body); }

std::string marker_body_to_text(const MarkerBody& body) {
  v1::MarkerBody m;
  m.set_name(body.name);
  m.set_tag_family(body.tag_family);
  m.set_tag_size_m(body.tag_size_m);
  for (const MarkerFace& face : body.faces) {
    v1::MarkerFace& f = *m.add_face();
    f.set_tag_id(static_cast<std::uint32_t>(face.tag_id));
    fill_pose(face.body_face, *f.mutable_pose());
    set_outline(face.outline, *f.mutable_outline_m());
    for (const MarkerPatch& patch : face.patches) {
      v1::MarkerPatch& one = *f.add_patch();
      set_outline(patch.outline, *one.mutable_outline_m());
      set_albedo(patch.albedo, *one.mutable_albedo());
    }
  }
  if (body.ball) {
    v1::MarkerBall& b = *m.mutable_ball();
    for (const double c : {body.ball->center.x, body.ball->center.y, body.ball->center.z}) b.add_center_m(c);
    b.set_radius_m(body.ball->radius_m);
    set_albedo(body.ball->albedo, *b.mutable_albedo());
  }
  return text_of(m);
}

}  // namespace lightwell
