// Velocity of the rig, from its poses in successive captures.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Dense>
#include <Eigen/Geometry>

#include <lightwell/geometry.hpp>

#include "calibration/solve/geometry/board_observations.hpp"

namespace lightwell::calibration {

/// Velocity of the world relative to the rig, in the rig frame: angular (rad/s) and linear (m/s).
struct Twist {
  Vec3d turn, shift;
};

/// Position of a point in the rig frame after `seconds`, to first order in the translation.
template <class T>
Eigen::Matrix<T, 3, 1> transform_by_twist(const Twist& twist, const T& seconds, const Eigen::Matrix<T, 3, 1>& p) {
  // Normalised quaternion from half angles: the error is of third order in the rotation angle, which is small.
  const Eigen::Quaternion<T> q(T(1), T(0.5) * seconds * twist.turn.x, T(0.5) * seconds * twist.turn.y,
                               T(0.5) * seconds * twist.turn.z);
  const Eigen::Matrix<T, 3, 1> shift(seconds * twist.shift.x, seconds * twist.shift.y, seconds * twist.shift.z);
  return q.normalized() * p + shift;
}

/// By capture, from the previous and the next pose in time (central differences). Empty for the first and the last
/// capture, next to gaps of more than a second, and for too few observations.
[[nodiscard]] std::vector<std::optional<Twist>> twists_of(const BoardObservations& observations,
                                                          std::span<const Pose> rig_from_world);

}  // namespace lightwell::calibration
