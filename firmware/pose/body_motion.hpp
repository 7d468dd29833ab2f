// Where a body will be: it goes on as it moved, and the doubt grows with time.
#pragma once

#include <optional>

#include <lightwell/time.hpp>
#include <lightwell/uncertain_pose.hpp>

#include "pose/body_pose.hpp"

namespace lightwell {

/// Standard deviations of what is not known. Larger: wider searches, faster hands followed.
struct MotionOptions {
  double initial_speed_sigma_m_per_s = 0.4;     ///< Before two sightings.
  double initial_turn_sigma_rad_per_s = 2;      ///< Likewise.
  double acceleration_sigma_m_per_s2 = 6;     ///< A hand that starts or stops.
  double acceleration_sigma_rad_per_s2 = 40;  ///< Likewise.

  [[nodiscard]] Status validate() const;
};

/// Constant velocity of the body's origin and constant turn, in the probe's axes, each by a Kalman filter with one
/// variance for all three axes (Bar-Shalom et al. 2001, section 6.2, white noise acceleration).
class BodyMotion {
 public:
  explicit BodyMotion(const MotionOptions& options) : options_(options) {}

  /// `noise` is what differs from frame to frame: without a focal length's error, which moves all poses alike.
  /// Of two sightings of one time (two lenses) the surer one counts; one from before the last starts anew.
  void update(ProbeTime at, const UncertainPose& noise, bool attitude_known);
  void forget() { last_.reset(); }

  /// Nothing before the first sighting, or for a time before the last one.
  [[nodiscard]] std::optional<BodyPrediction> at(ProbeTime when) const;

 private:
  struct State {
    ProbeTime at;
    BodyPrediction seen;
    Vec3d speed, turn;  ///< m/s, rad/s.
    double speed_variance = 0, turn_variance = 0;
  };
  [[nodiscard]] State start(ProbeTime at, const UncertainPose& noise, bool attitude_known) const;

  MotionOptions options_;
  std::optional<State> last_;
};

}  // namespace lightwell
