// Effect of a focal length error on a pose, and the estimate of that error from the corners. Private to firmware/pose.
#pragma once

#include <span>

#include "pose/body_pose.hpp"
#include "pose/corner_solver.hpp"

namespace lightwell {

struct FocalUncertainty {
  Vector6d focal_jacobian = Vector6d::Zero();  ///< As BodyPose::focal_jacobian, of CornerSolution::probe_centroid.
  FocalCheck check;
};

/// `solution` was solved from `quads`, which are indices into `observations`. An equirectangular lens has no focal
/// length and contributes a zero derivative.
[[nodiscard]] FocalUncertainty estimate_focal_uncertainty(const PosedLenses& rig,
                                                          std::span<const TagObservation> observations,
                                                          const Quads& quads, const CornerSolution& solution);

}  // namespace lightwell
