// Radiance over directions out of the harmonics of a descriptor, as reflections need it: never negative, without the
// ringing of a series that ends. Irradiance needs none of this: it comes from the harmonics as they are.
//   reconstruct   once for a descriptor: bands that were not sent, and how much blur each roughness needs
//   radiance_at   for each direction
#pragma once

#include <array>

#include <lightwell/harmonics.hpp>

namespace lightwell {

/// A descriptor's harmonics, completed, and the least window under which they do not ring.
struct RadianceReconstruction {
  /// The window is known at roughness 0, 1/4, 1/2, 3/4, 1, and in between linear in its square, as a lobe's width is.
  static constexpr int kKnots = 5;

  /// The coefficients that were sent, unchanged, and in the bands that were not sent (all zero: a descriptor that is
  /// made for irradiance leaves out bands 3 and 5, and what comes above its highest) those of the distribution of
  /// maximum entropy that has the sent ones: L = exp(sum of lambda_i Y_i), which is positive everywhere (Jaynes 1957,
  /// "Information Theory and Statistical Mechanics"). Each channel by itself. Coefficients of bands 5 and 6 do not
  /// enter the estimate.
  RadianceSh sh;
  /// t of the window exp(-t l(l+1)) on band l, at each knot: the Gaussian of the sphere, positive and without an
  /// overshoot of its own. The same for the three channels, so that no channel is sharper than another and edges keep
  /// their hue. Falls with roughness; 0 where nothing rings.
  std::array<float, kKnots> blur{};
};

/// Window: the least t with which, in every direction, what the window and the lobe of that roughness leave of a
/// channel is at least a tenth of its local mean (the same under the positive kernel ((1 + x)/2)^6), or of its mean
/// over the sphere where that is less (Sloan 2008, "Stupid Spherical Harmonics Tricks", section "Windowing", and Sloan
/// 2017, "Deringing Spherical Harmonics", with 0 for the tenth). Band 0 is kept: energy is. No allocation, a few tenths
/// of a millisecond. Any values: a channel whose mean is not positive or whose coefficients are not finite asks for no
/// window.
[[nodiscard]] RadianceReconstruction reconstruct(const RadianceSh& sh);

/// reconstruct() commutes with both up to the steps of its search, and these take microseconds.
[[nodiscard]] RadianceReconstruction rotated(const RadianceReconstruction& reconstruction, Quat q);
[[nodiscard]] RadianceReconstruction interpolated(const RadianceReconstruction& a, const RadianceReconstruction& b,
                                                  float f);

/// The mean over the lobe of `roughness`, 0 to 1, about the unit vector d; `lobe` is GgxLobe(roughness).coefficients(),
/// ones for a mirror. At least 0.
[[nodiscard]] Radiance radiance_at(const RadianceReconstruction& reconstruction, Vec3f d, double roughness,
                                   const std::array<double, kMaxBand + 1>& lobe);

}  // namespace lightwell
