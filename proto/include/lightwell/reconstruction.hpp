// Reconstruction of radiance from a descriptor's harmonics, for reflections: non-negative and without the ringing of a
// truncated series. Method and references: proto/README.md, "Radiance from harmonics".
#pragma once

#include <array>

#include <lightwell/harmonics.hpp>

namespace lightwell {

/// A descriptor's harmonics with the missing bands estimated, and the weakest windows that suppress ringing.
struct RadianceReconstruction {
  /// The window is stored at roughness 0, 1/4, 1/2, 3/4, 1, and interpolated linearly in roughness squared, to which
  /// the width of a lobe is proportional.
  static constexpr int kKnots = 5;

  /// The sent coefficients, unchanged. Bands that were not sent (all zero) have the coefficients of the maximum entropy
  /// distribution with the sent ones, each channel separately.
  RadianceSh sh;
  /// t of the window exp(-t l(l+1)) on band l, at each knot, the same for the three channels. Decreases with roughness;
  /// 0 if nothing rings.
  std::array<float, kKnots> blur{};
};

/// Estimates the missing bands and finds the windows. Band 0 is unchanged, so energy is conserved. No allocation, a few
/// tenths of a millisecond. Accepts any values: a channel whose mean is not positive or whose coefficients are not
/// finite does not affect the window.
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
