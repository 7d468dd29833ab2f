#include "estimate/marker/max_entropy_radiance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace lightwell::marker {
namespace {

/// Directions of the discretized sphere. Their spacing of 9 degrees is fine compared with the cosine lobe of a surface.
constexpr int kDirections = 500;
constexpr double kSteradian = 4 * std::numbers::pi / kDirections;  // per direction
/// Newton iterations (ten are common), and their final decrement: about the relative change of irradiances left.
constexpr int kMaxIterations = 100;
constexpr double kConvergence = 1e-9;
/// A peak lies within the first angle of its direction, its surroundings between the first and the second.
constexpr double kPeakRadius_rad = 0.35, kSurroundRadius_rad = 0.6;
/// Consecutive samples of one surface belong together above this cosine of the angle between their normals.
constexpr double kSameNormalCosine = 0.9999;

const std::vector<Vec3d>& directions() {
  static const std::vector<Vec3d> all = fibonacci_directions(kDirections);
  return all;
}

/// Normals and irradiances to be reproduced.
struct Surfaces {
  std::vector<Vec3d> normals;
  std::array<Eigen::VectorXd, 3> irradiance;
};

/// Averages the samples of a flat surface; each sample of a curved surface remains an observation of its own.
Surfaces surfaces_of(std::span<const SurfaceSample> samples) {
  struct Sum {
    Vec3d normal;
    int surface;
    Rgb irradiance{};
    int count = 0;
  };
  std::vector<Sum> sums;
  for (const SurfaceSample& s : samples) {
    const bool same =
        !sums.empty() && sums.back().surface == s.surface && dot(sums.back().normal, s.normal) > kSameNormalCosine;
    if (!same) sums.push_back({s.normal, s.surface});
    for (std::size_t c = 0; c < 3; ++c) sums.back().irradiance[c] += s.irradiance[c];
    ++sums.back().count;
  }
  Surfaces out;
  for (Eigen::VectorXd& of_channel : out.irradiance) of_channel.resize(static_cast<Eigen::Index>(sums.size()));
  for (std::size_t i = 0; i < sums.size(); ++i) {
    out.normals.push_back(sums[i].normal);
    for (std::size_t c = 0; c < 3; ++c)
      out.irradiance[c][static_cast<Eigen::Index>(i)] = sums[i].irradiance[c] / sums[i].count;
  }
  return out;
}

Eigen::MatrixXd cosines(const std::vector<Vec3d>& normals) {
  Eigen::MatrixXd out(static_cast<Eigen::Index>(normals.size()), kDirections);
  for (std::size_t i = 0; i < normals.size(); ++i)
    for (std::size_t k = 0; k < directions().size(); ++k)
      out(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) = std::max(0.0, dot(normals[i], directions()[k]));
  return out;
}

/// Radiance from each direction, in units of the mean irradiance: minimizes over mu, by Newton's method,
///   sum x(mu) dw - mu . e + |sigma mu|^2 / 2,   x = exp(cosines' mu) / pi.
/// The gradient is the irradiance by x, minus the observed irradiance e, plus sigma^2 mu.
Eigen::ArrayXd solve_max_entropy(const Eigen::MatrixXd& cosines, const Eigen::VectorXd& e) {
  const Eigen::ArrayXd variance =
      (kSurfaceRelativeSigma * e.array()).square() + std::pow(kSurfaceSigmaFloor * e.maxCoeff(), 2);
  const auto radiance = [&](const Eigen::VectorXd& mu) -> Eigen::ArrayXd {
    return (cosines.transpose() * mu).array().exp() / std::numbers::pi;
  };
  const auto value = [&](const Eigen::VectorXd& mu, const Eigen::ArrayXd& x) {
    return kSteradian * x.sum() - mu.dot(e) + 0.5 * (variance * mu.array().square()).sum();
  };
  Eigen::VectorXd mu = Eigen::VectorXd::Zero(e.size());
  Eigen::ArrayXd x = radiance(mu);
  double now = value(mu, x);
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const Eigen::VectorXd gradient = kSteradian * (cosines * x.matrix()) - e + (variance * mu.array()).matrix();
    Eigen::MatrixXd hessian = kSteradian * cosines * x.matrix().asDiagonal() * cosines.transpose();
    hessian.diagonal() += variance.matrix();
    const Eigen::VectorXd step_direction = hessian.ldlt().solve(-gradient);
    const double gain = -gradient.dot(step_direction);
    if (!(gain > kConvergence * kConvergence)) break;
    // Backtracking line search (Armijo): a full Newton step of an exponential may overshoot.
    double length = 1;
    for (; length > 1e-10; length /= 2) {
      const Eigen::VectorXd next = mu + length * step_direction;
      const Eigen::ArrayXd there = radiance(next);
      const double then = value(next, there);
      if (!(then <= now - 1e-4 * length * gain)) continue;
      mu = next;
      x = there;
      now = then;
      break;
    }
    if (!(length > 1e-10)) break;
  }
  return x;
}

