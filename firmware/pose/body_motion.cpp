#include "pose/body_motion.hpp"

#include <array>
#include <cmath>
#include <string>
#include <utility>

namespace lightwell {

namespace {

/// Mean variance of three of the six pose parameters, from index `first` on.
double mean_variance(const PoseCovariance& c, std::size_t first) {
  return (c[first][first] + c[first + 1][first + 1] + c[first + 2][first + 2]) / 3;
}

/// The rotation vector (axis times angle, rad) of a * b^-1, in the frame that both rotations map into.
Vec3d turn_between(Quat a, Quat b) {
  Quat q = a * b.inverse();
  if (q.w < 0) q = {-q.x, -q.y, -q.z, -q.w};
  const Vec3d v{q.x, q.y, q.z};
  const double sine = length(v);
  return sine > 1e-12 ? v * (2 * std::atan2(sine, q.w) / sine) : v * 2.0;
}

/// `q` followed by the rotation vector `by`, rad.
Quat turned(Vec3d by, Quat q) {
  const double angle = length(by);
  return angle > 0 ? (Quat::about(normalized(by), angle) * q).normalized() : q;
}

/// Kalman prediction over `seconds` and update of one velocity; `measured` is a pose difference divided by `seconds`.
void apply_measurement(Vec3d& velocity, double& variance, Vec3d measured, double measured_variance, double acceleration,
                       double seconds) {
  variance += acceleration * acceleration * seconds * seconds;
  const double gain = variance / (variance + measured_variance);
  velocity += (measured - velocity) * gain;
  variance *= 1 - gain;
}

}  // namespace

Status MotionOptions::validate() const {
  for (const auto& [name, value] : {std::pair("initial_speed_sigma_m_per_s", initial_speed_sigma_m_per_s),
                                    std::pair("initial_turn_sigma_rad_per_s", initial_turn_sigma_rad_per_s),
                                    std::pair("acceleration_sigma_m_per_s2", acceleration_sigma_m_per_s2),
                                    std::pair("acceleration_sigma_rad_per_s2", acceleration_sigma_rad_per_s2)})
    if (!(value > 0 && value <= 1e4))
      return {StatusCode::invalid_argument,
              std::string("motion: ") + name + " is " + std::to_string(value) + "; it must be above 0, to 10,000"};
  return {};
}

BodyMotion::State BodyMotion::start(ProbeTime time, const UncertainPose& observation, bool attitude_known) const {
  return {time,
          {observation, attitude_known},
          {},
          {},
          options_.initial_speed_sigma_m_per_s * options_.initial_speed_sigma_m_per_s,
          options_.initial_turn_sigma_rad_per_s * options_.initial_turn_sigma_rad_per_s};
}

void BodyMotion::update(ProbeTime time, const UncertainPose& observation, bool attitude_known) {
  if (!last_ || time < last_->time) {
    last_ = start(time, observation, attitude_known);
    return;
  }
  const PoseCovariance &now = observation.covariance, &before = last_->observed.probe_body.covariance;
  const double seconds = (time - last_->time).seconds();
  if (!(seconds > 0)) {
    if (mean_variance(now, 0) < mean_variance(before, 0)) last_->observed = {observation, attitude_known};
    return;
  }
  State next = start(time, observation, attitude_known);
  next.speed = last_->speed;
  next.speed_variance = last_->speed_variance;
  const Pose &here = observation.pose, &there = last_->observed.probe_body.pose;
  const double per = 1 / seconds;
  apply_measurement(next.speed, next.speed_variance, (here.translation - there.translation) * per,
                    (mean_variance(now, 3) + mean_variance(before, 3)) * per * per,
                    options_.acceleration_sigma_m_per_s2, seconds);
  // A rotation from or to an ambiguous attitude is no measurement of the angular velocity.
  if (attitude_known && last_->observed.attitude_known) {
    next.turn = last_->turn;
    next.turn_variance = last_->turn_variance;
    apply_measurement(next.turn, next.turn_variance, turn_between(here.rotation, there.rotation) * per,
                      (mean_variance(now, 0) + mean_variance(before, 0)) * per * per,
                      options_.acceleration_sigma_rad_per_s2, seconds);
  }
  last_ = next;
}

std::optional<BodyPrediction> BodyMotion::predict(ProbeTime time) const {
  if (!last_ || time < last_->time) return std::nullopt;
  const double t = (time - last_->time).seconds();
  BodyPrediction out = last_->observed;
  out.probe_body.pose.translation += last_->speed * t;
  out.probe_body.pose.rotation = turned(last_->turn * t, out.probe_body.pose.rotation);
  // Variance from the velocity, and from an acceleration that began with the last frame.
  const auto grown = [&](double variance, double acceleration) {
    const double more = acceleration * t * t;
    return variance * t * t + more * more;
  };
  const double rotation = grown(last_->turn_variance, options_.acceleration_sigma_rad_per_s2),
               translation = grown(last_->speed_variance, options_.acceleration_sigma_m_per_s2);
  for (std::size_t i = 0; i < 3; ++i) {
    out.probe_body.covariance[i][i] += rotation;
    out.probe_body.covariance[i + 3][i + 3] += translation;
  }
  return out;
}

}  // namespace lightwell
