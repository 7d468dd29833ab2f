#include <cmath>
#include <set>

#include <google/protobuf/text_format.h>

#include <lightwell/files.hpp>
#include <lightwell/marker_body.hpp>

#include "lightwell/v1/marker_body.pb.h"
#include "text_message.hpp"

namespace lightwell {
namespace {

constexpr std::size_t kMaxFaces = 64;
/// Tolerance for patches at the edge of their face, for numbers rounded in a file, m.
constexpr double kEdgeTolerance_m = 1e-6;

Status wrong(const std::string& what) { return {StatusCode::invalid_argument, what}; }

bool finite(Vec3d v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

/// Twice the signed area of the triangle a, b, c; positive if it is counter-clockwise.
double turn(FacePoint a, FacePoint b, FacePoint c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); }

Status validate_outline(const FaceOutline& outline, const std::string& who) {
  if (outline.size() < 3) return wrong(who + ": outline_m needs three points or more, x and y of each");
  for (const FacePoint& p : outline)
    if (!std::isfinite(p.x) || !std::isfinite(p.y)) return wrong(who + ": outline_m must be finite");
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const FacePoint& a = outline[i];
    const FacePoint& b = outline[(i + 1) % outline.size()];
    if (a == b) return wrong(who + ": outline_m has point " + std::to_string(i) + " twice");
    for (const FacePoint& c : outline)
      if (turn(a, b, c) < -kEdgeTolerance_m * std::hypot(b.x - a.x, b.y - a.y))
        return wrong(who + ": outline_m must be convex and counter-clockwise seen from outside");
  }
  double area = 0;
  for (std::size_t i = 2; i < outline.size(); ++i) area += turn(outline[0], outline[i - 1], outline[i]);
  return area > 1e-12 ? Status() : wrong(who + ": outline_m has no area");
}

Status validate_albedo(const std::array<double, 3>& albedo, const std::string& who) {
  for (const double a : albedo)
    if (!(a > 0) || !(a <= 1)) return wrong(who + ": albedo must be above 0 and at most 1");
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
  if (numbers.size() % 2 != 0) return wrong(who + ": outline_m has an odd number of numbers; it is x, y, x, y, ...");
  FaceOutline out;
  for (int i = 0; i < numbers.size(); i += 2) out.push_back({numbers[i], numbers[i + 1]});
  return out;
}

Result<std::array<double, 3>> albedo_from(const google::protobuf::RepeatedField<double>& numbers,
                                          const std::string& who) {
  if (numbers.size() == 1) return std::array<double, 3>{numbers[0], numbers[0], numbers[0]};
  if (numbers.size() == 3) return std::array<double, 3>{numbers[0], numbers[1], numbers[2]};
  return wrong(who + ": albedo is one number, or r, g, b");
}

Result<MarkerFace> face_from(const v1::MarkerFace& m) {
  const std::string who = "face of tag " + std::to_string(m.tag_id());
  MarkerFace out;
  out.tag_id = static_cast<int>(m.tag_id());
  const v1::Pose& p = m.pose();
  out.body_face = {{p.qx(), p.qy(), p.qz(), p.qw()}, {p.tx(), p.ty(), p.tz()}};
  Result<FaceOutline> outline = outline_from(m.outline_m(), who);
  if (!outline) return outline.status();
  out.outline = std::move(*outline);
  for (int i = 0; i < m.patch_size(); ++i) {
    const std::string which = who + ", patch " + std::to_string(i);
    Result<FaceOutline> around = outline_from(m.patch(i).outline_m(), which);
    if (!around) return around.status();
    const Result<std::array<double, 3>> albedo = albedo_from(m.patch(i).albedo(), which);
    if (!albedo) return albedo.status();
    out.patches.push_back({std::move(*around), *albedo});
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
    return wrong("tag_family: '" + tag_family + "' is not known; tag36h11 and tagStandard41h12 are");
  if (!(tag_size_m > 0) || !std::isfinite(tag_size_m)) return wrong("tag_size_m must be positive and finite");
  if (faces.empty()) return wrong("no face: a body needs at least one, with a tag for its pose");
  if (faces.size() > kMaxFaces) return wrong("more than " + std::to_string(kMaxFaces) + " faces");
  std::set<int> ids;
  for (const MarkerFace& face : faces) {
    const std::string who = "face of tag " + std::to_string(face.tag_id);
    if (face.tag_id < 0) return wrong(who + ": tag_id must not be negative");
    if (!ids.insert(face.tag_id).second) return wrong(who + ": occurs twice; each face needs its own tag");
    const Quat& q = face.body_face.rotation;
    const double squared = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
    if (!(squared > 1e-18) || !std::isfinite(squared))
      return wrong(who + ": pose has no rotation: qx, qy, qz, qw are zero or not finite");
    if (!finite(face.body_face.translation)) return wrong(who + ": pose: tx, ty, tz must be finite");
    if (const Status s = validate_outline(face.outline, who); !s.ok()) return s;
    for (std::size_t i = 0; i < face.patches.size(); ++i) {
      const std::string which = who + ", patch " + std::to_string(i);
      if (const Status s = validate_outline(face.patches[i].outline, which); !s.ok()) return s;
      if (const Status s = validate_albedo(face.patches[i].albedo, which); !s.ok()) return s;
      for (const FacePoint& p : face.patches[i].outline)
        if (!within(face.outline, p)) return wrong(which + ": lies outside of its face");
    }
  }
  if (ball) {
    if (!finite(ball->center)) return wrong("ball: center_m must be finite");
    if (!(ball->radius_m > 0) || !std::isfinite(ball->radius_m))
      return wrong("ball: radius_m must be positive and finite");
    if (const Status s = validate_albedo(ball->albedo, "ball"); !s.ok()) return s;
  }
  return {};
}

Result<MarkerBody> parse_marker_body(std::string_view text, const std::string& name) {
  v1::MarkerBody m;
  if (const Status s = parse_text_message(text, name, m); !s.ok()) return s;
  const auto in_file = [&](const Status& s) { return Status(s.code(), name + ": " + s.message()); };
  MarkerBody out;
  out.name = m.name();
  out.tag_family = m.tag_family();
  out.tag_size_m = m.tag_size_m();
  for (const v1::MarkerFace& face : m.face()) {
    Result<MarkerFace> one = face_from(face);
    if (!one) return in_file(one.status());
    out.faces.push_back(std::move(*one));
  }
  if (m.has_ball()) {
    if (m.ball().center_m_size() != 3) return in_file(wrong("ball: center_m is x, y, z"));
    const Result<std::array<double, 3>> albedo = albedo_from(m.ball().albedo(), "ball");
    if (!albedo) return in_file(albedo.status());
    out.ball =
        MarkerBall{{m.ball().center_m(0), m.ball().center_m(1), m.ball().center_m(2)}, m.ball().radius_m(), *albedo};
  }
  if (const Status s = out.validate(); !s.ok()) return in_file(s);
  for (MarkerFace& face : out.faces) {
    const Quat& q = face.body_face.rotation;
    // Unit quaternions are kept unchanged, so that writing and reading a body restores it exactly.
    if (std::abs(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1) > 1e-12) face.body_face.rotation = q.normalized();
  }
  return out;
}

Result<MarkerBody> load_marker_body(const std::string& path) {
  const Result<std::string> text = read_text_file(path);
  if (!text) return text.status();
  return parse_marker_body(*text, path);
}

std::string marker_body_to_text(const MarkerBody& body) {
  v1::MarkerBody m;
  m.set_name(body.name);
  m.set_tag_family(body.tag_family);
  m.set_tag_size_m(body.tag_size_m);
  for (const MarkerFace& face : body.faces) {
    v1::MarkerFace& f = *m.add_face();
    f.set_tag_id(static_cast<std::uint32_t>(face.tag_id));
    v1::Pose& p = *f.mutable_pose();
    const auto& [q, t] = face.body_face;
    p.set_qx(q.x), p.set_qy(q.y), p.set_qz(q.z), p.set_qw(q.w);
    p.set_tx(t.x), p.set_ty(t.y), p.set_tz(t.z);
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
  std::string text;
  google::protobuf::TextFormat::PrintToString(m, &text);
  return text;
}

}  // namespace lightwell