/// Subtracts from x the radiance around `toward` that exceeds the mean of its surroundings; returns its irradiance.
double subtract_peak(Vec3d toward, Eigen::ArrayXd& x) {
  double surround = 0;
  int count = 0;
  std::vector<Eigen::Index> peak;
  for (std::size_t k = 0; k < directions().size(); ++k) {
    const double angle = angle_between(toward, directions()[k]);
    if (angle < kPeakRadius_rad)
      peak.push_back(static_cast<Eigen::Index>(k));
    else if (angle < kSurroundRadius_rad)
      surround += x[static_cast<Eigen::Index>(k)], ++count;
  }
  surround /= std::max(1, count);
  double out = 0;
  for (const Eigen::Index k : peak) {
    if (!(x[k] > surround)) continue;
    out += (x[k] - surround) * kSteradian;
    x[k] = surround;
  }
  return out;
}

}  // namespace

std::optional<MaxEntropyRadiance> max_entropy_radiance(std::span<const SurfaceSample> samples,
                                                       std::span<const Vec3d> toward, int band) {
  if (samples.empty()) return std::nullopt;
  const Surfaces surfaces = surfaces_of(samples);
  const Eigen::MatrixXd of_normals = cosines(surfaces.normals);
  MaxEntropyRadiance out;
  out.radiance.band = std::clamp(band, 0, kMaxBand);
  out.lights.resize(toward.size());
  std::array<Eigen::ArrayXd, 3> radiance;
  bool any = false;
  for (std::size_t c = 0; c < 3; ++c) {
    const double mean = surfaces.irradiance[c].mean();
    if (!(mean > 0) || !std::isfinite(mean)) {
      radiance[c].setZero(kDirections);
      continue;
    }
    any = true;
    radiance[c] = mean * solve_max_entropy(of_normals, surfaces.irradiance[c] / mean);
    for (std::size_t k = 0; k < toward.size(); ++k) out.lights[k][c] = subtract_peak(toward[k], radiance[c]);
  }
  if (!any) return std::nullopt;
  const auto count = static_cast<std::size_t>(out.radiance.count());
  std::array<std::array<double, sh_count(kMaxBand)>, 3> sums{};
  std::array<double, sh_count(kMaxBand)> basis{};
  for (std::size_t k = 0; k < directions().size(); ++k) {
    sh_basis(out.radiance.band, directions()[k], std::span(basis).first(count));
    for (std::size_t c = 0; c < 3; ++c) {
      const double flux = radiance[c][static_cast<Eigen::Index>(k)] * kSteradian;
      for (std::size_t i = 0; i < count; ++i) sums[c][i] += flux * basis[i];
    }
  }
  for (std::size_t i = 0; i < count; ++i)
    out.radiance.c[i] = {static_cast<float>(sums[0][i]), static_cast<float>(sums[1][i]),
                         static_cast<float>(sums[2][i])};
  return out;
}

}  // namespace lightwell::marker
