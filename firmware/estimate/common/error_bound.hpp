// Bound of the irradiance error of a descriptor: possible errors by cause, relative to the RMS irradiance, and their
// sum. proto/README.md defines the error; estimate/README.md explains the parts.
#pragma once

#include <span>

#include <lightwell/descriptor.hpp>

#include "estimate/common/cells.hpp"
#include "estimate/common/descriptor_optimizer.hpp"

namespace lightwell::estimate {

/// Possible errors of the sums over one frame, in the units of the sums (radiance times solid angle).
struct IntegrationErrors {
  double noise = 0;              ///< Sum over pixels of solid_angle² times the variance of radiance.
  double bias = 0;               ///< Sum over pixels of solid_angle times the possible common bias near black.
  double centroid_offset = 0;    ///< Sum over cells of luminance times the angle between middle and centroid, rad.
  double chroma_edge_error = 0;  ///< Of the irradiance (luminance) of the lights, by shared chroma samples.
  double stale = 0;              ///< RMS irradiance that may have changed where the frame was not read.
  double rows = 0;               ///< Of the luminance of all cells, by rows that were not read.
};

/// Possible error (three sigma, of the largest channel) of the irradiance of a light that covers `samples` samples of
/// chroma, one for several pixels with a luma sample each (NV12, YUYV). It is proportional to the difference between
/// the colours of the light and of the scene. `irradiance`: of the light, by channel. `scene`: sums over the cells of
/// the scene.
[[nodiscard]] double chroma_edge_error(const double (&irradiance)[3], double samples, std::span<const CellSum> scene);
/// The same for a light that covers `samples` quads of a Bayer mosaic.
[[nodiscard]] double mosaic_edge_error(const double (&irradiance)[3], double samples);

/// RMS change of the irradiance by three sigma of the lights' directions.
[[nodiscard]] IrradianceRms direction_error_rms(std::span<const Light> lights);

/// RMS over all normals of the irradiance by independent noise of pixels: one sigma, in the units of the sums.
[[nodiscard]] double noise_rms(const IntegrationErrors& errors);

/// The part of the sampling error that is the same in every frame of a rig, relative to the RMS irradiance: pixels and
/// cells have a finite size, and cells may be too few for the least-squares fit. `pixel_rad`: side of a pixel.
[[nodiscard]] double constant_sampling_error(const CellGrid& grid, double pixel_rad);

/// Irradiance errors of one frame, before lights and bands are selected, relative to its RMS. Zero without light.
struct RelativeErrors {
  double rms = 0;    ///< RMS irradiance, the denominator of the others: plain or luminance-weighted, the smaller one.
  double noise = 0;  ///< One sigma.
  double near_black_bias = 0;
  double sampling = 0;  ///< Sum of absolute values, as in the bound.
  double stale = 0;  ///< Where the frame was not read, relative to the least light that there may be; may be infinite.

  /// Whether noise and bias may be as large as all measured light: no relative error can be stated.
  [[nodiscard]] bool dark() const { return !(rms > 0) || near_black_bias + 3 * noise >= 1; }
  /// Expected error by noise and sampling (one sigma).
  [[nodiscard]] double expected() const;
};

/// `scene`: the frame in the units of the sums times `factor`. `constant_sampling`: see constant_sampling_error().
[[nodiscard]] RelativeErrors relative_errors(const Projection& scene, const IntegrationErrors& errors, double factor,
                                             double constant_sampling);

/// The parts of an ErrorBound in double precision.
struct BoundParts {
  double truncation = 0, sampling = 0, noise = 0, quantization = 0, smoothing = 0;
};

/// The bound whose total is the sum of the parts; infinite where `flags` has dark, unseen, or clipped not recovered.
[[nodiscard]] ErrorBound error_bound(const BoundParts& parts, Flags flags);

/// The bound of a descriptor whose radiance, lights and flags are set; without parts where it is dark.
///   errors                of this frame
///   optimized             what was selected for the descriptor
///   smoothed              result of Smoother::apply(); zero without smoothing
///   recovery_uncertainty  of clipped lights, see RecoveryResult
[[nodiscard]] ErrorBound error_bound(const Descriptor& descriptor, const RelativeErrors& errors,
                                     const OptimizedDescriptor& optimized, const IrradianceRms& smoothed,
                                     double recovery_uncertainty);

}  // namespace lightwell::estimate
