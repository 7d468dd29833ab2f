// What a wrong focal length does to a pose, and what corners say of it. For this room's sources.
#pragma once

#include <span>

#include "pose/body_pose.hpp"
#include "pose/corner_solver.hpp"

namespace lightwell {

struct FocalUncertainty {
  Vector6d focal_jacobian = Vector6d::Zero();  ///< Of CornerSolution::probe_middle, as BodyPose::focal_jacobian.
  FocalCheck check;
};

/// `quads` are those that it was solved from. A lens without a focal length (the whole
/// sphere) has none that could be wrong.
[[nodiscard]] FocalUncertainty estimate_focal_uncertainty(const PosedLenses& rig, std::span<const TagObservation> seen, const Quads& quads,
                                     const CornerSolution& solution);

}  // namespace lightwell
