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

}  // namespace

Observations::Observations(const Shading& shading, const ErrorModel& errors)
    : channels_(shading.channels), samples_(shading.samples) {
  if (shading.ground && !shading.ground->samples.empty()) ground_.emplace(*shading.ground, errors);
  std::stable_sort(samples_.begin(), samples_.end(),
                   [](const SurfaceSample& a, const SurfaceSample& b) { return a.surface < b.surface; });
  for (int i = 0; i < samples(); ++i) {
    if (i == 0 || samples_[static_cast<std::size_t>(i)].surface != samples_[static_cast<std::size_t>(i - 1)].surface)
      surfaces_.push_back({i, i});
    surfaces_.back().end = i + 1;
  }
  const int n = samples();
  const double contrast = shadow_contrast(shading.ground);
  for (int c = 0; c < channels_; ++c) {
    const auto channel = static_cast<std::size_t>(c);
    std::vector<double> means;
    double sum = 0;
    for (const Surface& s : surfaces_) {
      double of_surface = 0;
      for (int i = s.begin; i < s.end; ++i) of_surface += samples_[static_cast<std::size_t>(i)].irradiance[channel];
      sum += of_surface;
      means.push_back(of_surface / (s.end - s.begin));
      max_irradiance_[channel] = std::max(max_irradiance_[channel], means.back());
    }
    mean_irradiance_[channel] = n > 0 ? sum / n : 0;
    if (!means.empty())
      max_irradiance_[channel] =
          std::max(max_irradiance_[channel], contrast * *std::min_element(means.begin(), means.end()));
    const double floor = errors.surface_sigma_floor * max_irradiance_[channel];
    root_weight_[channel].resize(n);
    shared_whitened_[channel].resize(n);
    whitened_[channel].resize(n);
    for (std::size_t k = 0; k < surfaces_.size(); ++k) {
      const Surface& s = surfaces_[k];
      const double shared = std::hypot(errors.surface_relative_sigma * means[k], floor);
      double squared = 0;
      for (int i = s.begin; i < s.end; ++i) {
        const SurfaceSample& sample = samples_[static_cast<std::size_t>(i)];
        const double alone =
            std::hypot(sample.sigma[channel], errors.sample_relative_sigma * sample.irradiance[channel],
                       errors.sample_sigma_floor * max_irradiance_[channel]);
        // Avoids a division by zero.
        root_weight_[channel][i] = 1 / std::max(alone, 1e-6 * max_irradiance_[channel] + 1e-300);
        shared_whitened_[channel][i] = shared * root_weight_[channel][i];
        squared += shared_whitened_[channel][i] * shared_whitened_[channel][i];
        whitened_[channel][i] = sample.irradiance[channel];
      }
      shared_[channel].push_back(shared);
      shrinkage_[channel].push_back(squared > 0 ? (1 - 1 / std::sqrt(1 + squared)) / squared : 0);
    }
    whiten(c, whitened_[channel]);
  }
}

void Observations::whiten(int channel, Eigen::Ref<Eigen::VectorXd> column) const {
  const auto c = static_cast<std::size_t>(channel);
  column.array() *= root_weight_[c].array();
  for (std::size_t k = 0; k < surfaces_.size(); ++k) {
    const Surface& s = surfaces_[k];
    const auto t = shared_whitened_[c].segment(s.begin, s.end - s.begin);
    auto x = column.segment(s.begin, s.end - s.begin);
    x -= (shrinkage_[c][k] * t.dot(x)) * t;
  }
}

double Observations::standardized_residual(int channel, int sample, double difference) const {
  const auto c = static_cast<std::size_t>(channel);
  std::size_t k = 0;
  while (k + 1 < surfaces_.size() && sample >= surfaces_[k].end) ++k;
  return difference / std::hypot(1 / root_weight_[c][sample], shared_[c][k]);
}

GroundObservations::GroundObservations(const GroundPlane& ground, const ErrorModel& errors)
    : point(ground.point), normal(ground.normal), step_m(ground.step_m) {
  const auto n = static_cast<Eigen::Index>(ground.samples.size());
  for (Eigen::ArrayXd* a : {&x, &y, &z, &u, &v, &open, &radiance, &weight}) a->resize(n);
  const auto [along, across] = tangent_basis(normal);
  double mean = 0;
  for (const GroundSample& t : ground.samples) mean += t.radiance / static_cast<double>(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const GroundSample& t = ground.samples[static_cast<std::size_t>(i)];
    x[i] = t.position.x, y[i] = t.position.y, z[i] = t.position.z;
    u[i] = dot(t.position - point, along), v[i] = dot(t.position - point, across);
    open[i] = 1 - t.occluded;
    radiance[i] = t.radiance;
    // The body also reflects light onto the samples that it occludes. This is not modelled: it increases sigma.
    const double model_sigma = errors.ground_relative_sigma * mean + 0.5 * t.occluded * t.radiance;
    weight[i] = 1 / (std::hypot(t.sigma, model_sigma) * std::sqrt(errors.ground_correlated_samples) + 1e-300);
  }
}

}  // namespace lightwell::marker
