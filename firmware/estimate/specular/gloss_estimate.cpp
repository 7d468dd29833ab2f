#include "estimate/specular/gloss_estimate.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include <lightwell/quantile.hpp>

namespace lightwell::specular {
namespace {

/// Misfit of a solution at the right roughness. A wider lobe cannot explain the reflection's gradients, a narrower
/// one explains them with a blurred environment, so that the misfit rises with alpha. A wide lobe has a larger misfit
/// at the right alpha, too, because the iterations do not reach the edges of lights. Measured on rendered planes.
double misfit_at(double alpha) { return std::clamp(24 * alpha, 0.7, 2.5); }
/// Contrast of the specular part, relative to the brightest texels, that is not attributed to errors: a matte plane of
/// 128² texels has 0.011 after 60 frames of 320x240. Even light has above 0.05, by Fresnel's rise towards 20 degrees.
constexpr double kMinContrast = 0.015;
/// Seen share from which the roughness is searched for in the stream of frames: with less the answer is off by a factor
/// of up to five. Another search, from the last answer on, follows each growth of the share.
constexpr double kSearchSeen = 0.25, kSearchGrowth = 0.05;

/// Deconvolutions of an estimate, between which the common radiance is fitted; one less where it is known.
constexpr int kRounds = 3;

/// Of an environment without structure.
constexpr int kUniformLevels = 8;
/// Irradiance beyond what the texture shows, in standard deviations of white's albedo, that is attributed to errors.
constexpr double kMaxExcess = 3;
/// Largest factor by which saturated lights are brighter than their lower bounds, minus 1; also of such an excess.
constexpr double kMaxRecovery = 30;

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

std::optional<Radiance> GlossEstimate::predicted(Vec3f to_viewer) const {
  if (reflection.empty() || provisional) return std::nullopt;
  const auto where = environment.grid.interpolate(to_viewer);
  Radiance out;
  for (std::size_t k = 0; k < 3; ++k) out += where.weight[k] * reflection[where.node[k]];
  return out;
}

void GlossEstimator::begin(const Lumisphere& lumisphere, const TexelImage& diffuse, const WhiteAlbedo& white,
                           RoughnessMode mode) {
  running_ = false;
  const std::optional<DiffuseRange> range = diffuse_range(diffuse);
  const ReflectedRadiance reflected = sample(lumisphere, HemisphereGrid(GlossOperator::levels_for(alpha_)));
  const SeenDirections directions = seen_directions(reflected);
  if (!range || !(directions.seen > 0)) {
    estimate_.reset();
    return;
  }
  seen_ = directions.seen / directions.all;
  saturated_ = directions.clipped / directions.seen;
  if (!has_contrast(reflected, *range)) {
    estimate_ = *uniform_estimate(diffuse, white);
    estimate_->seen = seen_, estimate_->saturated = saturated_, estimate_->alpha = alpha_;
    solver_.reset_common();
    search_.reset(), seen_at_search_ = 0;
    return;
  }
  input_ = {lumisphere, *range, white};
  mean_diffuse_ = mean_of(diffuse);
  mode_ = mode;
  running_ = true;
  if (mode == RoughnessMode::search) {
    search_ = RoughnessSearch();
    alpha_ = search_->alpha();
    solver_.begin(input_, alpha_, 2);
    return;
  }
  if (!search_ && seen_at_search_ == 0 && seen_ >= kSearchSeen) search_ = RoughnessSearch();
  if (!search_ && seen_at_search_ > 0 && seen_ > seen_at_search_ + kSearchGrowth) search_ = RoughnessSearch(alpha_);
  if (search_) alpha_ = search_->alpha();
  const bool has_common = estimate_ && estimate_->glossy;
  solver_.begin(input_, alpha_, has_common ? kRounds - 1 : kRounds);
}

std::size_t GlossEstimator::step(std::size_t operations) {
  WorkBudget budget(operations);
  while (running_ && solver_.step(budget)) end_solution();
  return budget.spent();
}

void GlossEstimator::end_solution() {
  if (search_) search_->add(solver_.misfit() / misfit_at(alpha_));
  if (search_ && mode_ == RoughnessMode::search) {
    alpha_ = search_->alpha();
    solver_.begin(input_, alpha_, search_->done() ? kRounds : 1);
  } else {
    estimate_ = conclude();
    running_ = false;
  }
  if (search_ && search_->done()) {
    alpha_ = search_->alpha();
    seen_at_search_ = seen_;
    search_.reset();
  }
}

GlossEstimate GlossEstimator::conclude() const {
  const WhiteAlbedo& white = input_.white;
  const CommonRadiance common = solver_.common();
  GlossEstimate out;
  out.glossy = true, out.provisional = seen_at_search_ == 0;
  out.alpha = alpha_, out.seen = seen_, out.saturated = saturated_;
  out.misfit = solver_.misfit();
  out.environment = solver_.deconvolution().environment();
  out.common = common.value;
  out.reflection = solver_.deconvolution().reflection();
  for (Radiance& v : out.reflection) v = v - common.value;
  out.plane = mean_diffuse_ - common.value;
  const double bright = static_cast<double>((input_.diffuse.bright - common.value).luminance());
  const double expected = std::numbers::pi * bright / white.value;
  const EnvironmentParts parts = parts_of(out.environment);
  out.guessed = parts.radiance > 0 ? std::clamp(parts.guessed_radiance / parts.radiance, 0.0, 1.0) : 1;
  // What the diffuse texture reflects and the environment lacks is light that was saturated in the reflection.
  double missing = 0;
  if (parts.clipped_irradiance > 0 && expected > parts.irradiance) {
    missing = std::min(expected - parts.irradiance, kMaxRecovery * parts.clipped_irradiance);
    const auto scale = static_cast<float>(1 + missing / parts.clipped_irradiance);
    for (std::size_t cell = 0; cell < out.environment.radiance.size(); ++cell)
      if (out.environment.lower_bound[cell] != 0)
        out.environment.radiance[cell] = out.environment.radiance[cell] * scale;
  }
  const double total = std::max(parts.irradiance + missing, 1e-30);
  out.recovered = missing / total;
  const double by_common = solver_.deconvolution().irradiance_slope() * static_cast<double>(common.sigma);
  const double by_white = missing > 0 ? expected * white.sigma / white.value : 0;
  out.scale_sigma = std::hypot(by_common, by_white) / total;
  // More light than the texture shows: a plane without white, or one that reflects more than specular_brdf.hpp, as
  // metal does. Which one is not known; the light is between the two.
  if (const double excess = total / std::max(expected, 1e-30); excess > 1 + kMaxExcess * white.sigma / white.value)
    out.scale_sigma = std::max(out.scale_sigma, std::min(excess, kMaxRecovery) - 1);
  return out;
}

const GlossEstimate* GlossEstimator::estimate(const Lumisphere& lumisphere, const TexelImage& diffuse,
                                              const WhiteAlbedo& white) {
  begin(lumisphere, diffuse, white, RoughnessMode::search);
  step(WorkBudget::kUnlimited);
  return last();
}

}  // namespace lightwell::specular
