// Peers: the light estimates that the two AR platforms give to applications, computed from a panorama: as good as such
// output can be, without the errors of those platforms' cameras.
#pragma once

#include <array>

#include "bench/equirect_image.hpp"

namespace lightwell::bench {

/// Nine RGB coefficients of radiance, bands 0 to 2, index l (l + 1) + m; real, orthonormal, without Condon-Shortley
/// phase (to_condon_shortley converts to ARCore's signs).
using NineCoefficients = std::array<Triple, 9>;

/// Projection of an image, with exact solid angles and the functions evaluated at pixel centres.
[[nodiscard]] NineCoefficients nine_coefficients(const EquirectImage& image);

/// Converts to the basis with the Condon-Shortley phase, as in ARCore and OpenXR: coefficients of odd m change sign. It
/// is its own inverse.
[[nodiscard]] NineCoefficients to_condon_shortley(NineCoefficients coefficients);

/// ARKit-style (AREnvironmentProbe, ARDirectionalLightEstimate's sphericalHarmonicsCoefficients): all of
/// the light in nine coefficients.
struct ArkitOutput {
  NineCoefficients total{};
};

/// ARCore-style (Environmental HDR): a main light, and the rest as ambient coefficients.
struct ArcoreOutput {
  Triple main_direction{0, 1, 0};  ///< Towards the light.
  Triple main_irradiance{};        ///< At normal incidence. Zero for a black image.
  NineCoefficients ambient{};      ///< Without the main light.
};

[[nodiscard]] ArkitOutput arkit_output(const EquirectImage& image);

/// The main light is the bright region (proto/README.md: the 8-connected pixels at or above half the peak's luminance,
/// across seam and poles) at its luminance-weighted centroid. The radiance of those pixels above the median luminance
/// of the image (by solid angle) belongs to it, in its colour; all other radiance is ambient. ARCore does not publish
/// its rule; this one is exact for a lamp in front of a uniform background.
[[nodiscard]] ArcoreOutput arcore_output(const EquirectImage& image);

/// The irradiance that an application computes at a unit normal by the platforms' guides: cosine lobe pi, 2 pi / 3, pi
/// / 4 on the coefficients (Ramamoorthi & Hanrahan 2001, eq. 7)
/// plus, for ARCore, main_irradiance * max(0, n . main_direction). Not divided by pi; may be negative.
[[nodiscard]] Triple irradiance_of(const NineCoefficients& radiance, const Triple& normal);
[[nodiscard]] Triple irradiance_of(const ArkitOutput& output, const Triple& normal);
[[nodiscard]] Triple irradiance_of(const ArcoreOutput& output, const Triple& normal);

}  // namespace lightwell::bench
