// Meaning of the AR platforms' light estimates: the irradiance that an application computes from them by following the
// platform's documentation, at a unit normal in the platform's axes. Not divided by pi. Shaders clamp the sum of
// harmonics at zero; this is omitted here, so that negative lobes are detected.
//
// Each function takes the numbers exactly as the platform stores them.
#pragma once

#include <array>

#include "reference/vector.hpp"

namespace lightwell::reference::engines {

/// com.google.ar.core.LightEstimate (https://developers.google.com/ar/reference/java/com/google/ar/core/LightEstimate):
/// getEnvironmentalHdrMainLightDirection, ...MainLightIntensity, ...AmbientSphericalHarmonics (27 floats, r g b of each
/// coefficient).
struct ArCoreEstimate {
  std::array<double, 3> main_light_direction{};
  std::array<double, 3> main_light_intensity{};
  std::array<double, 27> ambient_spherical_harmonics{};
};

/// Lighting as in Google's sample (hello_ar_java: environmental_hdr.frag, and
/// updateSphericalHarmonicsCoefficients of HelloArActivity): a white matte surface reflects the main light's intensity
/// times n.l / pi, and the harmonics times "the normalized spherical harmonics basis functions, the lambertian diffuse
/// BRDF factor (1/pi) and a <cos> convolution". The sample's table of these (0.282095, -0.325735, 0.325735, -0.325735,
/// 0.273137, -0.273137, 0.078848, -0.273137, 0.136569) has the Condon-Shortley signs. Irradiance is pi times what the
/// white surface reflects.
Rgb arcore_irradiance(const ArCoreEstimate& e, const V3& normal);

/// XRLightEstimate, WebXR Lighting Estimation API Level 1 (https://www.w3.org/TR/webxr-lighting-estimation-1/), 2.3.
/// DOMPointReadOnly x, y, z, w. The specification names the order of the coefficients, but not the functions.
struct WebXrEstimate {
  std::array<double, 27> spherical_harmonics_coefficients{};
  std::array<double, 4> primary_light_direction{};
  std::array<double, 4> primary_light_intensity{};
};

/// Chromium returns the values of ARCore or XR_ANDROID_light_estimation unchanged
/// (device/vr/android/arcore/arcore_impl.cc GetLightProbe; device/vr/openxr/android/openxr_light_estimator_android.cc).
Rgb webxr_irradiance_as_browsers_give_it(const WebXrEstimate& e, const V3& normal);

/// three.js copies the coefficients into LightProbe.sh and the intensity into a DirectionalLight whose position is the
/// direction (examples/jsm/webxr/XREstimatedLight.js); then as three_irradiance() of renderers.hpp.
Rgb webxr_irradiance_as_three_js_reads_it(const WebXrEstimate& e, const V3& normal);

/// XR_ANDROID_light_estimation (OpenXR registry, android_light_estimation.adoc). `state` is 0 for valid and 1 for
/// invalid; `kind` 0 for TOTAL ("including the contribution from the main light") and 1 for AMBIENT ("excluding").
struct OpenXrEstimate {
  int state = 1;
  int harmonics_state = 1;
  int harmonics_kind = 0;
  std::array<std::array<double, 3>, 9> coefficients{};  ///< "9 rows and 3 columns", red, green, blue.
  int directional_state = 1;
  std::array<double, 3> direction{};  ///< Towards the light, as Chromium interprets it (see above).
  std::array<double, 3> intensity{};
};

enum class OpenXrBasis {
  condon_shortley,       ///< As in ARCore, from whose authors the extension is.
  ramamoorthi_hanrahan,  ///< As in the paper that the extension cites (eq. 3): all constants positive.
};

/// The harmonics plus the directional light if its state is valid, as an application adds them.
Rgb openxr_irradiance(const OpenXrEstimate& e, OpenXrBasis basis, const V3& normal);

/// ARDirectionalLightEstimate.sphericalHarmonicsCoefficients
/// (https://developer.apple.com/documentation/arkit/ardirectionallightestimate/sphericalharmonicscoefficients):
/// "separate red, green, and blue data planes ... 3 sets of 9 coefficients". They hold the whole environment; the
/// primary light is for renderers without environment-based lighting. Apple does not define the functions; the real
/// ones without phase are assumed, in the order of Ramamoorthi & Hanrahan 2001.
Rgb arkit_irradiance(const std::array<double, 27>& planes, const V3& normal);

}  // namespace lightwell::reference::engines
