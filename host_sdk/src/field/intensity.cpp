#include "field/intensity.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "field/views.hpp"

namespace lightwell::field {
namespace {

/// Standard deviations of mean and gradient, relative to the observed mean: hardly a prior on either for what is
/// allowed, nearly zero for what is not.
struct ShapePrior {
  double mean, gradient;
};
/// A ball, three that are brighter on one side, and a flat Lambertian emitter.
constexpr std::array kShapes = {ShapePrior{1.5, 0.02}, ShapePrior{1.5, 0.1}, ShapePrior{1.5, 0.3}, ShapePrior{1.5, 1},
                                ShapePrior{0.02, 1.5}};

Eigen::Vector4d features(Vec3d w) { return {1, w.x, w.y, w.z}; }

/// The shape with the largest evidence of the observations (MacKay 1992, "Bayesian Interpolation"): a gradient that they
/// do not need is shrunk.
const ShapePrior& likely_shape(std::span<const IntensityObservation> observations, double scale) {
  const auto n = static_cast<Eigen::Index>(observations.size());
  const auto at = [&](Eigen::Index i) -> const IntensityObservation& {
    return observations[static_cast<std::size_t>(i)];
  };
  const ShapePrior* best = kShapes.data();
  double largest = 0;
  for (const ShapePrior& shape : kShapes) {
    Eigen::MatrixXd covariance(n, n);
    Eigen::VectorXd y(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      y(i) = luminance_of(at(i).intensity) / scale;
      for (Eigen::Index j = 0; j < n; ++j)
        covariance(i, j) =
            shape.mean * shape.mean + shape.gradient * shape.gradient * dot(at(i).from_light, at(j).from_light);
      covariance(i, i) += std::max(at(i).relative_sigma * at(i).relative_sigma, 1e-6);
    }
    const Eigen::LDLT<Eigen::MatrixXd> factor(covariance);
    const double evidence = -y.dot(factor.solve(y)) / 2 - factor.vectorD().array().max(1e-12).log().sum() / 2;
    // Where they are equal, as of one observation, a ball.
    if (&shape == kShapes.data() || evidence > largest + 1e-3) largest = evidence, best = &shape;
  }
  return *best;
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

IntensityModel fit_intensity(std::span<const IntensityObservation> observations) {
  IntensityModel out;
  for (const IntensityObservation& o : observations)
    out.scale += luminance_of(o.intensity) / static_cast<double>(observations.size());
  if (!(out.scale > 0)) return out;
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  const ShapePrior& shape = likely_shape(observations, out.scale);
  const double prior = 1 / (shape.gradient * shape.gradient);
  information.diagonal() << 1 / (shape.mean * shape.mean), prior, prior, prior;
  Eigen::Matrix<double, 4, 3> right = Eigen::Matrix<double, 4, 3>::Zero();
  Eigen::Vector4d right_luminance = Eigen::Vector4d::Zero();
  for (const IntensityObservation& o : observations) {
    const Eigen::Vector4d f = features(o.from_light);
    const double w = 1 / std::max(o.relative_sigma * o.relative_sigma, 1e-6);
    information += w * f * f.transpose();
    const Irradiance& e = o.intensity;
    right += w * f * Eigen::RowVector3d(e.r, e.g, e.b) / out.scale;
    right_luminance += w * f * luminance_of(e) / out.scale;
  }
  const Eigen::Matrix4d covariance = information.inverse();
  const Eigen::Matrix<double, 4, 3> solved = covariance * right;
  const Eigen::Vector4d luminance = covariance * right_luminance;
  double misfit = 0;
  for (const IntensityObservation& o : observations) {
    const double r = luminance_of(o.intensity) / out.scale - features(o.from_light).dot(luminance);
    misfit += r * r / (o.relative_sigma * o.relative_sigma);
  }
  const double inflation = std::max(1.0, misfit / static_cast<double>(observations.size()));
  const auto color = [&](Eigen::Index row) {
    return Irradiance{static_cast<float>(solved(row, 0) * out.scale), static_cast<float>(solved(row, 1) * out.scale),
                      static_cast<float>(solved(row, 2) * out.scale)};
  };
  out.mean = color(0);
  for (std::size_t i = 0; i < 3; ++i) out.gradient[i] = color(static_cast<Eigen::Index>(i) + 1);
  for (Eigen::Index r = 0; r < 4; ++r)
    for (Eigen::Index k = 0; k < 4; ++k)
      out.covariance[static_cast<std::size_t>(4 * r + k)] = inflation * covariance(r, k);
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
