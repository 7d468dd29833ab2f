// Pose of a body with tags on it, from the corners of all its tags together: the method of mounting.hpp, with the body
// frame as the world frame and T_body_face as the poses of the tags.
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

namespace lightwell {

/// The tags of the body, in the body frame. invalid_argument: an unknown tag family.
[[nodiscard]] Result<std::vector<WorldTag>> tags_of(const MarkerBody& body);

/// A prior pose: saves the search for a start, and resolves the ambiguity of a planar target.
struct BodyPrediction {
  UncertainPose probe_body;  ///< Finite covariance.
  /// False if the last pose was ambiguous: then the prediction does not resolve an ambiguity.
  bool attitude_known = true;
};

/// model_error_px covers the camera model and the accuracy of the folded body.
struct BodyPoseOptions : MountingOptions {
  /// Relative standard deviation of the calibrated focal length. It is added to the covariance of the pose; the weights
  /// of the corners do not use it, because the error is the same in every frame.
  double focal_sigma = 0.01;

  [[nodiscard]] Status validate() const;
};

/// The prediction, too, may decide between probe_body and `alternative`.
struct BodyPose : PoseFit {
  UncertainPose probe_body;
  int used = 0;  ///< Number of tags used.
  /// Derivative of the six parameters of probe_body with respect to the relative focal length error (rad and m per
  /// 100 %). The covariance contains it, scaled with focal_sigma; it is common to all frames with a similar view.
  std::array<double, 6> focal_jacobian{};
};

/// `rig` (a RigParameters converts, see PosedLenses) and `body` have passed validate(). The same tag id may be observed
/// several times. Rejected, with the reason in `tags`: an id that the body does not have; a tag that is on edge,
/// mirrored, outside the field of view, or facing away in the result; an outlier (partly occluded, or on another body).
/// not_found: no tag of the body is left. failed_precondition: no majority of the tags agrees on a pose and the
/// prediction does not decide; the corners determine no pose. invalid_argument: NaN, a covariance that is not positive
/// definite, a lens that the rig does not have, options that do not validate.
[[nodiscard]] Result<BodyPose> find_body_pose(const PosedLenses& rig, const MarkerBody& body,
                                              std::span<const TagObservation> observations,
                                              const std::optional<BodyPrediction>& prediction = std::nullopt,
                                              const BodyPoseOptions& options = {});

}  // namespace lightwell
