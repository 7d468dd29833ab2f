#include "field/intensity.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Dense>

#include "field/views.hpp"

namespace lightwell::field {
namespace {

/// Standard deviations of mean and gradient, relative to the observed mean: hardly a prior on either for what is
/// allowed, nearly zero for what is not.
struct ShapePrior {
  double mean, gradient;
  Vec3d facing{};  ///< Unit: the gradient is along it. Zero: any direction.
  double log_odds = 0;
};
constexpr double kFree = 1.5, kNone = 0.02;
/// One observation alone raises the evidence of a shape with a direction by up to 0.13 over that of a ball.
constexpr double kFacingLogOdds = -0.2;
/// A ball, three that are brighter on one side, a flat Lambertian emitter, and one that faces down, as lamps do.
constexpr std::array kShapes = {ShapePrior{kFree, kNone}, ShapePrior{kFree, 0.1},
                                ShapePrior{kFree, 0.3},   ShapePrior{kFree, 1},
                                ShapePrior{kNone, kFree}, ShapePrior{kNone, kFree, {0, -1, 0}, kFacingLogOdds}};
/// A light in the surface of the geometry shines from that surface, unless the observations say otherwise.
constexpr double kSurfaceLogOdds = 5;

/// Of (mean, gradient).
Eigen::Matrix4d covariance_of(const ShapePrior& shape) {
  Eigen::Matrix4d out = Eigen::Matrix4d::Zero();
  out(0, 0) = shape.mean * shape.mean;
  const Eigen::Vector3d n{shape.facing.x, shape.facing.y, shape.facing.z};
  const double along = shape.gradient * shape.gradient, across = n.isZero() ? along : kNone * kNone;
  out.bottomRightCorner<3, 3>() = across * Eigen::Matrix3d::Identity() + (along - across) * n * n.transpose();
  return out;
}

Eigen::Vector4d features(Vec3d w) { return {1, w.x, w.y, w.z}; }

/// Regression under one prior, of (mean, gradient) relative to the scale.
struct Posterior {
  Eigen::Matrix<double, 4, 3> color;
  Eigen::Vector4d luminance;
  Eigen::Matrix4d covariance;
  double log_evidence = 0;  ///< Of the observations, up to a constant (MacKay 1992, "Bayesian Interpolation").
};

Posterior regress(std::span<const IntensityObservation> observations, double scale, const ShapePrior& shape) {
  Posterior out;
  const Eigen::Matrix4d prior = covariance_of(shape);
  Eigen::Matrix4d information = prior.inverse();
  Eigen::Matrix<double, 4, 3> right = Eigen::Matrix<double, 4, 3>::Zero();
  Eigen::Vector4d right_luminance = Eigen::Vector4d::Zero();
  double square = 0;
  for (const IntensityObservation& o : observations) {
    const Eigen::Vector4d f = features(o.from_light);
    const double w = 1 / std::max(o.relative_sigma * o.relative_sigma, 1e-6), y = luminance_of(o.intensity) / scale;
    information += w * f * f.transpose();
    right += w * f * Eigen::RowVector3d(o.intensity.r, o.intensity.g, o.intensity.b) / scale;
    right_luminance += w * f * y;
    square += w * y * y;
  }
  out.covariance = information.inverse();
  out.color = out.covariance * right;
  out.luminance = out.covariance * right_luminance;
  out.log_evidence =
      shape.log_odds +
      (std::log(out.covariance.determinant() / prior.determinant()) - square + right_luminance.dot(out.luminance)) / 2;
  double misfit = 0;
  for (const IntensityObservation& o : observations) {
    const double r = luminance_of(o.intensity) / scale - features(o.from_light).dot(out.luminance);
    misfit += r * r / std::max(o.relative_sigma * o.relative_sigma, 1e-6);
  }
  out.covariance *= std::max(1.0, misfit / static_cast<double>(observations.size()));
  return out;
}

}  // namespace

Irradiance IntensityModel::towards(Vec3d w) const {
  Irradiance out = mean + gradient[0] * static_cast<float>(w.x) + gradient[1] * static_cast<float>(w.y) +
                   gradient[2] * static_cast<float>(w.z);
  for (int c = 0; c < 3; ++c) out[c] = std::max(out[c], 0.0F);
  return out;
}

double IntensityModel::sigma(Vec3d w) const {
  const std::array<double, 4> f{1, w.x, w.y, w.z};
  double sum = 0;
  for (std::size_t r = 0; r < 4; ++r)
    for (std::size_t k = 0; k < 4; ++k) sum += f[r] * covariance[4 * r + k] * f[k];
  return scale * std::sqrt(std::max(sum, 0.0));
}

IntensityModel fit_intensity(std::span<const IntensityObservation> observations, std::optional<Vec3d> surface_normal) {
  IntensityModel out;
  for (const IntensityObservation& o : observations)
    out.scale += luminance_of(o.intensity) / static_cast<double>(observations.size());
  if (!(out.scale > 0)) return out;
  std::vector<ShapePrior> shapes(kShapes.begin(), kShapes.end());
  if (surface_normal) shapes.push_back({kNone, kFree, *surface_normal, kSurfaceLogOdds});
  std::vector<Posterior> all;
  std::size_t best = 0;
  for (std::size_t k = 0; k < shapes.size(); ++k) {
    all.push_back(regress(observations, out.scale, shapes[k]));
    // Where they are equal, as of one observation, a ball.
    if (all[k].log_evidence > all[best].log_evidence + 1e-3) best = k;
  }
  // The covariance is that about the best, over all shapes that explain the observations.
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  double weights = 0;
  for (const Posterior& p : all) {
    const double w = std::exp(p.log_evidence - all[best].log_evidence);
    const Eigen::Vector4d difference = p.luminance - all[best].luminance;
    covariance += w * (p.covariance + difference * difference.transpose());
    weights += w;
  }
  covariance /= weights;
  const auto color = [&](Eigen::Index row) {
    const auto channel = [&](Eigen::Index c) { return static_cast<float>(all[best].color(row, c) * out.scale); };
    return Irradiance{channel(0), channel(1), channel(2)};
  };
  out.mean = color(0);
  for (std::size_t i = 0; i < 3; ++i) out.gradient[i] = color(static_cast<Eigen::Index>(i) + 1);
  for (Eigen::Index r = 0; r < 4; ++r)
    for (Eigen::Index k = 0; k < 4; ++k) out.covariance[static_cast<std::size_t>(4 * r + k)] = covariance(r, k);
  return out;
}

IntensityModel uniform_intensity(std::span<const IntensityObservation> observations) {
  IntensityModel out;
  double weights = 0, square = 0;
  Irradiance sum;
  for (const IntensityObservation& o : observations) {
    const double w = 1 / std::max(o.relative_sigma * o.relative_sigma, 1e-6);
    sum += o.intensity * static_cast<float>(w);
    weights += w;
  }
  if (!(weights > 0)) return out;
  out.mean = sum * static_cast<float>(1 / weights);
  out.scale = luminance_of(out.mean);
  if (!(out.scale > 0)) return out;
  for (const IntensityObservation& o : observations) {
    const double r = luminance_of(o.intensity) / out.scale - 1;
    square += r * r / static_cast<double>(observations.size());
  }
  out.covariance[0] = 1 / weights + square / static_cast<double>(std::max<std::size_t>(observations.size() - 1, 1));
  return out;
}

}  // namespace lightwell::field
