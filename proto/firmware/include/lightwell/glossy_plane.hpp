// A glossy plane from whose reflection light is estimated. Meanings: proto/lightwell/v1/glossy_plane.proto.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/geometry.hpp>
#include <lightwell/marker_body.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

struct PlaneTag {
  int tag_id = 0;
  Pose plane_tag;  ///< T_plane_tag.

  friend bool operator==(const PlaneTag&, const PlaneTag&) = default;
};

struct GlossyPlane {
  std::string name;
  double side_m = 0;
  std::string tag_family = "tag36h11";
  double tag_size_m = 0;
  std::vector<PlaneTag> tags;
  std::optional<double> white_albedo;

  /// invalid_argument, naming the field: a side or a tag size that is not positive and finite (side: 0.01 to 10 m), no
  /// tags or more than 64, a repeated number, an albedo outside of 0.05 to 0.95, an invalid rotation.
  [[nodiscard]] Status validate() const;
  /// The tags as a body in the plane's frame, for the detector: a face for each tag, without patches.
  [[nodiscard]] MarkerBody body() const;

  friend bool operator==(const GlossyPlane&, const GlossyPlane&) = default;
};

/// Reads a GlossyPlane in protobuf text format, validates it and normalises rotations. Errors name file, line and
/// remedy.
[[nodiscard]] Result<GlossyPlane> load_glossy_plane(const std::string& path);
[[nodiscard]] Result<GlossyPlane> parse_glossy_plane(std::string_view text, const std::string& name);
/// Text from which parse_glossy_plane() restores the same values exactly.
[[nodiscard]] std::string glossy_plane_to_text(const GlossyPlane& plane);

}  // namespace lightwell
