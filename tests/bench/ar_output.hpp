// Peers: what applications get from the two platforms' own light estimation, made from a panorama (so as
// good as such an output can be, not as those platforms' cameras make it).
#pragma once

#include <array>

#include "bench/equirect_image.hpp"

namespace lightwell::bench {

/// Nine coefficients of radiance, bands 0 to 2, index l (l + 1) + m, a colour each; real, orthonormal,
/// without Condon-Shortley phase (see to_condon_shortley for the sign that ARCore uses).
using NineCoefficients = std::array<Triple, 9>;

/// The projection of a whole picture, with exact solid angles and the functions at pixel centres.
[[nodiscard]] NineCoefficients nine_coefficients(const EquirectImage& image);

/// The same coefficients in the basis with the phase, as ARCore's and OpenXR's lists have them: those of
/// odd m change sign. Its own inverse.
[[nodiscard]] NineCoefficients to_condon_shortley(NineCoefficients coefficients);

/// ARKit-style (AREnvironmentProbe, ARDirectionalLightEstimate's sphericalHarmonicsCoefficients): all of
/// the light in nine coefficients.
struct ArkitOutput {
  NineCoefficients total{};
};

/// ARCore-style (Environmental HDR): a main light, and the rest as ambient coefficients.
struct ArcoreOutput {
  Triple main_direction{0, 1, 0};  ///< Towards the light.
  Triple main_irradiance{};        ///< At a receiver that faces it. Zero where the picture is black.
  NineCoefficients ambient{};      ///< Without the main light.
};

[[nodiscard]] ArkitOutput arkit_output(const EquirectImage& image);

/// The main light is the bright region (proto/README.md: the 8-connected pixels at or above half the peak's
/// luminance, over seam and poles, its luminance-weighted centroid). All of the radiance of those pixels
/// above the median luminance of the picture (by solid angle) goes into it, in its colour; what is left,
/// there as elsewhere, is ambient. ARCore does not publish its rule; this one is exact for a lamp
/// before an even background.
[[nodiscard]] ArcoreOutput arcore_output(const EquirectImage& image);

/// The irradiance that an application computes from each at a unit normal, as the platforms' guides
/// have it: cosine lobe pi, 2 pi / 3, pi / 4 on the coefficients (Ramamoorthi & Hanrahan 2001, eq. 7)
/// plus, for ARCore, main_irradiance * max(0, n . main_direction). Not divided by pi; may be negative.
[[nodiscard]] Triple irradiance_of(const NineCoefficients& radiance, const Triple& normal);
[[nodiscard]] Triple irradiance_of(const ArkitOutput& output, const Triple& normal);
[[nodiscard]] Triple irradiance_of(const ArcoreOutput& output, const Triple& normal);

}  // namespace lightwell::bench
