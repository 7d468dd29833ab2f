// A body with AprilTags from whose shading light is estimated. Meanings: proto/lightwell/v1/marker_body.proto.
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

/// Corners of a convex polygon, counter-clockwise seen from outside.
using FaceOutline = std::vector<FacePoint>;

/// A matte area of uniform colour.
struct MarkerPatch {
  FaceOutline outline;
  std::array<double, 3> albedo{};  ///< r, g, b in (0, 1].

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

  /// invalid_argument, naming the face and the field: no faces or more than 64, a repeated tag number, an outline of
  /// fewer than three points, not convex or clockwise, a patch outside of its face, an albedo outside of (0, 1], a size
  /// that is not positive and finite, an invalid rotation.
  [[nodiscard]] Status validate() const;

  friend bool operator==(const MarkerBody&, const MarkerBody&) = default;
};

/// Reads a MarkerBody in protobuf text format, validates it and normalises rotations. Errors name file, line and
/// remedy.
[[nodiscard]] Result<MarkerBody> load_marker_body(const std::string& path);
[[nodiscard]] Result<MarkerBody> parse_marker_body(std::string_view text, const std::string& name);
/// Text from which parse_marker_body() restores the same values exactly.
[[nodiscard]] std::string marker_body_to_text(const MarkerBody& body);

}  // namespace lightwell
