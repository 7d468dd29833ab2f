// Predicts the pose of a moving body with a constant-velocity Kalman filter; the covariance grows with time.
#pragma once

#include <optional>

#include <lightwell/time.hpp>
#include <lightwell/uncertain_pose.hpp>

#include "pose/body_pose.hpp"

namespace lightwell {

/// Standard deviations of the motion model. Larger values widen the search region and allow faster motion.
struct MotionOptions {
  double initial_speed_sigma_m_per_s = 0.4;   ///< Until the second observation.
  double initial_turn_sigma_rad_per_s = 2;    ///< Until the second observation.
  double acceleration_sigma_m_per_s2 = 6;     ///< Process noise: a hand that starts or stops.
  double acceleration_sigma_rad_per_s2 = 40;  ///< Process noise: a hand that starts or stops to turn.

  [[nodiscard]] Status validate() const;
};

/// Constant velocity of the body's origin and constant angular velocity, both in the probe frame. Each velocity has a
/// Kalman filter with one variance for all three axes (Bar-Shalom et al. 2001, section 6.2, white noise acceleration).
class BodyMotion {
 public:
  explicit BodyMotion(const MotionOptions& options) : options_(options) {}

  /// `observation` is T_probe_body with the covariance of the noise that is independent between frames, without the
  /// focal length error, which is common to all frames. Of two observations of the same time (two lenses) the one with
  /// the smaller rotation variance is kept. An observation older than the last one restarts the filter.
  void update(ProbeTime time, const UncertainPose& observation, bool attitude_known);
  /// Discards all observations.
  void reset() { last_.reset(); }

  /// The predicted pose; nullopt before the first observation, or for a time before the last one.
  [[nodiscard]] std::optional<BodyPrediction> predict(ProbeTime time) const;

 private:
  struct State {
    ProbeTime time;
    BodyPrediction observed;
    Vec3d speed, turn;  ///< m/s, rad/s.
    double speed_variance = 0, turn_variance = 0;
  };
  [[nodiscard]] State start(ProbeTime time, const UncertainPose& observation, bool attitude_known) const;

  MotionOptions options_;
  std::optional<State> last_;
};

}  // namespace lightwell
