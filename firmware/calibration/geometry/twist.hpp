// How a rig moves from capture to capture.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Dense>
#include <Eigen/Geometry>

#include <lightwell/geometry.hpp>

#include "calibration/geometry/board_observations.hpp"

namespace lightwell::calibration {

/// Velocity of the world as the rig sees it: a turn (rad/s) and a shift (m/s) in the rig's axes.
struct Twist {
  Vec3d turn, shift;
};

/// Where a point of the rig's frame is after `seconds`, to first order in the shift.
template <class T>
Eigen::Matrix<T, 3, 1> transform_by_twist(const Twist& twist, const T& seconds, const Eigen::Matrix<T, 3, 1>& p) {
  // A turn by half angles, normalised: good to the third order, for offsets within which the rig hardly turns.
  const Eigen::Quaternion<T> q(T(1), T(0.5) * seconds * twist.turn.x, T(0.5) * seconds * twist.turn.y,
                               T(0.5) * seconds * twist.turn.z);
  const Eigen::Matrix<T, 3, 1> shift(seconds * twist.shift.x, seconds * twist.shift.y, seconds * twist.shift.z);
  return q.normalized() * p + shift;
}

/// By capture, from the poses before and after it in time (central differences); not known of the first, the last,
/// beside gaps of more than a second, and where too little was seen.
[[nodiscard]] std::vector<std::optional<Twist>> twists_of(const BoardObservations& observations,
                                                          std::span<const Pose> rig_from_world);

}  // namespace lightwell::calibration
