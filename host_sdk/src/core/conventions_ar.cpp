// Conversions to AR platforms: WebXR, ARCore, OpenXR, ARKit. All have Lightwell's axes.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include <lightwell/conventions.hpp>

#include "core/light_split.hpp"

namespace lightwell {
namespace {

using core::NineCoefficients;
using core::SplitLight;

constexpr double kY00 = 0.28209479177387814;

/// ARKit's neutral intensity.
constexpr double kNeutral = 1000;

std::array<float, 3> floats(const core::Triple& c) {
  return {static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2])};
}

std::array<float, 3> floats(Vec3d v) { return floats(core::Triple{v.x, v.y, v.z}); }

NineCoefficients with_signs(const NineCoefficients& c, ShSigns signs) {
  return signs == ShSigns::condon_shortley ? core::with_condon_shortley_signs(c) : c;
}

std::array<float, 27> interleaved(const NineCoefficients& c) {
  std::array<float, 27> out;
  for (std::size_t i = 0; i < 9; ++i)
    for (std::size_t k = 0; k < 3; ++k) out[3 * i + k] = static_cast<float>(c[i][k]);
  return out;
}

/// Mean radiance over the whole sphere.
core::Triple mean_radiance(const NineCoefficients& c) { return {c[0][0] * kY00, c[0][1] * kY00, c[0][2] * kY00}; }

DomPoint point(const std::array<float, 3>& v, float w) { return {v[0], v[1], v[2], w}; }

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
  const NineCoefficients coefficients = with_signs(light.radiance, signs);
  for (std::size_t i = 0; i < 9; ++i) out.sphericalHarmonics.coefficients[i] = floats(coefficients[i]);
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
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t i = 0; i < 9; ++i)
      out.sphericalHarmonicsCoefficients[9 * k + i] = static_cast<float>(light.radiance[i][k]);
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

}  // namespace lightwell
