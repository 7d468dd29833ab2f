#include "estimate/marker/ground_light.hpp"

#include <algorithm>
#include <numbers>
#include <vector>

#include <Eigen/Core>

#include "estimate/marker/observations.hpp"

namespace lightwell::marker {
namespace {

/// Directions over the sphere by which the variation of the plane's radiance is integrated.
constexpr int kDirections = 1000;
constexpr double kSteradian = 4 * std::numbers::pi / kDirections;  // per direction
/// Largest radiance of hidden parts of the plane, relative to the brightest sample.
constexpr double kMaxExtrapolation = 1.5;
/// Sweeps of the coordinate descent; few columns are nearly orthogonal or nearly equal, and both converge fast.
constexpr int kSweeps = 200;

/// Nonnegative least squares by cyclic coordinate descent: minimizes |a x - b|².
Eigen::VectorXd nonnegative_least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b) {
  const Eigen::MatrixXd gram = a.transpose() * a;
  const Eigen::VectorXd along = a.transpose() * b;
  Eigen::VectorXd x = Eigen::VectorXd::Zero(a.cols());
  for (int sweep = 0; sweep < kSweeps; ++sweep)
    for (Eigen::Index i = 0; i < x.size(); ++i)
      if (gram(i, i) > 0) x[i] = std::max(0.0, x[i] + (along[i] - gram.row(i).dot(x)) / gram(i, i));
  return x;
}

}  // namespace

std::array<Rgb, 4> unoccluded_ground_irradiance(const Shading& shading, std::span<const PointLight> lights) {
  std::array<Rgb, 4> out{};
  if (!shading.ground || shading.ground->samples.empty()) return out;
  const GroundPlane& plane = *shading.ground;
  const GroundGeometry ground(plane);
  const Vec3d foot = ground.normal * -ground.height();
  Eigen::MatrixXd columns(ground.size(), 1 + static_cast<Eigen::Index>(lights.size()));
  columns.col(0) = ground.open;
  Shadow shadow;
  Eigen::ArrayXd irradiance;
  for (std::size_t k = 0; k < lights.size(); ++k) {
    shadow.compute_irradiance(ground, shading.hull, lights[k].direction, lights[k].inverse_distance, irradiance);
    columns.col(1 + static_cast<Eigen::Index>(k)) = irradiance;
  }
  std::array<Eigen::VectorXd, 3> coefficients;
  Rgb most{};
  double reach = 0;
  for (const GroundSample& s : plane.samples) {
    reach = std::max(reach, length(s.position - foot));
    for (std::size_t c = 0; c < 3; ++c) most[c] = std::max(most[c], kMaxExtrapolation * s.color[c] * s.table_ratio);
  }
  for (std::size_t c = 0; c < 3; ++c) {
    Eigen::VectorXd color(ground.size());
    for (Eigen::Index i = 0; i < color.size(); ++i) {
      const GroundSample& s = plane.samples[static_cast<std::size_t>(i)];
      color[i] = s.color[c] * s.table_ratio;
    }
    coefficients[c] = nonnegative_least_squares(columns, color);
  }
  const auto radiance_at = [&](Vec3d position) {
    Rgb radiance{};
    for (std::size_t c = 0; c < 3; ++c) {
      radiance[c] = coefficients[c][0];
      for (std::size_t k = 0; k < lights.size(); ++k)
        radiance[c] += coefficients[c][1 + static_cast<Eigen::Index>(k)] *
                       relative_irradiance(lights[k].direction, lights[k].inverse_distance, position, ground.normal);
      radiance[c] = std::min(radiance[c], most[c]);
    }
    return radiance;
  };
  const auto add = [&](double constant, Vec3d slope, const Rgb& radiance) {
    for (std::size_t c = 0; c < 3; ++c) {
      out[0][c] += constant * radiance[c];
      out[1][c] += slope.x * radiance[c], out[2][c] += slope.y * radiance[c], out[3][c] += slope.z * radiance[c];
    }
  };
  // A half space of uniform radiance L gives the irradiance pi L (1 - cos) / 2: bands 0 and 1 alone. Of the rest,
  // bands 0 and 1 are kept: a radiance L(d) gives the integrals of L / 4 and of L d / 2 (Ramamoorthi & Hanrahan 2001,
  // eq. 7).
  const Rgb below = radiance_at(foot);
  add(std::numbers::pi / 2, ground.normal * (-std::numbers::pi / 2), below);
  if (std::ranges::none_of(lights, [](const PointLight& light) { return light.inverse_distance > 0; })) return out;
  static const std::vector<Vec3d> directions = fibonacci_directions(kDirections);
  for (const Vec3d& direction : directions) {
    const double down = -dot(direction, ground.normal);
    if (!(down > 0)) continue;
    const Vec3d from_foot = direction * (ground.height() / down) - foot;
    const double distance = length(from_foot);
    Rgb rest = radiance_at(foot + from_foot * (distance > reach ? reach / distance : 1));
    for (std::size_t c = 0; c < 3; ++c) rest[c] -= below[c];
    add(kSteradian / 4, direction * (kSteradian / 2), rest);
  }
  return out;
}

}  // namespace lightwell::marker
