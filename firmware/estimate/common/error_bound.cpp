#include "estimate/common/error_bound.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <lightwell/codec.hpp>

namespace lightwell::estimate {
namespace {

/// Relative irradiance error of a smooth sphere by pixels and blocks, measured on panoramas (estimate/README.md).
constexpr double kSmoothSampling = 1e-3;
/// Relative error of the irradiance per squared side of a pixel, rad²: edges of bright regions fall anywhere in pixels.
constexpr double kPixelSampling = 0.5;
/// Expected error relative to the sampling part of the bound, which sums absolute values.
constexpr double kExpectedSamplingShare = 0.3;
/// Relative error (three sigma) of a light as small as one chroma sample. The covered share of the sample is uniform in
/// [0, 1], with a standard deviation of 0.29, shared by three channels.
constexpr double kChromaEdgeError = 0.6;
/// Ratio for a Bayer mosaic: a quad has two green samples, whose error at edges is 2^-0.75 of that of one (squared:
/// 0.354); over three channels sqrt((1 + 0.354 + 1) / 3).
constexpr double kMosaicEdgeRatio = 0.886;

/// Relative error of the light of a disc with an area of n = `samples` chroma samples, one of which alone has
/// kChromaEdgeError, if the 2 sqrt(pi n) samples on its edge may be wrong, in quadrature.
double edge_error(double samples) {
  const double share =
      std::min(1.0, std::sqrt(2 * std::sqrt(std::numbers::pi)) * std::pow(std::max(samples, 1e-9), -0.75));
  return kChromaEdgeError * share;
}

}  // namespace

double chroma_edge_error(const double (&irradiance)[3], double samples, std::span<const CellSum> scene) {
  double all[3] = {};
  for (const CellSum& s : scene) all[0] += s.r, all[1] += s.g, all[2] += s.b;
  const double luminance = luminance_of(irradiance[0], irradiance[1], irradiance[2]);
  const double total = luminance_of(all[0], all[1], all[2]);
  double largest = 0;
  for (std::size_t k = 0; k < 3; ++k)
    largest = std::max(largest, std::abs(irradiance[k] - (total > 0 ? luminance * all[k] / total : 0)));
  return edge_error(samples) * largest;
}

double mosaic_edge_error(const double (&irradiance)[3], double samples) {
  // A lamp on red or blue sites alone is measured without its green.
  return edge_error(samples) * kMosaicEdgeRatio * std::max({irradiance[0], irradiance[1], irradiance[2]});
}

IrradianceRms direction_error_rms(std::span<const Light> lights) {
  // Rotating a light of irradiance E by delta changes the irradiance by E delta times the slope of a clipped cosine,
  // whose mean square over all normals is 1/6.
  double squares[3] = {};
  for (const Light& light : lights) {
    const double direction_variance = light.direction_covariance[0] + light.direction_covariance[2];
    for (int k = 0; k < 3; ++k) squares[k] += 9 * direction_variance / 6 * light.irradiance[k] * light.irradiance[k];
  }
  return rms(squares);
}

double noise_rms(const IntegrationErrors& errors) {
  // Independent noise of pixels affects the irradiance by the mean square of the clipped cosine, 1/6.
  return std::sqrt(errors.noise / 6);
}

double constant_sampling_error(const CellGrid& grid, double pixel_rad) {
  return kSmoothSampling + kPixelSampling * pixel_rad * pixel_rad + (grid.fitted() ? 0 : grid.gram_deviation());
}

double RelativeErrors::expected() const { return std::hypot(noise, kExpectedSamplingShare * sampling); }

RelativeErrors relative_errors(const Projection& scene, const IntegrationErrors& errors, double factor,
                               double constant_sampling) {
  const IrradianceRms scene_rms = irradiance_rms(scene);
  RelativeErrors out;
  out.rms = std::min(scene_rms.plain, scene_rms.weighted);
  if (!(out.rms > 0)) return out;
  out.noise = noise_rms(errors) * factor / out.rms;
  // A bias that is uniform over the sphere causes an irradiance of a quarter of its integral.
  out.near_black_bias = errors.bias / 4 * factor / out.rms;
  out.sampling = constant_sampling +
                 (errors.centroid_offset + errors.chroma_edge_error + errors.rows) * factor / std::sqrt(6.0) / out.rms;
  // The measured light may be more than the true one by as much.
  const double least = out.rms - errors.stale * factor;
  out.stale = least > 0 ? errors.stale * factor / least : std::numeric_limits<double>::infinity();
  return out;
}

ErrorBound error_bound(const BoundParts& parts, Flags flags) {
  const bool unbounded =
      flags.has(Flag::dark) || flags.has(Flag::unseen) || (flags.has(Flag::clipped) && !flags.has(Flag::recovered));
  // The parts may be correlated: they are summed, not added in quadrature.
  const double total = parts.truncation + parts.sampling + parts.noise + parts.quantization + parts.smoothing;
  ErrorBound out;
  out.total = unbounded ? std::numeric_limits<float>::infinity() : static_cast<float>(total);
  out.truncation = static_cast<float>(parts.truncation);
  out.sampling = static_cast<float>(parts.sampling);
  out.noise = static_cast<float>(parts.noise);
  out.quantization = static_cast<float>(parts.quantization);
  out.smoothing = static_cast<float>(parts.smoothing);
  return out;
}

ErrorBound error_bound(const Descriptor& descriptor, const RelativeErrors& errors, const OptimizedDescriptor& optimized,
                       const IrradianceRms& smoothed, double recovery_uncertainty) {
  if (descriptor.flags.has(Flag::dark)) return error_bound(BoundParts{}, descriptor.flags);
  BoundParts parts;
  parts.truncation = relative(optimized.truncation, optimized.scene_rms);
  // A recovered light affects the RMS irradiance by the root mean square of the clipped cosine, 1/sqrt(6).
  parts.sampling = errors.sampling + errors.stale +
                   relative(direction_error_rms(descriptor.lights), optimized.scene_rms) +
                   recovery_uncertainty / std::sqrt(6.0) / errors.rms;
  parts.noise = 3 * errors.noise + errors.near_black_bias;
  parts.quantization = wire_error(descriptor, errors.rms);
  // Smoothing removes noise; only the difference beyond three sigma of the noise can be light.
  parts.smoothing = std::max(0.0, relative(smoothed, optimized.scene_rms) - 3 * errors.noise);
  return error_bound(parts, descriptor.flags);
}

}  // namespace lightwell::estimate
