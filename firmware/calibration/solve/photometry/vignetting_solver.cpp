#include "calibration/solve/photometry/vignetting_solver.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <Eigen/Core>
#include <Eigen/QR>

#include <lightwell/quantile.hpp>
#include <lightwell/text.hpp>

#include "calibration/solve/photometry/robust.hpp"

namespace lightwell::photometry {
namespace {

constexpr std::size_t kMinObservations = 8;
constexpr double kMinVignetting = 0.05;  // Lower limit in a calibration.

Status invalid(const std::string& what) { return {StatusCode::invalid_argument, "vignetting: " + what}; }

std::string degrees(double rad) { return formatted("%.1f", rad * 180 / std::numbers::pi); }

Status check_sightings(std::span<const LampObservation> observations, double max_angle_rad) {
  if (!(max_angle_rad > 0 && max_angle_rad <= std::numbers::pi))
    return invalid("half the field of view must be above 0 and at most 180 deg");
  if (observations.size() < kMinObservations)
    return invalid(std::to_string(observations.size()) + " observations of the lamp, at least " +
                   std::to_string(kMinObservations) + " are needed; turn the camera in smaller steps");
  std::vector<double> angles;
  for (const LampObservation& s : observations) {
    if (!(s.angle_rad >= 0 && s.angle_rad <= 1.001 * max_angle_rad))
      return invalid("an angle of " + degrees(s.angle_rad) + " deg lies outside the field of " +
                     degrees(max_angle_rad) + " deg to either side");
    if (!(s.value > 0) || !std::isfinite(s.value) || !(s.deviation >= 0) || !std::isfinite(s.deviation))
      return invalid("the lamp's value at " + degrees(s.angle_rad) + " deg is not positive; remove that picture");
    angles.push_back(s.angle_rad);
  }
  std::sort(angles.begin(), angles.end());
  const std::string asked = "rotate the camera so that the lamp moves from the middle of the picture to its edge";
  if (angles.front() > 0.25 * max_angle_rad)
    return invalid("no observation is nearer to the axis than " + degrees(angles.front()) + " deg; " + asked);
  if (angles.back() < 0.9 * max_angle_rad)
    return invalid("no observation is further from the axis than " + degrees(angles.back()) + " deg of " +
                   degrees(max_angle_rad) + "; " + asked + ", or lower max_angle_deg");
  for (std::size_t i = 1; i < angles.size(); ++i)
    if (angles[i] - angles[i - 1] > max_angle_rad / 3)
      return invalid("nothing between " + degrees(angles[i - 1]) + " and " + degrees(angles[i]) +
                     " deg; turn the camera in smaller steps");
  return {};
}

Eigen::RowVector4d powers(double share) {
  const double t = share * share;
  return {1, t, t * t, t * t * t};
}

}  // namespace

Result<VignettingEstimate> solve_vignetting(std::span<const LampObservation> observations, double max_angle_rad) {
  if (const Status s = check_sightings(observations, max_angle_rad); !s.ok()) return s;
  const auto n = static_cast<Eigen::Index>(observations.size());
  // Normalise angles by the field and values by their median, so that the columns have similar magnitude.
  std::vector<double> values;
  for (const LampObservation& s : observations) values.push_back(s.value);
  const double unit = median(values);
  const bool all_known =
      std::all_of(observations.begin(), observations.end(), [](const auto& s) { return s.deviation > 0; });
  Eigen::MatrixXd rows(n, 4);
  Eigen::VectorXd right(n), deviation(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const LampObservation& s = observations[static_cast<std::size_t>(k)];
    rows.row(k) = powers(s.angle_rad / max_angle_rad);
    right(k) = s.value / unit;
    deviation(k) = (all_known ? s.deviation : s.value) / unit;
  }

  Eigen::Vector4d found = Eigen::Vector4d::Zero();
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(n);
  std::vector<double> scaled(observations.size());
  double scale = 1;
  for (int pass = 0; pass < 60; ++pass) {
    const Eigen::VectorXd root = weight.cwiseSqrt().cwiseQuotient(deviation);
    const Eigen::Vector4d before = found;
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solver(root.asDiagonal() * rows);
    if (solver.rank() < 4) return invalid("too few different angles; turn the camera in more and even steps");
    found = solver.solve(root.cwiseProduct(right));
    for (Eigen::Index k = 0; k < n; ++k)
      scaled[static_cast<std::size_t>(k)] = (right(k) - rows.row(k).dot(found)) / deviation(k);
    // Corrected for four estimated parameters; limited from below, because exact data have a scale of 0.
    scale = std::max(1e-9, scale_about_zero(scaled) *
                               std::sqrt(static_cast<double>(n) / std::max<double>(1, static_cast<double>(n - 4))));
    if (all_known) scale = std::max(scale, 1.0);
    for (Eigen::Index k = 0; k < n; ++k) {
      // First a smoothed L1 loss, which has a unique minimum, then Tukey's biweight, which rejects outliers.
      const double u = scaled[static_cast<std::size_t>(k)] / scale;
      weight(k) = pass < 10 ? 1 / std::max(1.0, std::abs(u)) : tukey_weight(u);
      // Unknown standard deviations are proportional to the curve, not to the observation, whose error would affect its
      // own weight.
      if (!all_known) deviation(k) = std::max(rows.row(k).dot(found), 1e-3);
    }
    if (pass > 12 && (found - before).cwiseAbs().maxCoeff() < 1e-13 * found.cwiseAbs().maxCoeff()) break;
  }
  if (!(found(0) > 0)) return invalid("the estimated light on the axis is not positive; check the list of angles");

  VignettingEstimate out;
  double slope = 0, squares = 0;
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  std::vector<double> shares;
  for (Eigen::Index k = 0; k < n; ++k) {
    const double u = scaled[static_cast<std::size_t>(k)] / scale, w = tukey_weight(u);
    slope += tukey_slope(u) / static_cast<double>(n);
    squares += w * w * u * u;
    normal += rows.row(k).transpose() * rows.row(k) / (deviation(k) * deviation(k));
    out.weight.push_back(w);
    out.outliers += w > 0 ? 0 : 1;
    shares.push_back(scaled[static_cast<std::size_t>(k)] * deviation(k) / std::max(rows.row(k).dot(found), 1e-3));
  }
  // Variance of an M-estimator: Huber 1981, eq. 7.6.6.
  const double variance = scale * scale * squares / static_cast<double>(n - 4) / (slope * slope);
  const Eigen::Matrix4d covariance = variance * normal.completeOrthogonalDecomposition().pseudoInverse();
  out.residual = scale_about_zero(shares);
  out.level = found(0) * unit;
  out.level_deviation = std::sqrt(covariance(0, 0)) * unit;
  Eigen::Matrix<double, 3, 4> jacobian = Eigen::Matrix<double, 3, 4>::Zero();
  for (int i = 0; i < 3; ++i) {
    const double angle = std::pow(max_angle_rad, -2.0 * (i + 1));
    out.vignetting[static_cast<std::size_t>(i)] = found(i + 1) / found(0) * angle;
    jacobian(i, 0) = -found(i + 1) / (found(0) * found(0)) * angle;
    jacobian(i, i + 1) = angle / found(0);
  }
  const Eigen::Matrix3d of_curve = jacobian * covariance * jacobian.transpose();
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) out.covariance[static_cast<std::size_t>(3 * i + k)] = of_curve(i, k);

  for (int i = 0; i <= 128; ++i) {
    const double left = powers(i / 128.0).dot(found) / found(0);
    if (!(left >= kMinVignetting))
      return invalid("the relative illumination is " + std::to_string(left) + " at " +
                     degrees(max_angle_rad * i / 128.0) +
                     " deg, at least 0.05 is needed; lower max_angle_deg to where the lens still sees");
  }
  return out;
}

double vignetting_deviation(const VignettingEstimate& estimate, double angle_rad) {
  const double t = angle_rad * angle_rad;
  const std::array<double, 3> by{t, t * t, t * t * t};
  double variance = 0;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) variance += by[i] * estimate.covariance[3 * i + k] * by[k];
  return std::sqrt(std::max(0.0, variance));
}

}  // namespace lightwell::photometry
