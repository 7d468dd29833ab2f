// Options of the fit of point lights.
//   ErrorModel   standard deviations of samples and surfaces
//   FitOptions   prior and limits of the lights
#pragma once

namespace lightwell::marker {

/// Standard deviations in addition to each sample's own sigma.
struct ErrorModel {
  /// Of a sample, relative to its irradiance: texture, blur, falloff within a patch.
  double sample_relative_sigma = 0.005;
  /// Of a sample, relative to Observations::max_irradiance(): light from the ground plane varies along a face.
  double sample_sigma_floor = 0.004;
  /// Shared by a surface, relative to its mean irradiance: its attitude and its paper.
  double surface_relative_sigma = 0.007;
  /// Shared by a surface, relative to Observations::max_irradiance(): interreflection between surfaces.
  double surface_sigma_floor = 0.015;
  /// Of a ground sample, relative to the plane's mean radiance: its texture, and light that the body reflects onto it.
  double ground_relative_sigma = 0.03;
  /// Neighbouring ground samples are correlated: this many count as one.
  double ground_correlated_samples = 9;
};

struct FitOptions {
  /// Smallest distance of a light from the body's centre, m: well outside of the body.
  double min_distance_m = 0.12;
  /// Prior standard deviation of each linear coefficient of the ambient light, relative to its constant.
  double ambient_gradient_sigma = 1.0;
  int iterations = 40;
};

}  // namespace lightwell::marker
