// Seen corners as directions in the probe's frame, and the first pose that a single tag gives. For this room's sources.
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

/// A corner that is seen and whose place in the room is known.
struct CornerObservation {
  Vec3d world;            ///< Where it is.
  Vec3d lens;             ///< Where the lens is, probe frame.
  Vec3d direction;        ///< Unit, probe frame.
  Vec3d u, v;             ///< The tangent plane's axes at `direction`.
  Eigen::Matrix2d weigh;  ///< Makes (u, v) of an error a pair of independent numbers of variance 1.
};

/// The four corners of one tag in one lens.
struct ObservedTag {
  std::size_t index = 0;  ///< In the list of seen tags.
  const WorldTag* tag = nullptr;
  std::vector<CornerObservation> corners;
  Pose probe_world;  ///< From this tag alone: algebraic, good to a few pixels.
};

/// "tag36h11 5 in lens 0", as messages name it.
[[nodiscard]] std::string name_of(const TagObservation& seen);

/// invalid_argument: a number that is none. failed_precondition: corners that do not show where the tag is.
[[nodiscard]] Result<ObservedTag> directions_of(const PosedLens& lens, const TagObservation& seen, const WorldTag& tag,
                                             double model_error_px);

}  // namespace lightwell
