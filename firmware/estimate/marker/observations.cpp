#include "estimate/marker/observations.hpp"

#include <algorithm>
#include <cmath>

#include <lightwell/quantile.hpp>

namespace lightwell::marker {
namespace {

/// Quantiles of the ground samples' radiance that stand for shadow and light.
constexpr double kDarkQuantile = 0.05, kBrightQuantile = 0.95;
/// Smallest ratio of shadow to light; less is noise.
constexpr double kMinShadowRatio = 0.01;

/// Ratio of the ground plane's radiance in the light to that in the shadow, at least 1.
double shadow_contrast(const std::optional<GroundPlane>& ground) {
  if (!ground || ground->samples.size() < 20) return 1;
  std::vector<double> radiances;
  for (const GroundSample& t : ground->samples) radiances.push_back(t.radiance);
  // Ranks relative to n - 1.
  const auto last = static_cast<double>(radiances.size() - 1);
  const double bright = order_statistic(radiances, static_cast<std::size_t>(kBrightQuantile * last)),
               dark = order_statistic(radiances, static_cast<std::size_t>(kDarkQuantile * last));
  return bright > 0 ? std::max(1.0, bright / std::max(dark, kMinShadowRatio * bright)) : 1;
}

/// Smallest elevation of the light above a point of the body, relative to the distance. Below it, the point's shadow is
/// at infinity or does not exist; the limit moves it far outside of all samples.
constexpr double kMinElevation = 0.01;

/// Coordinate of each ground sample along an axis of the plane, m.
Eigen::ArrayXd coordinates(const GroundPlane& ground, Vec3d axis) {
  Eigen::ArrayXd out(static_cast<Eigen::Index>(ground.samples.size()));
  for (Eigen::Index i = 0; i < out.size(); ++i)
    out[i] = dot(ground.samples[static_cast<std::size_t>(i)].position - ground.point, axis);
  return out;
}

/// Factor of a shared error in the inverse square root of a covariance (observations.hpp): `squared` is t't.
double shrinkage_of(double squared) { return squared > 0 ? (1 - 1 / std::sqrt(1 + squared)) / squared : 0; }

/// Change of the irradiances by one standard deviation of the vignetting, relative to the middle of the samples: what
/// all have in common is a part of the scale.
Eigen::VectorXd vignetting_effect(const std::vector<SurfaceSample>& samples, std::size_t channel, double sigma) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(samples.size()));
  double middle = 0;
  for (const SurfaceSample& s : samples) middle += s.squared_angle / static_cast<double>(samples.size());
  for (Eigen::Index i = 0; i < out.size(); ++i) {
    const SurfaceSample& s = samples[static_cast<std::size_t>(i)];
    out[i] = sigma * (s.squared_angle - middle) * s.irradiance[channel];
  }
  return out;
}

}  // namespace

