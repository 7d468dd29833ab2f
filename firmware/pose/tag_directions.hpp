// Observed corners as directions in the probe frame, and the initial pose from a single tag. Private to firmware/pose.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <lightwell/calibration.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/result.hpp>

#include "pose/mounting.hpp"
#include "pose/posed_lens.hpp"

namespace lightwell {

/// An observed corner whose position in the world is known.
struct CornerObservation {
  Vec3d world;                ///< Position of the corner, world frame, m.
  Vec3d lens;                 ///< Position of the lens, probe frame, m.
  Vec3d direction;            ///< Observed direction, unit vector, probe frame.
  Vec3d u, v;                 ///< Axes of the tangent plane at `direction`, probe frame.
  Eigen::Matrix2d whitening;  ///< Maps an error (u, v), rad, to independent components of variance 1.
};

/// The four corners of one tag in one lens.
struct ObservedTag {
  std::size_t index = 0;  ///< Index of the TagObservation.
  const WorldTag* tag = nullptr;
  std::vector<CornerObservation> corners;
  Pose probe_world;  ///< Algebraic estimate from this tag alone, accurate to a few pixels.
};

/// "tag36h11 5 in lens 0", as messages name it.
[[nodiscard]] std::string name_of(const TagObservation& observation);

/// Unprojects the corners of `observation`; ObservedTag::index is left 0 and `tag` must outlive the result.
/// invalid_argument: NaN or an invalid covariance. failed_precondition: corners that do not determine the tag's pose.
[[nodiscard]] Result<ObservedTag> directions_of(const PosedLens& lens, const TagObservation& observation,
                                                const WorldTag& tag, double model_error_px);

}  // namespace lightwell
