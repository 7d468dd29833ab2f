// Where in the room the probe is and which way it looks, from tags whose places are known, and from gravity.
//   find_mounting     T_world_probe with covariance, from all tags that all lenses see together
//   gravity_mounting  what gravity alone tells: which way is up
//
// What is minimised is the distance between where a corner is seen and where it should be, by the covariance that the
// detector gives it. It is measured between directions, in the tangent plane of the seen one (stereographic), after the
// pixel's covariance was carried there through the camera model: the same as in the picture to first order, and smooth
// beyond the edge of the lens, where a projection has no value.
//
// A tag's pose: T_world_tag, origin in its centre, +X right, +Y up, +Z towards who reads it (tag_corners()).
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>
#include <lightwell/uncertain_pose.hpp>

#include "pose/tag_board.hpp"
#include "pose/tag_detector.hpp"

namespace lightwell {

/// A tag that hangs in the room. Its pose is taken as exact: measure it better than the probe is wanted.
struct WorldTag {
  TagFamily family = TagFamily::tag36h11;
  int id = 0;
  double size_m = 0;  ///< As TagBoard::tag_size_m.
  Pose world_tag;
};

/// All tags of a board that hangs at `world_board`, which validates.
[[nodiscard]] std::vector<WorldTag> tags_of(const TagBoard& board, const Pose& world_board);

struct TagObservation {
  int lens = 0;
  TagDetection tag;
};

struct GravityReading {
  Vec3d up_probe;  ///< Away from the earth's centre, in the probe's frame (what a resting accelerometer reads); any
                   ///< length.
  double sigma_rad = 0;  ///< Standard deviation of its direction, about each of two axes across it.
};

struct MountingOptions {
  /// How far the camera model may be wrong, px: added to each corner's standard deviation.
  double model_error_px = 0.05;
  /// The second solution of a flat target is reported as ambiguous while the pictures make it less than so many times
  /// as unlikely: 400 is a difference of 12 in chi².
  double ambiguity_odds = 400;

  [[nodiscard]] Status validate() const;
};

/// What a seen tag contributed.
struct TagReport {
  int lens = 0;
  TagFamily family = TagFamily::tag36h11;
  int id = 0;
  double rms_px = 0;  ///< Of its corners against the answer; infinite where the lens would not see one of them. 0 where
                      ///< there is nothing to compare with.
  bool used = false;
  std::string left_out;  ///< Otherwise why not: not in the room's list, seen on edge, contradicts the others.
};

struct Mounting {
  UncertainPose world_probe;
  bool position_known = false;  ///< Otherwise the position is 0 with infinite variance,
  bool heading_known = false;   ///< and likewise the turn about the world's Y.
  /// A flat target that covers a small part of the picture looks alike in two attitudes. The second one, where there
  /// is one, by how much its chi² is larger, and whether that leaves the choice open.
  std::optional<Pose> alternative;
  double alternative_excess = 0;
  bool ambiguous = false;
  std::vector<TagReport> tags;  ///< In the order given.
  double rms_px = 0;         ///< Over the corners used.
  double chi_square = 0;     ///< Over the degrees of freedom; the covariance is scaled by it where it is above 1.
};

/// `rig` has passed validate(). A tag whose corners lie in a line, are turned round (seen from behind, or through a
/// mirror) or outside of what the lens sees is left out, and refused where nothing else is left.
/// invalid_argument: no tag of the room is seen and no gravity given; a number that is NaN; a tag twice in one lens or
/// in the room; options that do not validate. failed_precondition: the tags contradict each other, so that no majority
/// agrees on a place.
[[nodiscard]] Result<Mounting> find_mounting(const RigParameters& rig, std::span<const WorldTag> room,
                                             std::span<const TagObservation> seen,
                                             const std::optional<GravityReading>& gravity = std::nullopt,
                                             const MountingOptions& options = {});

/// Up is known, the turn about it and the position are not: infinite variance. The rotation is the smallest that brings
/// the probe upright. invalid_argument: no direction, no positive uncertainty.
[[nodiscard]] Result<Mounting> gravity_mounting(const GravityReading& gravity);

}  // namespace lightwell