Observations::Observations(const Shading& shading, const std::optional<GroundTexture>& known_texture,
                           double face_dispersion)
    : channels_(shading.channels), samples_(shading.samples) {
  if (shading.ground && !shading.ground->samples.empty()) ground_.emplace(*shading.ground, known_texture);
  std::ranges::stable_sort(samples_, {}, &SurfaceSample::surface);
  for (int i = 0; i < samples(); ++i) {
    if (i == 0 || samples_[static_cast<std::size_t>(i)].surface != samples_[static_cast<std::size_t>(i - 1)].surface)
      surfaces_.push_back({i, i});
    surfaces_.back().end = i + 1;
  }
  const int n = samples();
  const double contrast = shadow_contrast(shading.ground), inflation = std::sqrt(face_dispersion);
  for (int c = 0; c < channels_; ++c) {
    const auto channel = static_cast<std::size_t>(c);
    Channel& out = by_channel_[channel];
    std::vector<double> means;
    double sum = 0;
    for (const Surface& s : surfaces_) {
      double of_surface = 0;
      for (int i = s.begin; i < s.end; ++i) of_surface += samples_[static_cast<std::size_t>(i)].irradiance[channel];
      sum += of_surface;
      means.push_back(of_surface / (s.end - s.begin));
      out.max_irradiance = std::max(out.max_irradiance, means.back());
    }
    out.mean_irradiance = n > 0 ? sum / n : 0;
    if (!means.empty())
      out.max_irradiance = std::max(out.max_irradiance, contrast * *std::min_element(means.begin(), means.end()));
    const double floor = kSurfaceSigmaFloor * out.max_irradiance;
    out.root_weight.resize(n);
    out.shared_whitened.resize(n);
    out.whitened.resize(n);
    for (std::size_t k = 0; k < surfaces_.size(); ++k) {
      const Surface& s = surfaces_[k];
      const double shared = inflation * std::hypot(kSurfaceRelativeSigma * means[k], floor);
      double squared = 0;
      for (int i = s.begin; i < s.end; ++i) {
        const SurfaceSample& sample = samples_[static_cast<std::size_t>(i)];
        const double alone =
            inflation * std::hypot(sample.sigma[channel], kSampleRelativeSigma * sample.irradiance[channel],
                                   kSampleSigmaFloor * out.max_irradiance);
        // Avoids a division by zero.
        out.root_weight[i] = 1 / std::max(alone, 1e-6 * out.max_irradiance + 1e-300);
        out.shared_whitened[i] = shared * out.root_weight[i];
        squared += out.shared_whitened[i] * out.shared_whitened[i];
        out.whitened[i] = sample.irradiance[channel];
      }
      out.shared.push_back(shared);
      out.shrinkage.push_back(shrinkage_of(squared));
    }
    out.vignetting = vignetting_effect(samples_, channel, shading.vignetting_sigma);
    out.vignetting_whitened = out.vignetting;
    whiten_surfaces(out, out.vignetting_whitened);
    out.vignetting_shrinkage = shrinkage_of(out.vignetting_whitened.squaredNorm());
    whiten(c, out.whitened);
  }
}

void Observations::whiten(int channel, Eigen::Ref<Eigen::VectorXd> column) const {
  const Channel& c = of(channel);
  whiten_surfaces(c, column);
  if (c.vignetting_shrinkage > 0)
    column -= (c.vignetting_shrinkage * c.vignetting_whitened.dot(column)) * c.vignetting_whitened;
}

void Observations::whiten_surfaces(const Channel& c, Eigen::Ref<Eigen::VectorXd> column) const {
  column.array() *= c.root_weight.array();
  for (std::size_t k = 0; k < surfaces_.size(); ++k) {
    const Surface& s = surfaces_[k];
    const auto t = c.shared_whitened.segment(s.begin, s.end - s.begin);
    auto x = column.segment(s.begin, s.end - s.begin);
    x -= (c.shrinkage[k] * t.dot(x)) * t;
  }
}

double Observations::standardized_residual(int channel, int sample, double difference) const {
  const Channel& c = of(channel);
  std::size_t k = 0;
  while (k + 1 < surfaces_.size() && sample >= surfaces_[k].end) ++k;
  return difference / std::hypot(1 / c.root_weight[sample], c.shared[k], c.vignetting[sample]);
}

GroundGeometry::GroundGeometry(const GroundPlane& ground)
    : point(ground.point),
      normal(ground.normal),
      step_m(ground.step_m),
      density(ground.density),
      u(coordinates(ground, tangent_basis(ground.normal)[0])),
      v(coordinates(ground, tangent_basis(ground.normal)[1])) {
  const auto n = static_cast<Eigen::Index>(ground.samples.size());
  for (Eigen::ArrayXd* a : {&x, &y, &z, &open}) a->resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const GroundSample& t = ground.samples[static_cast<std::size_t>(i)];
    x[i] = t.position.x, y[i] = t.position.y, z[i] = t.position.z;
    open[i] = 1 - t.occluded;
  }
}

