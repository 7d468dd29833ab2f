#include "estimate/specular/gloss_deconvolution.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace lightwell::specular {
namespace {

constexpr float kRelativeSigma = 0.02F;
/// Of the prior, relative to the curvature that a cell would have if all of its reflection was seen: bright reflections
/// have small weights, and their cells small curvatures.
constexpr float kPrior = 1e-3F;
constexpr float kMinConfidence = 1e-6F;

/// Whether a direction is known, or lies between known ones: some direction below it, of the same azimuth, was seen.
bool seen_below(const ReflectedRadiance& reflected, std::size_t node) {
  const HemisphereGrid& grid = reflected.grid;
  for (int level = grid.level_of(node); level <= grid.levels(); ++level)
    if (reflected.seen(grid.on_level(node, level))) return true;
  return false;
}

/// The node whose reflection is the first guess of a cell: its own where that is known, or filled in from both sides.
/// Below all directions of this azimuth that were seen, where the values filled in rise with Fresnel's term and with
/// the errors of grazing views: the lowest that was seen; the pole where none was.
std::size_t guessed_from(const ReflectedRadiance& reflected, std::size_t node) {
  if (seen_below(reflected, node)) return node;
  while (!reflected.seen(node) && node != 0) node = reflected.grid.on_level(node, reflected.grid.level_of(node) - 1);
  return node;
}

Radiance at_least_zero(const Radiance& v) { return {std::max(v.r, 0.0F), std::max(v.g, 0.0F), std::max(v.b, 0.0F)}; }

}  // namespace

Irradiance plane_irradiance(const GlossEnvironment& environment) {
  double sum[3] = {};
  for (std::size_t cell = 0; cell < environment.radiance.size(); ++cell) {
    const double weight = environment.grid.solid_angle(cell) * environment.grid.direction(cell).z;
    for (int c = 0; c < 3; ++c) sum[c] += weight * static_cast<double>(environment.radiance[cell][c]);
  }
  return {static_cast<float>(sum[0]), static_cast<float>(sum[1]), static_cast<float>(sum[2])};
}

GlossDeconvolution::GlossDeconvolution(GlossOperator& gloss, const ReflectedRadiance& reflected)
    : gloss_(gloss), reflected_(reflected) {
  const HemisphereGrid& grid = gloss.grid();
  const std::size_t size = grid.size();
  environment_ = {grid, std::vector<Radiance>(size), std::vector<float>(size), std::vector<std::uint8_t>(size)};
  for (auto* list : {&start_, &target_, &extrapolated_, &previous_, &scratch_, &gradient_}) list->resize(size);
  seen_from_.resize(size), weight_.resize(size), curvature_.resize(size), prior_.resize(size);
  // Channel r: what is seen of a cell; channel g: all of it.
  for (std::size_t v = 0; v < size; ++v)
    scratch_[v] = {reflected.seen(v) ? gloss.solid_angle(v) : 0.0F, gloss.solid_angle(v), 0};
  gloss.transpose(scratch_, gradient_);
  for (std::size_t l = 0; l < size; ++l) {
    const Vec3d d = grid.direction(l);
    const std::uint32_t mirror = grid.nearest(vec_cast<float>(Vec3d{-d.x, -d.y, d.z}));
    seen_from_[l] = static_cast<std::uint32_t>(guessed_from(reflected, mirror));
    environment_.lower_bound[l] = reflected.lower_bound[mirror];
    if (gradient_[l].g > 0) environment_.confidence[l] = std::clamp(gradient_[l].r / gradient_[l].g, 0.0F, 1.0F);
    irradiance_slope_ +=
        static_cast<double>(gloss.solid_angle(l)) * d.z / static_cast<double>(gloss.albedo()[seen_from_[l]]);
  }
}

void GlossDeconvolution::start(Radiance common) {
  const std::size_t size = target_.size();
  for (std::size_t v = 0; v < size; ++v) target_[v] = at_least_zero(reflected_.value[v] + common);
  for (std::size_t v = 0; v < size; ++v) {
    const float sigma = std::hypot(reflected_.sigma[v], kRelativeSigma * target_[v].luminance());
    weight_[v] = reflected_.seen(v) ? gloss_.solid_angle(v) / (sigma * sigma) : 0;
    scratch_[v] = {weight_[v] * gloss_.albedo()[v], 0, 0};
  }
  gloss_.transpose(scratch_, gradient_);
  for (std::size_t l = 0; l < size; ++l) {
    curvature_[l] = gradient_[l].r;
    prior_[l] = kPrior * curvature_[l] / std::max(environment_.confidence[l], kMinConfidence);
    const std::uint32_t from = seen_from_[l];
    start_[l] = target_[from] * (1 / gloss_.albedo()[from]);
  }
  environment_.radiance = extrapolated_ = previous_ = start_;
  momentum_ = 1;
}

void GlossDeconvolution::compute_differences() {
  for (std::size_t v = 0; v < target_.size(); ++v) {
    Radiance difference = target_[v] - scratch_[v];
    // A reflection above a lower bound is possible.
    if (reflected_.lower_bound[v] != 0) difference = at_least_zero(difference);
    scratch_[v] = difference;
  }
}

void GlossDeconvolution::iterate(int iterations) {
  for (int k = 0; k < iterations; ++k) {
    compute_residual();
    update();
  }
}

void GlossDeconvolution::compute_residual() {
  gloss_.reflect(extrapolated_, scratch_);
  compute_differences();
  for (std::size_t v = 0; v < scratch_.size(); ++v) scratch_[v] = scratch_[v] * weight_[v];
}

void GlossDeconvolution::update() {
  std::vector<Radiance>& radiance = environment_.radiance;
  gloss_.transpose(scratch_, gradient_);
  const float next = 0.5F * (1 + std::sqrt(1 + 4 * momentum_ * momentum_)), beta = (momentum_ - 1) / next;
  for (std::size_t l = 0; l < radiance.size(); ++l) {
    const float curvature = curvature_[l] + prior_[l];
    if (!(curvature > 0)) continue;
    const Radiance step = gradient_[l] + prior_[l] * (start_[l] - extrapolated_[l]);
    radiance[l] = at_least_zero(extrapolated_[l] + step * (1 / curvature));
    extrapolated_[l] = at_least_zero(radiance[l] + beta * (radiance[l] - previous_[l]));
    previous_[l] = radiance[l];
  }
  momentum_ = next;
}

double GlossDeconvolution::misfit() {
  reflection_.resize(scratch_.size());
  gloss_.reflect(environment_.radiance, reflection_);
  scratch_ = reflection_;
  compute_differences();
  double sum = 0, weights = 0;
  for (std::size_t v = 0; v < scratch_.size(); ++v) {
    if (!(weight_[v] > 0)) continue;
    const double luminance = static_cast<double>(scratch_[v].luminance());
    sum += static_cast<double>(weight_[v]) * luminance * luminance;
    weights += static_cast<double>(gloss_.solid_angle(v));
  }
  return weights > 0 ? std::sqrt(sum / weights) : 0;
}

}  // namespace lightwell::specular
