// A body with AprilTags on it that light is read from, as a value. Meanings: proto/lightwell/v1/marker_body.proto.
//   MarkerBody, MarkerFace, MarkerPatch, MarkerBall
//   load_marker_body, parse_marker_body, marker_body_to_text
//
// The body's frame is right-handed, in metres. A face's frame: origin in the tag's centre, +X to the right of the
// upright tag, +Y up, +Z away from the body; its outline and its patches lie in z = 0.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// A point of a face, m.
struct FacePoint {
  double x = 0, y = 0;

  friend bool operator==(const FacePoint&, const FacePoint&) = default;
};

/// Convex, counter-clockwise seen from outside.
using FaceOutline = std::vector<FacePoint>;

/// One matte colour all over.
struct MarkerPatch {
  FaceOutline outline;
  std::array<double, 3> albedo{};  ///< r, g, b, above 0 to 1.

  friend bool operator==(const MarkerPatch&, const MarkerPatch&) = default;
};

struct MarkerFace {
  int tag_id = 0;
  Pose body_face;  ///< T_body_face.
  FaceOutline outline;
  std::vector<MarkerPatch> patches;

  friend bool operator==(const MarkerFace&, const MarkerFace&) = default;
};

struct MarkerBall {
  Vec3d center;  ///< Body frame, m.
  double radius_m = 0;
  std::array<double, 3> albedo{};

  friend bool operator==(const MarkerBall&, const MarkerBall&) = default;
};

struct MarkerBody {
  std::string name;
  std::string tag_family = "tag36h11";
  double tag_size_m = 0;
  std::vector<MarkerFace> faces;
  std::optional<MarkerBall> ball;

  /// invalid_argument names the face and the field: no faces, more than 64, a tag number twice, outlines of less than
  /// three points, not convex or clockwise, a patch outside of its face, an albedo out of (0, 1], sizes that are not
  /// positive and finite, a rotation that is none.
  [[nodiscard]] Status validate() const;

  friend bool operator==(const MarkerBody&, const MarkerBody&) = default;
};

/// A MarkerBody in text format, validated, rotations normalised. Errors name file, line and remedy.
[[nodiscard]] Result<MarkerBody> load_marker_body(const std::string& path);
[[nodiscard]] Result<MarkerBody> parse_marker_body(std::string_view text, const std::string& name);
/// The same numbers back, to the last bit, from parse_marker_body().
[[nodiscard]] std::string marker_body_to_text(const MarkerBody& body);

}  // namespace lightwell
