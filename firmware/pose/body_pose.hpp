// Where a body with tags on it is and how it is turned, from the corners of all its tags together.
//   find_body_pose   T_probe_body with covariance from what the detector saw
//   tags_of          a body's tags, as a room's
//   BodyPrediction   what was known before: makes it fast, and decides where the picture leaves two answers
//
// A body is a room whose tags hang at T_body_face and in which the probe moves, so all is as in mounting.hpp: distances
// between directions, a robust loss, tags that contradict the majority left out, the mirror image of a flat target.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/marker_body.hpp>
#include <lightwell/result.hpp>
#include <lightwell/uncertain_pose.hpp>

#include "pose/mounting.hpp"
#include "pose/posed_lens.hpp"

namespace lightwell {

/// invalid_argument: a family that is not known.
[[nodiscard]] Result<std::vector<WorldTag>> tags_of(const MarkerBody& body);

struct BodyPrediction {
  UncertainPose probe_body;  ///< Finite covariance.
  /// False where the last pose was ambiguous itself: then it decides nothing.
  bool attitude_known = true;
};

struct BodyPoseOptions {
  /// As MountingOptions::model_error_px: lenses, and how exactly paper is folded.
  double model_error_px = 0.05;
  /// As MountingOptions::ambiguity_odds.
  double ambiguity_odds = 400;
  /// Standard deviation of the calibration's focal length, a share of it. A focal length that is 1 % too long puts the
  /// body 1 % too far away, and nothing in the picture of a distant body contradicts. Goes into the covariance, hardly
  /// into the weights: what it makes wrong is the same in every frame.
  double focal_sigma = 0.01;
  /// 2: what one tag alone says is refused.
  int min_tags = 1;

  [[nodiscard]] Status validate() const;
};

/// What the corners say of the focal length, from how much nearer parts of the body look larger.
struct FocalCheck {
  double excess = 0;  ///< By what share of itself the calibration's is too long.
  double sigma = 0;   ///< Standard deviation; infinite where it is beyond 0.05: then nothing is said. Means of many
                      ///< frames say more.
};

struct BodyPose {
  UncertainPose probe_body;
  /// See Mounting: the other attitude, by how much its chi² is larger, and whether that, and the prediction where there
  /// is one, leave the choice open. The covariance is of the one chosen.
  std::optional<Pose> alternative;
  double alternative_excess = 0;
  bool ambiguous = false;
  std::vector<TagReport> tags;  ///< In the order given.
  int used = 0;              ///< Of them.
  double rms_px = 0;         ///< Over the corners used.
  double chi_square = 0;     ///< Over the degrees of freedom; the covariance is scaled by it where it is above 1.
  /// Error of the six numbers of probe_body for a focal length that is too long by the whole of itself. In the
  /// covariance with focal_sigma; common to all frames that look alike.
  std::array<double, 6> focal_jacobian{};
  FocalCheck focal;
};

/// `rig` (a RigParameters will do, see PosedLenses) and `body` have passed validate(). Left out and named in `tags`: a
/// number that the body does not have, a tag that is on edge, mirrored, outside of what the lens sees, turned away in
/// the answer, or contradicts the majority (one that is covered in part, or hangs on another body). The same number may
/// be seen several times. not_found: no tag of the body is left, or fewer than min_tags. failed_precondition: tags
/// contradict each other so that no majority agrees, and no prediction is near one side; corners that determine no
/// pose. invalid_argument: a number that is NaN, a covariance that is none, a lens that the rig does not have, options
/// that do not validate.
[[nodiscard]] Result<BodyPose> find_body_pose(const PosedLenses& rig, const MarkerBody& body,
                                              std::span<const TagObservation> seen,
                                              const std::optional<BodyPrediction>& prediction = std::nullopt,
                                              const BodyPoseOptions& options = {});

}  // namespace lightwell
