// Pose of the probe in the room, from tags at known poses and from gravity.
//
// The least-squares cost is the distance between observed and predicted corners, weighted by the detector's covariance.
// The residual is the difference of directions in the tangent plane of the observed one (stereographic projection),
// with the pixel covariance propagated through the camera model. To first order this equals the reprojection error; it
// is also smooth outside the field of view, where the projection is undefined.
//
// A tag's pose: T_world_tag, origin in its centre, +X right, +Y up, +Z towards the viewer (tag_corners()).
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>
#include <lightwell/uncertain_pose.hpp>

#include "calibration/model/camera_model.hpp"
#include "pose/tag_board.hpp"
#include "pose/tag_detector.hpp"

namespace lightwell {

/// A tag at a known pose. The pose is assumed to be exact: measure it more accurately than the probe's pose is needed.
struct WorldTag {
  TagFamily family = TagFamily::tag36h11;
  int id = 0;
  double size_m = 0;  ///< As TagBoard::tag_size_m.
  Pose world_tag;
};

/// Parses the poses of a room's tags, a CSV file (parse_csv()).
///   family,id,size_m,tx,ty,tz,qx,qy,qz,qw
///   tag36h11,7,0.16,0.5,1.4,-2.0,0,0,0,1
/// family is optional (tag36h11), all others are required. Each row is T_world_tag: metres, and a unit quaternion.
/// Lines that begin with # are ignored. invalid_argument: a malformed line or an invalid value; the message has `name`
/// and the line.
[[nodiscard]] Result<std::vector<WorldTag>> parse_world_tags(std::string_view text, const std::string& name);

/// All tags of a board with the pose `world_board`. `board` has passed validate().
[[nodiscard]] std::vector<WorldTag> tags_of(const TagBoard& board, const Pose& world_board);

/// A lens of a rig, prepared for repeated use: camera model and pose on the probe.
struct PosedLens {
  int width = 0, height = 0;
  Pose probe_lens;  ///< T_probe_lens, lens axes _cv, the rotation normalised.
  CameraModel model;
  std::optional<PixelPosition> axis;  ///< The principal point; an equirectangular picture has none.

  explicit PosedLens(const LensParameters& lens)
      : width(lens.width),
        height(lens.height),
        probe_lens{lens.pose_cv.rotation.normalized(), lens.pose_cv.translation},
        model(lens) {
    std::visit(
        [&](const auto& p) {
          if constexpr (requires { p.cx; }) axis = PixelPosition{p.cx, p.cy};
        },
        lens.model);
  }
};

/// Made from a rig that has passed validate(). Construction takes about a millisecond per lens, because the model
/// computes the limit of its projection: callers that process a video keep one. Converts implicitly from a rig.
struct PosedLenses {
  std::vector<PosedLens> lenses;

  PosedLenses(const RigParameters& rig) {  // NOLINT: implicit by intention
    for (const LensParameters& lens : rig.lenses) lenses.emplace_back(lens);
  }
  [[nodiscard]] bool has(int lens) const { return lens >= 0 && static_cast<std::size_t>(lens) < lenses.size(); }
  [[nodiscard]] const PosedLens& at(int lens) const { return lenses[static_cast<std::size_t>(lens)]; }
};

struct TagObservation {
  int lens = 0;
  TagDetection tag;
};

struct GravityReading {
  Vec3d up_probe;  ///< Away from the earth's centre, probe frame, any length: the reading of a resting accelerometer.
  double sigma_rad = 0;  ///< Standard deviation of the direction, about each of the two axes perpendicular to it.
};

struct MountingOptions {
  /// Standard deviation of the camera model's error, px; its square is added to the variance of each coordinate.
  double model_error_px = 0.05;

  [[nodiscard]] Status validate() const;
};

/// Whether an observed tag was used, and its residual.
struct TagReport {
  int lens = 0;
  TagFamily family = TagFamily::tag36h11;
  int id = 0;
  double rms_px = 0;  ///< RMS reprojection error at the resulting pose; infinite if a corner projects outside the field
                      ///< of view, 0 if the tag's pose in the world is unknown or none was computed.
  bool used = false;
  std::string rejection_reason;  ///< If not used: not in the room's list, on edge, contradicts the others.
};

/// Quality of a pose from tags.
struct PoseFit {
  /// The second pose of a planar target that covers a small part of the picture, twice the logarithm of the likelihood
  /// ratio of the first pose to it, and whether that is too small to decide: below 2 ln 400. The covariance is that of
  /// the first pose.
  std::optional<Pose> alternative;
  double alternative_excess = 0;
  bool ambiguous = false;
  std::vector<TagReport> tags;  ///< One per observation, in their order.
  double rms_px = 0;            ///< RMS reprojection error of the tags used.
  double chi_square = 0;        ///< Reduced chi²; multiplies the covariance where it is above 1.
};

struct Mounting : PoseFit {
  UncertainPose world_probe;
  bool position_known = false;  ///< If false, the position is 0 with infinite variance.
  bool heading_known = false;   ///< If false, the rotation about the world's Y is arbitrary, with infinite variance.
};

/// `rig` has passed validate(). A tag is rejected if its corners are collinear, run clockwise (seen from behind or in a
/// mirror) or lie outside the field of view. Without any tag left, gravity alone gives the result.
/// invalid_argument: no usable tag and no gravity; NaN; a tag twice in one lens or in the room; options that do not
/// validate. failed_precondition: no majority of the tags agrees on a pose; the corners determine no pose.
[[nodiscard]] Result<Mounting> find_mounting(const RigParameters& rig, std::span<const WorldTag> room,
                                             std::span<const TagObservation> observations,
                                             const std::optional<GravityReading>& gravity = std::nullopt,
                                             const MountingOptions& options = {});

/// The smallest rotation that brings the measured up direction to the world's +Y. The heading and the position have
/// infinite variance. invalid_argument: up_probe is zero or NaN, sigma_rad is not positive and finite.
[[nodiscard]] Result<Mounting> gravity_mounting(const GravityReading& gravity);

}  // namespace lightwell
