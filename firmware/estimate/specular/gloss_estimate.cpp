#include "estimate/specular/gloss_estimate.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

#include <lightwell/quantile.hpp>

namespace lightwell::specular {
namespace {

constexpr int kIterations = 30;
/// Range of the roughness that is searched: below it the lobe is narrower than the grid, above it the plane is nearly
/// matte.
constexpr double kMinAlpha = 0.02, kMaxAlpha = 0.5;
constexpr int kSearchSteps = 6;
/// Misfit after kIterations at the right roughness. A wider lobe cannot explain the reflection's gradients, a narrower
/// one explains them with a blurred environment, so that the misfit rises with alpha. A wide lobe has a larger misfit
/// at the right alpha, too, because the iterations do not reach the edges of lights. Measured on rendered planes.
double misfit_at(double alpha) { return std::clamp(24 * alpha, 0.7, 2.5); }
/// Contrast of the specular part, relative to the brightest texels, that is not attributed to errors: a matte plane of
/// 128² texels has 0.011 after 60 frames of 320x240. Even light has above 0.05, by Fresnel's rise towards 20 degrees.
constexpr double kMinContrast = 0.015;
/// Share of the seen directions that must have grown for another search.
constexpr double kSearchGrowth = 0.1;

/// Of an environment without structure.
constexpr int kUniformLevels = 8;
/// Largest factor by which saturated lights are brighter than their lower bounds, minus 1.
constexpr double kMaxRecovery = 30;
/// Standard deviation of the irradiance of directions that no frame saw, relative to their guess.
constexpr double kGuessSigma = 0.5;

/// Solid angles of the directions above kGrazing_rad, sr.
struct SeenDirections {
  double seen = 0, clipped = 0, all = 0;
};
SeenDirections seen_directions(const ReflectedRadiance& reflected) {
  SeenDirections out;
  for (std::size_t v = 0; v < reflected.value.size(); ++v) {
    if (reflected.grid.direction(v).z < std::sin(kGrazing_rad)) continue;
    const double sr = reflected.grid.solid_angle(v);
    out.all += sr;
    if (!reflected.seen(v)) continue;
    out.seen += sr;
    out.clipped += reflected.lower_bound[v] != 0 ? sr : 0;
  }
  return out;
}

/// Luminance of an environment: its irradiance of the plane, its radiance integrated over directions, and the parts of
/// them that are guesses or lower bounds.
struct Parts {
  double irradiance = 0, guessed_irradiance = 0, clipped_irradiance = 0;
  double radiance = 0, guessed_radiance = 0;
};
Parts parts_of(const GlossEnvironment& environment) {
  Parts out;
  for (std::size_t cell = 0; cell < environment.radiance.size(); ++cell) {
    const double radiance =
        environment.grid.solid_angle(cell) * static_cast<double>(environment.radiance[cell].luminance());
    const double irradiance = radiance * environment.grid.direction(cell).z;
    const double guess = 1 - static_cast<double>(environment.confidence[cell]);
    out.irradiance += irradiance, out.radiance += radiance;
    out.guessed_irradiance += guess * irradiance, out.guessed_radiance += guess * radiance;
    out.clipped_irradiance += environment.lower_bound[cell] != 0 ? irradiance : 0;
  }
  return out;
}

/// Whether the specular part varies by more than its errors: between its 2 % and its 98 % quantile.
bool has_contrast(const ReflectedRadiance& reflected, const DiffuseRange& diffuse) {
  std::vector<float> values, sigmas;
  for (std::size_t v = 0; v < reflected.value.size(); ++v) {
    if (!reflected.seen(v) || reflected.grid.direction(v).z < std::sin(2 * kGrazing_rad)) continue;
    values.push_back(reflected.value[v].luminance());
    sigmas.push_back(reflected.sigma[v]);
  }
  if (values.size() < 20) return false;
  const auto low = static_cast<double>(upper_quantile(values, 0.02)),
             high = static_cast<double>(upper_quantile(values, 0.98)), sigma = static_cast<double>(median(sigmas));
  return high - low > std::max(5 * sigma, kMinContrast * static_cast<double>(diffuse.bright.luminance()));
}

Radiance mean_of(const TexelImage& diffuse) {
  double sum[3] = {}, count = 0;
  for (const TexelRadiance& t : diffuse) {
    if (!t.seen()) continue;
    for (int c = 0; c < 3; ++c) sum[c] += static_cast<double>(t.radiance()[c]);
    ++count;
  }
  const double scale = 1 / std::max(count, 1.0);
  return {static_cast<float>(sum[0] * scale), static_cast<float>(sum[1] * scale), static_cast<float>(sum[2] * scale)};
}

}  // namespace

void GlossEstimator::use_roughness(const Lumisphere& lumisphere, double alpha) {
  deconvolution_.reset();
  if (!gloss_ || static_cast<double>(gloss_->brdf().alpha) != alpha)
    gloss_ = std::make_unique<GlossOperator>(SpecularBrdf{static_cast<float>(alpha)}, GlossOperator::levels_for(alpha));
  reflected_ = sample(lumisphere, gloss_->grid());
  deconvolution_ = std::make_unique<GlossDeconvolution>(*gloss_, reflected_);
  estimate_.alpha = static_cast<double>(gloss_->brdf().alpha);
}

void GlossEstimator::solve(const DiffuseRange& diffuse, const WhiteAlbedo& white, int rounds) {
  for (int round = 0; round < rounds; ++round) {
    deconvolution_->start(common_.value);
    deconvolution_->iterate(round + 1 == rounds ? kIterations : kIterations / 2);
    if (round + 1 == rounds) return;
    const GlossEnvironment& environment = deconvolution_->environment();
    const Parts parts = parts_of(environment);
    CommonIrradiance irradiance;
    irradiance.slope = deconvolution_->irradiance_slope();
    irradiance.without_common = plane_irradiance(environment);
    for (int c = 0; c < 3; ++c) irradiance.without_common[c] -= static_cast<float>(irradiance.slope) * common_.value[c];
    irradiance.sigma = std::hypot(kGuessSigma * parts.guessed_irradiance, parts.clipped_irradiance);
    common_ = common_radiance(*gloss_, reflected_, diffuse, white, irradiance);
  }
}

void GlossEstimator::search_roughness(const Lumisphere& lumisphere, const DiffuseRange& diffuse,
                                      const WhiteAlbedo& white) {
  // Bisection of log alpha for misfit / misfit_at = 1.
  double low = std::log(kMinAlpha), high = std::log(kMaxAlpha);
  for (int step = 0; step < kSearchSteps; ++step) {
    const double alpha = std::exp((low + high) / 2);
    use_roughness(lumisphere, alpha);
    solve(diffuse, white, step == 0 ? 2 : 1);
    (deconvolution_->misfit() > misfit_at(alpha) ? high : low) = (low + high) / 2;
  }
  use_roughness(lumisphere, std::exp((low + high) / 2));
}

std::optional<GlossEstimate> uniform_estimate(const TexelImage& diffuse, const WhiteAlbedo& white) {
  const std::optional<DiffuseRange> range = diffuse_range(diffuse);
  if (!range) return std::nullopt;
  GlossEstimate out;
  const HemisphereGrid grid(kUniformLevels);
  const Radiance above = range->bright * static_cast<float>(1 / white.value);
  out.environment = {grid, std::vector<Radiance>(grid.size(), above), std::vector<float>(grid.size()),
                     std::vector<std::uint8_t>(grid.size())};
  out.plane = mean_of(diffuse);
  out.scale_sigma = white.sigma / white.value;
  out.guessed = 1;
  return out;
}

const GlossEstimate* GlossEstimator::estimate(const Lumisphere& lumisphere, const TexelImage& diffuse,
                                              const WhiteAlbedo& white) {
  const std::optional<DiffuseRange> range = diffuse_range(diffuse);
  if (!range) return nullptr;
  use_roughness(lumisphere, estimate_.alpha);
  const SeenDirections directions = seen_directions(reflected_);
  if (!(directions.seen > 0)) return nullptr;
  estimate_.seen = directions.seen / directions.all;
  estimate_.saturated = directions.clipped / directions.seen;
  estimate_.glossy = has_contrast(reflected_, *range);
  if (estimate_.glossy) {
    if (estimate_.seen > seen_at_search_ + kSearchGrowth || seen_at_search_ == 0) {
      search_roughness(lumisphere, *range, white);
      seen_at_search_ = estimate_.seen;
    }
    solve(*range, white, 3);
    estimate_.misfit = deconvolution_->misfit();
  } else {
    GlossEstimate matte = *uniform_estimate(diffuse, white);
    matte.seen = estimate_.seen, matte.saturated = estimate_.saturated, matte.alpha = estimate_.alpha;
    estimate_ = std::move(matte);
    common_ = {};
    seen_at_search_ = 0;
    return &estimate_;
  }
  estimate_.environment = deconvolution_->environment();
  estimate_.common = common_.value;
  estimate_.plane = mean_of(diffuse) - common_.value;
  const double bright = static_cast<double>((range->bright - common_.value).luminance());
  const double expected = std::numbers::pi * bright / white.value;
  GlossEnvironment& environment = estimate_.environment;
  const Parts parts = parts_of(environment);
  estimate_.guessed = parts.radiance > 0 ? std::clamp(parts.guessed_radiance / parts.radiance, 0.0, 1.0) : 1;
  // What the diffuse texture reflects and the environment lacks is light that was saturated in the reflection.
  double missing = 0;
  if (parts.clipped_irradiance > 0 && expected > parts.irradiance) {
    missing = std::min(expected - parts.irradiance, kMaxRecovery * parts.clipped_irradiance);
    const auto scale = static_cast<float>(1 + missing / parts.clipped_irradiance);
    for (std::size_t cell = 0; cell < environment.radiance.size(); ++cell)
      if (environment.lower_bound[cell] != 0) environment.radiance[cell] = environment.radiance[cell] * scale;
  }
  const double total = std::max(parts.irradiance + missing, 1e-30);
  estimate_.recovered = missing / total;
  const double by_common = deconvolution_->irradiance_slope() * static_cast<double>(common_.sigma);
  const double by_white = missing > 0 ? expected * white.sigma / white.value : 0;
  estimate_.scale_sigma = std::hypot(by_common, by_white) / total;
  return &estimate_;
}

}  // namespace lightwell::specular
