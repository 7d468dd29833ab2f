// What a fit of lamps believes, and where it looks.
//   ErrorModel   how far samples may be off
//   FitOptions   where lamps may be
#pragma once

namespace lightwell::marker {

/// How much is believed, beside what each sample says of itself.
struct ErrorModel {
  double sample_relative_sigma = 0.005;  ///< Of a sample's irradiance: texture, blur, what a patch's middle hides of falloff.
  double sample_sigma_floor = 0.004;  ///< Of the brightest surface's mean, on each: light from the table varies along a face.
  double surface_relative_sigma = 0.007;  ///< Of a surface's mean: its attitude and its paper.
  double surface_sigma_floor = 0.015;  ///< Of the brightest surface's mean, on each: light that goes from surface to surface.
  double ground_relative_sigma =
      0.03;  ///< Of the table's mean, on each sample: its texture, and light that the body throws on it.
  /// Samples of the table lie so close that neighbours tell the same: so many count as one.
  double ground_correlated_samples = 9;
};

struct FitOptions {
  /// Nearest place of a lamp, m from the body's centre: well outside of the body.
  double min_distance_m = 0.12;
  /// Band 1 of the light from all around, as a share of its band 0: its standard deviation before anything is seen.
  double ambient_gradient_sigma = 1.0;
  int iterations = 40;
};

}  // namespace lightwell::marker
