#include <lightwell/glossy_plane.hpp>

#include "lightwell/v1/glossy_plane.pb.h"
#include "messages.hpp"
#include "text_message.hpp"

namespace lightwell {

Status GlossyPlane::validate() const {
  if (!(side_m >= 0.01) || !(side_m <= 10))
    return invalid_argument("side_m must be 0.01 to 10: the side of the square that is captured, in metres");
  if (tags.empty())
    return invalid_argument("no tag: the pose of the plane needs at least one; four around the square are best");
  if (white_albedo && (!(*white_albedo >= 0.05) || !(*white_albedo <= 0.95)))
    return invalid_argument("white_albedo must be 0.05 to 0.95; leave it out where it is not known");
  // Family, tag size, numbers and poses.
  return body().validate();
}

MarkerBody GlossyPlane::body() const {
  MarkerBody out;
  out.name = name;
  out.tag_family = tag_family;
  out.tag_size_m = tag_size_m;
  const double half = tag_size_m / 2;
  for (const PlaneTag& tag : tags)
    out.faces.push_back({tag.tag_id, tag.plane_tag, {{-half, -half}, {half, -half}, {half, half}, {-half, half}}, {}});
  return out;
}

Result<GlossyPlane> parse_glossy_plane(std::string_view text, const std::string& name) {
  v1::GlossyPlane m;
  if (const Status s = parse_text_message(text, name, m); !s.ok()) return s;
  GlossyPlane out;
  out.name = m.name();
  out.side_m = m.side_m();
  out.tag_family = m.tag_family();
  out.tag_size_m = m.tag_size_m();
  for (const v1::PlaneTag& tag : m.tag()) out.tags.push_back({static_cast<int>(tag.tag_id()), pose_from(tag.pose())});
  if (m.has_white_albedo()) out.white_albedo = m.white_albedo();
  if (const Status s = out.validate(); !s.ok()) return s.in(name);
  for (PlaneTag& tag : out.tags) tag.plane_tag.rotation = unit_rotation(tag.plane_tag.rotation);
  return out;
}

Result<GlossyPlane> load_glossy_plane(const std::string& path) { return load_text(path, parse_glossy_plane); }

std::string glossy_plane_to_text(const GlossyPlane& plane) {
  v1::GlossyPlane m;
  m.set_name(plane.name);
  m.set_side_m(plane.side_m);
  m.set_tag_family(plane.tag_family);
  m.set_tag_size_m(plane.tag_size_m);
  for (const PlaneTag& tag : plane.tags) {
    v1::PlaneTag& t = *m.add_tag();
    t.set_tag_id(static_cast<std::uint32_t>(tag.tag_id));
    fill_pose(tag.plane_tag, *t.mutable_pose());
  }
  if (plane.white_albedo) m.set_white_albedo(*plane.white_albedo);
  return text_of(m);
}

}  // namespace lightwell
