// Weights of SH bands in irradiance and in glossy radiance, and RMS over all normals by Parseval's theorem.
#pragma once

#include "estimate/common/cells.hpp"

namespace lightwell::estimate {

/// RMS over all normals: mean over the three channels, and weighted by luminance. Errors are measured both ways.
struct IrradianceRms {
  double plain = 0;     ///< Root of the mean square over normals and channels.
  double weighted = 0;  ///< Root of the mean over normals of the luminance-weighted sum of squares.
};

/// From the mean squares over normals of three channels.
[[nodiscard]] IrradianceRms rms(const double (&squares)[3]);

/// The larger of the two ratios error / whole; 0 for 0/0, infinite for an error without light.
[[nodiscard]] double relative(const IrradianceRms& error, const IrradianceRms& whole);

/// Of the irradiance by the bands of a projection (0 to 6, 8, 10 and 12).
[[nodiscard]] IrradianceRms irradiance_rms(const Projection& scene);

/// For each basis function of a BasisRow: its band, and the weight of its squared coefficient in a mean square over
/// normals.
struct BandWeights {
  /// Roughness of the GGX lobe in which errors of glossy radiance are measured.
  static constexpr double kRoughness = 0.5;

  int band[kRowCount];
  float irradiance[kRowCount];  ///< A_l² / 4pi; A_l: coefficients of the cosine lobe.
  float radiance[kRowCount];    ///< K_l² / 4pi; K_l: of the GGX lobe. Bands 8, 10, 12 include 7, 9, 11.
  /// Mean square of the irradiance by bands above 12, relative to that by bands 8, 10 and 12, for a point light, which
  /// has the flattest spectrum.
  double above_irradiance = 0;
};
[[nodiscard]] const BandWeights& band_weights();

}  // namespace lightwell::estimate
