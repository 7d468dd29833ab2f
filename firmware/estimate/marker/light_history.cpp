#include "estimate/marker/light_history.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Core>
#include <Eigen/LU>

namespace lightwell::marker {
namespace {

/// Frames nearer in time count as one: their errors are the same.
constexpr double kFrameStep_s = 0.08;
constexpr std::size_t kMaxFrames = 16;
/// Squared Mahalanobis distance beyond which two lights are different ones: the 99.73 % quantile of chi square with two
/// degrees of freedom.
constexpr double kMaxSquaredMahalanobis = 11.83;
/// Added to each frame's variance before it is weighted, rad²: directions of path-traced sequences scatter by 1 to 2
/// degrees even where a frame states less.
constexpr double kScatterVariance = 4e-4;

Eigen::Matrix2d matrix(const std::array<double, 3>& c) {
  Eigen::Matrix2d out;
  out << c[0], c[1], c[1], c[2];
  return out;
}

/// Rotation from coordinates in tangent_basis(from) to tangent_basis(to), exact for small angles between the two.
Eigen::Matrix2d transport(Vec3d from, Vec3d to) {
  const auto [u, v] = tangent_basis(from);
  const auto [s, t] = tangent_basis(to);
  Eigen::Matrix2d out;
  out << dot(s, u), dot(s, v), dot(t, u), dot(t, v);
  return out;
}

std::array<double, 3> transported(const std::array<double, 3>& c, const Eigen::Matrix2d& by) {
  const Eigen::Matrix2d out = by * matrix(c) * by.transpose();
  return {out(0, 0), out(0, 1), out(1, 1)};
}

/// Coordinates of a rotated tangent basis: from tangent_basis(d) to tangent_basis(R d).
Eigen::Matrix2d turn_of_basis(Vec3d direction, Quat turn) {
  const auto [u, v] = tangent_basis(direction);
  const auto [s, t] = tangent_basis(rotate(turn, direction));
  const Vec3d a = rotate(turn, u), b = rotate(turn, v);
  Eigen::Matrix2d out;
  out << dot(s, a), dot(s, b), dot(t, a), dot(t, b);
  return out;
}

/// The vector from `from` to `to` along the great circle, in tangent_basis(from), rad.
Eigen::Vector2d offset(Vec3d from, Vec3d to) {
  const auto [u, v] = tangent_basis(from);
  const double angle = angle_between(from, to), x = dot(to, u), y = dot(to, v), across = std::hypot(x, y);
  if (!(across > 0)) return {0, 0};
  return {x / across * angle, y / across * angle};
}

}  // namespace

LightingEstimate turned(LightingEstimate estimate, Quat turn) {
  const auto turn_slope = [&](std::array<Rgb, 4>& of) {
    for (std::size_t c = 0; c < 3; ++c) {
      const Vec3d slope = rotate(turn, Vec3d{of[1][c], of[2][c], of[3][c]});
      of[1][c] = slope.x, of[2][c] = slope.y, of[3][c] = slope.z;
    }
  };
  turn_slope(estimate.ambient);
  turn_slope(estimate.ground);
  for (LightEstimate& one : estimate.lights) {
    const Eigen::Matrix2d basis = turn_of_basis(one.light.direction, turn);
    one.direction_covariance = transported(one.direction_covariance, basis);
    one.light.direction = rotate(turn, one.light.direction);
  }
  for (SurfaceSample& s : estimate.inliers) s.position = rotate(turn, s.position), s.normal = rotate(turn, s.normal);
  return estimate;
}

void LightHistory::average(ProbeTime time, Quat probe_body, LightingEstimate& estimate) {
  const Quat to_body = probe_body.inverse();
  Frame now{time, {}};
  for (const LightEstimate& one : estimate.lights)
    now.lights.push_back({rotate(to_body, one.light.direction),
                          transported(one.direction_covariance, turn_of_basis(one.light.direction, to_body))});
  for (std::size_t k = 0; k < now.lights.size(); ++k) {
    const Light& light = now.lights[k];
    Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
    Eigen::Vector2d weighted = Eigen::Vector2d::Zero();
    double count = 0;
    const Eigen::Matrix2d scatter = kScatterVariance * Eigen::Matrix2d::Identity(),
                          own = matrix(light.covariance) + scatter;
    const auto add = [&](const Light& other) {
      const Eigen::Matrix2d basis = transport(other.direction, light.direction);
      const Eigen::Matrix2d covariance = basis * matrix(other.covariance) * basis.transpose() + scatter;
      if (!covariance.allFinite()) return;
      const Eigen::Vector2d off = offset(light.direction, other.direction);
      if (&other != &light && off.dot((covariance + own).inverse() * off) > kMaxSquaredMahalanobis) return;
      const Eigen::Matrix2d weight = covariance.inverse();
      information += weight, weighted += weight * off, count += 1;
    };
    add(light);
    for (const Frame& frame : frames_) {
      const Light* nearest = nullptr;
      for (const Light& other : frame.lights)
        if (nearest == nullptr ||
            angle_between(light.direction, other.direction) < angle_between(light.direction, nearest->direction))
          nearest = &other;
      if (nearest != nullptr) add(*nearest);
    }
    if (!own.allFinite()) continue;
    const Eigen::Matrix2d inverse = information.inverse();
    const Eigen::Vector2d mean = inverse * weighted;
    // Most of the errors are the same in all frames (the model of light, paper and table): the mean of the covariances,
    // not that of independent frames.
    const Eigen::Matrix2d covariance = inverse * count - scatter;
    const auto [u, v] = tangent_basis(light.direction);
    const double angle = mean.norm(), scale = angle > 0 ? std::sin(angle) / angle : 1;
    const Vec3d moved = normalized(light.direction * std::cos(angle) + (u * mean[0] + v * mean[1]) * scale);
    const Eigen::Matrix2d there = transport(light.direction, moved);
    LightEstimate& out = estimate.lights[k];
    out.light.direction = rotate(probe_body, moved);
    const Eigen::Matrix2d in_body = there * covariance * there.transpose();
    out.direction_covariance =
        transported({in_body(0, 0), in_body(0, 1), in_body(1, 1)}, turn_of_basis(moved, probe_body));
  }
  if (frames_.size() > 1 && (time - frames_[frames_.size() - 2].time).seconds() < kFrameStep_s) frames_.pop_back();
  frames_.push_back(std::move(now));
  if (frames_.size() > kMaxFrames) frames_.pop_front();
}

}  // namespace lightwell::marker
