// Conversions to AR platforms (WebXR, ARCore, OpenXR, ARKit, which have Lightwell's axes) and to renderers (Unity,
// three.js, Filament, Unreal).
#include <algorithm>
#include <cstddef>
#include <numbers>

#include <lightwell/conventions.hpp>

#include "core/light_split.hpp"

namespace lightwell {
namespace {

using core::NineCoefficients;
using core::SplitLight;

constexpr double kY00 = 0.28209479177387814;
constexpr double kDegrees = 180 / std::numbers::pi;

/// ARKit's neutral intensity.
constexpr double kNeutral = 1000;

std::array<float, 3> floats(const core::Triple& c) {
  return {static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2])};
}

std::array<float, 3> floats(Vec3d v) { return floats(core::Triple{v.x, v.y, v.z}); }

NineCoefficients with_signs(const NineCoefficients& c, ShSigns signs) {
  return signs == ShSigns::condon_shortley ? core::with_condon_shortley_signs(c) : c;
}

/// r, g, b of each coefficient.
std::array<std::array<float, 3>, 9> rows(const NineCoefficients& c) {
  std::array<std::array<float, 3>, 9> out;
  for (std::size_t i = 0; i < 9; ++i) out[i] = floats(c[i]);
  return out;
}

/// The same in one array.
std::array<float, 27> interleaved(const NineCoefficients& c) {
  std::array<float, 27> out;
  for (std::size_t i = 0; i < 27; ++i) out[i] = static_cast<float>(c[i / 3][i % 3]);
  return out;
}

/// Nine coefficients of red, nine of green, nine of blue.
std::array<float, 27> planar(const NineCoefficients& c) {
  std::array<float, 27> out;
  for (std::size_t i = 0; i < 27; ++i) out[i] = static_cast<float>(c[i % 9][i / 9]);
  return out;
}

/// Mean radiance over the whole sphere.
core::Triple mean_radiance(const NineCoefficients& c) { return {c[0][0] * kY00, c[0][1] * kY00, c[0][2] * kY00}; }

DomPoint point(const std::array<float, 3>& v, float w) { return {v[0], v[1], v[2], w}; }

/// Sets the target's directional light: its colour, with a largest channel of one, and its intensity, times `unit`.
template <class Target>
void set_color(Target& out, const core::Triple& irradiance, double unit = 1) {
  const double largest = std::max({irradiance[0], irradiance[1], irradiance[2]});
  out.color = floats(core::Triple{irradiance[0] / largest, irradiance[1] / largest, irradiance[2] / largest});
  out.intensity = static_cast<float>(largest * unit);
}

}  // namespace

Converted<WebXrLightEstimate> to_webxr(const Lighting& lighting, ShSigns signs, const ConversionOptions& options) {
  const SplitLight light = core::split(lighting, MainLight::apart, core::kOurAxes, options);
  WebXrLightEstimate out;
  if (!light.has_estimate()) return light.converted(out);
  out.sphericalHarmonicsCoefficients = interleaved(with_signs(light.radiance, signs));
  if (light.main) {
    out.primaryLightDirection = point(floats(light.main->towards), 0);
    out.primaryLightIntensity = point(floats(light.main->irradiance), 1);
  }
  return light.converted(out);
}

Converted<ArCoreLightEstimate> to_arcore(const Lighting& lighting, const ConversionOptions& options) {
  const SplitLight light = core::split(lighting, MainLight::apart, core::kOurAxes, options);
  ArCoreLightEstimate out;
  if (!light.has_estimate()) return light.converted(out);
  out.state = ArLightEstimateState::AR_LIGHT_ESTIMATE_STATE_VALID;
  out.timestamp = lighting.mid_exposure().ns;
  out.environmentalHdrAmbientSphericalHarmonics = interleaved(core::with_condon_shortley_signs(light.radiance));
  if (light.main) {
    out.environmentalHdrMainLightDirection = floats(light.main->towards);
    out.environmentalHdrMainLightIntensity = floats(light.main->irradiance);
  }
  return light.converted(out);
}

Converted<OpenXrLightEstimate> to_openxr(const Lighting& lighting, XrSphericalHarmonicsKind kind, ShSigns signs,
                                         const ConversionOptions& options) {
  const MainLight main = kind == XrSphericalHarmonicsKind::ambient ? MainLight::apart : MainLight::in_harmonics;
  const SplitLight light = core::split(lighting, main, core::kOurAxes, options);
  OpenXrLightEstimate out;
  out.sphericalHarmonics.kind = kind;
  if (!light.has_estimate()) return light.converted(out);
  out.state = XrLightEstimateState::valid;
  out.lastUpdatedTime = lighting.mid_exposure().ns;
  out.ambientLight.state = XrLightEstimateState::valid;
  out.ambientLight.intensity = floats(mean_radiance(light.radiance));
  out.sphericalHarmonics.state = XrLightEstimateState::valid;
  out.sphericalHarmonics.coefficients = rows(with_signs(light.radiance, signs));
  if (light.main) {
    out.directionalLight.state = XrLightEstimateState::valid;
    out.directionalLight.direction = floats(light.main->towards);
    out.directionalLight.intensity = floats(light.main->irradiance);
  }
  return light.converted(out);
}

