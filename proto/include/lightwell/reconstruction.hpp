// Reconstruction of radiance from a descriptor's harmonics, for reflections: non-negative and without the ringing of a
// truncated series. Irradiance is evaluated from the harmonics directly.
//   reconstruct   once per descriptor: estimates the missing bands, and the window for each roughness
//   radiance_at   for each direction
#pragma once

#include <array>

#include <lightwell/harmonics.hpp>

namespace lightwell {

/// A descriptor's harmonics with the missing bands estimated, and the weakest windows that suppress ringing.
struct RadianceReconstruction {
  /// The window is stored at roughness 0, 1/4, 1/2, 3/4, 1, and interpolated linearly in roughness squared, to which
  /// the width of a lobe is proportional.
  static constexpr int kKnots = 5;

  /// The sent coefficients, unchanged. Bands that were not sent (all zero: a descriptor for irradiance leaves out bands
  /// 3 and 5, and those above its highest) have the coefficients of the maximum entropy distribution with the sent
  /// coefficients: L = exp(sum of lambda_i Y_i), which is positive everywhere (Jaynes 1957, "Information Theory and
  /// Statistical Mechanics"). Each channel separately. Coefficients of bands 5 and 6 do not enter the estimate.
  RadianceSh sh;
  /// t of the window exp(-t l(l+1)) on band l, at each knot: the heat kernel of the sphere, which is positive and so
  /// causes no overshoot. The same for the three channels, so that edges keep their hue. Decreases with roughness; 0 if
  /// nothing rings.
  std::array<float, kKnots> blur{};
};

/// Estimates the missing bands and finds the windows. At each roughness the window is the least t for which every
/// channel, after window and lobe, is in every direction at least a tenth of its local mean (its convolution with the
/// positive kernel ((1 + x)/2)^6) or of its mean over the sphere, whichever is less. (Sloan 2008, "Stupid Spherical
/// Harmonics Tricks", section "Windowing", and Sloan 2017, "Deringing Spherical Harmonics", with 0 instead of a tenth.)
/// Band 0 is unchanged, so energy is conserved. No allocation, a few tenths of a millisecond. Accepts any values: a
/// channel whose mean is not positive or whose coefficients are not finite does not affect the window.
[[nodiscard]] RadianceReconstruction reconstruct(const RadianceSh& sh);

/// Rotates or interpolates a reconstruction, in microseconds: the same as reconstruct() of rotated or interpolated
/// coefficients, up to the step of its search.
[[nodiscard]] RadianceReconstruction rotated(const RadianceReconstruction& reconstruction, Quat q);
[[nodiscard]] RadianceReconstruction interpolated(const RadianceReconstruction& a, const RadianceReconstruction& b,
                                                  float f);

/// Mean radiance over the GGX lobe of `roughness`, 0 to 1, about the unit vector d. At least 0. `lobe` must be
/// GgxLobe(roughness).coefficients(), or ones for a mirror.
[[nodiscard]] Radiance radiance_at(const RadianceReconstruction& reconstruction, Vec3f d, double roughness,
                                   const std::array<double, kMaxBand + 1>& lobe);

}  // namespace lightwell