GroundObservations::GroundObservations(const GroundPlane& ground, const std::optional<GroundTexture>& known_texture)
    : GroundGeometry(ground), radiance(size()), neighbours(u, v), own_variance(size()), noise_variance(size()) {
  for (const GroundSample& t : ground.samples) mean_radiance += t.radiance / static_cast<double>(size());
  mean_radiance = std::max(mean_radiance, 1e-300);
  for (Eigen::Index i = 0; i < size(); ++i) {
    const GroundSample& t = ground.samples[static_cast<std::size_t>(i)];
    radiance[i] = t.radiance;
    // The body also reflects light onto the samples that it occludes. This is not modelled: it increases sigma.
    const double noise = t.sigma / mean_radiance,
                 reflection = kBodyReflectionRelativeSigma * t.occluded * t.radiance / mean_radiance;
    noise_variance[i] = noise * noise + reflection * reflection;
    own_variance[i] = noise_variance[i] + kShadowModelSigma * kShadowModelSigma * ground.density;
  }
  if (known_texture) texture = *known_texture;
  whitening = GroundWhitening(neighbours, own_variance, texture);
}

void GroundObservations::whiten(Eigen::Ref<Eigen::VectorXd> column) const {
  column /= mean_radiance;
  whitening.whiten(column);
}

Eigen::VectorXd GroundObservations::whitened(const Eigen::ArrayXd& radiances) const {
  Eigen::VectorXd out = radiances.matrix();
  whiten(out);
  return out;
}

GroundTexture GroundObservations::fit_texture(const Eigen::ArrayXd& residuals) const {
  return fit_ground_texture(neighbours, own_variance, step_m, residuals.matrix() / mean_radiance);
}

Eigen::ArrayXd GroundObservations::smooth_part(const Eigen::ArrayXd& residuals, const GroundTexture& of_texture) const {
  return GroundWhitening(neighbours, own_variance, of_texture).smooth_part(residuals.matrix());
}

double GroundObservations::marginal_deviance(const Eigen::ArrayXd& residuals) const {
  if (!likelihood) likelihood.emplace(neighbours, noise_variance, step_m);
  return likelihood->deviance(residuals.matrix() / mean_radiance);
}

double GroundObservations::deviance(const Eigen::ArrayXd& residuals, const GroundTexture& of_texture) const {
  const GroundWhitening with(neighbours, own_variance, of_texture);
  Eigen::VectorXd column = residuals.matrix() / mean_radiance;
  with.whiten(column);
  return column.squaredNorm() + with.log_determinant();
}

bool Shadow::compute_irradiance(const GroundGeometry& ground, std::span<const Vec3d> hull, Vec3d direction,
                                double inverse_distance, Eigen::ArrayXd& out) {
  out.setZero(ground.size());
  const auto [u, v] = tangent_basis(ground.normal);
  const double elevation = dot(direction, ground.normal);
  // All samples lie in one plane, so that the light's height above it is the same for all.
  const double rise = elevation - dot(ground.point, ground.normal) * inverse_distance;
  if (!(rise > 0)) return false;
  outline_.clear();
  for (const Vec3d& p : hull) {
    // Vector from p to the light, times the inverse distance: finite for distant lights, too.
    const Vec3d to_light = direction - p * inverse_distance;
    const Vec3d on_ground =
        p - to_light * (dot(p - ground.point, ground.normal) / std::max(kMinElevation, dot(to_light, ground.normal))) -
        ground.point;
    outline_.add(dot(on_ground, u), dot(on_ground, v));
  }
  if (!outline_.close()) return false;
  outline_.signed_distance(ground.u, ground.v, visibility_);
  const double width = 1.2 * ground.step_m + 0.05 * ground.height();
  visibility_ = (visibility_ / width + 0.5).max(0.0).min(1.0);
  visibility_ = visibility_ * visibility_ * (3 - 2 * visibility_);
  const Vec3d& d = direction;
  const double w = inverse_distance;
  squared_ = (d.x - ground.x * w).square() + (d.y - ground.y * w).square() + (d.z - ground.z * w).square();
  out = visibility_ * rise / (squared_ * squared_.sqrt());
  return true;
}

}  // namespace lightwell::marker