Converted<ArKitLightEstimate> to_arkit(const Lighting& lighting, const ConversionOptions& options) {
  const SplitLight light = core::split(lighting, MainLight::in_harmonics, core::kOurAxes, options);
  ArKitLightEstimate out;
  if (!light.has_estimate()) return light.converted(out);
  out.sphericalHarmonicsCoefficients = planar(light.radiance);
  const std::array<float, 3> mean = floats(mean_radiance(light.radiance));
  out.ambientIntensity = static_cast<float>(kNeutral) * luminance_of(mean[0], mean[1], mean[2]);
  out.ambientColorTemperature = static_cast<float>(correlated_temperature(chromaticity_of(mean[0], mean[1], mean[2])));
  if (const auto main = core::strongest(lighting, core::kOurAxes, options)) {
    out.primaryLightDirection = floats(-main->towards);
    const double lux = luminance_of(main->irradiance[0], main->irradiance[1], main->irradiance[2]);
    out.primaryLightIntensity = static_cast<float>(kNeutral * lux / std::numbers::pi);
  }
  return light.converted(out);
}

Converted<UnityLighting> to_unity(const Lighting& lighting, UnityPipeline pipeline, MainLight main_light,
                                  const ConversionOptions& options) {
  const SplitLight light = core::split(lighting, main_light, core::kUnityAxes, options);
  UnityLighting out;
  if (!light.has_estimate()) return light.converted(out);
  out.sphericalHarmonicsL2 = planar(core::irradiance_over_pi_polynomial(light.radiance));
  if (light.main) {
    out.forward = floats(-light.main->towards);
    set_color(out, light.main->irradiance, pipeline == UnityPipeline::universal ? std::numbers::inv_pi : 1);
  }
  return light.converted(out);
}

Converted<ThreeLighting> to_three(const Lighting& lighting, ThreeLights lights, MainLight main_light,
                                  const ConversionOptions& options) {
  const SplitLight light = core::split(lighting, main_light, core::kOurAxes, options);
  ThreeLighting out;
  if (!light.has_estimate()) return light.converted(out);
  out.sh = interleaved(light.radiance);
  out.lightProbeIntensity = 1;
  if (light.main) {
    out.position = floats(light.main->towards);
    set_color(out, light.main->irradiance, lights == ThreeLights::legacy ? std::numbers::inv_pi : 1);
  }
  return light.converted(out);
}

Converted<FilamentLighting> to_filament(const Lighting& lighting, MainLight main_light,
                                        const ConversionOptions& options) {
  const SplitLight light = core::split(lighting, main_light, core::kOurAxes, options);
  FilamentLighting out;
  if (!light.has_estimate()) return light.converted(out);
  out.irradiance = rows(core::irradiance_over_pi_polynomial(light.radiance));
  out.radiance = rows(core::with_condon_shortley_signs(light.radiance));
  out.indirectIntensity = 1;
  if (light.main) {
    out.direction = floats(-light.main->towards);
    set_color(out, light.main->irradiance);
    out.sunAngularRadius = static_cast<float>(light.main->angular_radius_rad * kDegrees);
  }
  return light.converted(out);
}

Converted<UnrealLighting> to_unreal(const Lighting& lighting, MainLight main_light, const ConversionOptions& options) {
  const SplitLight light = core::split(lighting, main_light, core::kUnrealAxes, options);
  UnrealLighting out;
  if (!light.has_estimate()) return light.converted(out);
  const NineCoefficients radiance = core::with_condon_shortley_signs(light.radiance);
  for (std::size_t i = 0; i < 9; ++i) {
    out.R[i] = static_cast<float>(radiance[i][0]);
    out.G[i] = static_cast<float>(radiance[i][1]);
    out.B[i] = static_cast<float>(radiance[i][2]);
  }
  if (light.main) {
    out.forward = floats(-light.main->towards);
    set_color(out, light.main->irradiance);
    out.lightSourceAngle = static_cast<float>(2 * light.main->angular_radius_rad * kDegrees);
  }
  return light.converted(out);
}

}  // namespace lightwell
