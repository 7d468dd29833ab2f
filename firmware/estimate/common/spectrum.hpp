// What the bands of a projection weigh in irradiance and in glossy radiance, and RMS over all normals by Parseval.
#pragma once

#include "estimate/common/cells.hpp"

namespace lightwell::estimate {

/// An RMS over all normals, both ways that errors are counted: over three channels alike, and by luminance weight.
struct IrradianceRms {
  double plain = 0;     ///< Root of the mean over normals and channels.
  double weighted = 0;  ///< Root of the mean over normals of the weighted sum of squares.
};

/// Of three channels' mean squares over normals.
[[nodiscard]] IrradianceRms rms(const double (&squares)[3]);

/// The larger of the two relative errors; 0 for 0/0, infinite where there is an error but no light.
[[nodiscard]] double relative(const IrradianceRms& error, const IrradianceRms& whole);

/// Of the irradiance that bands 0 to 12 of a projection make.
[[nodiscard]] IrradianceRms irradiance_rms(const Projection& scene);

/// For each function of a row its band, and by what its squared coefficient adds to a mean square over normals.
struct BandWeights {
  /// Of the lobe by which glossy radiance is judged.
  static constexpr double kRoughness = 0.5;

  int band[kRowCount];
  float irradiance[kRowCount];  ///< A_l² / 4pi
  float radiance[kRowCount];    ///< K_l² / 4pi of kRoughness; bands 7, 9, 11 counted with 8, 10, 12
  /// Of bands above 12 relative to those of 8, 10 and 12: as for a point of light, which has the flattest spectrum.
  double above_irradiance = 0;
};
[[nodiscard]] const BandWeights& band_weights();

}  // namespace lightwell::estimate
