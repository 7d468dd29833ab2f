// Conversions to renderers: Unity, three.js, Filament, Unreal.
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

constexpr double kDegrees = 180 / std::numbers::pi;

std::array<float, 3> to_floats(Vec3d v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

/// A colour normalised to a largest channel of one, and the divisor.
struct ColorAndIntensity {
  std::array<float, 3> color{1, 1, 1};
  double intensity = 0;
};

ColorAndIntensity color_and_intensity(const core::Triple& irradiance) {
  const double largest = std::max({irradiance[0], irradiance[1], irradiance[2]});
  return {to_floats({irradiance[0] / largest, irradiance[1] / largest, irradiance[2] / largest}), largest};
}

std::array<std::array<float, 3>, 9> rows(const NineCoefficients& c) {
  std::array<std::array<float, 3>, 9> out;
  for (std::size_t i = 0; i < 9; ++i) out[i] = to_floats({c[i][0], c[i][1], c[i][2]});
  return out;
}

}  // namespace

Converted<UnityLighting> to_unity(const Lighting& lighting, UnityPipeline pipeline, MainLight main_light,
                                  const ConversionOptions& options) {
  const SplitLight light = core::split(lighting, main_light, core::kUnityAxes, options);
  UnityLighting out;
  if (!light.has_estimate()) return light.converted(out);
  const NineCoefficients prescaled = core::irradiance_over_pi_polynomial(light.radiance);
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t i = 0; i < 9; ++i) out.sphericalHarmonicsL2[9 * k + i] = static_cast<float>(prescaled[i][k]);
  if (light.main) {
    const ColorAndIntensity sun = color_and_intensity(light.main->irradiance);
    out.forward = to_floats(-light.main->towards);
    out.color = sun.color;
    const double unit = pipeline == UnityPipeline::universal ? std::numbers::inv_pi : 1;
    out.intensity = static_cast<float>(sun.intensity * unit);
  }
  return light.converted(out);
}

Converted<ThreeLighting> to_three(const Lighting& lighting, ThreeLights lights, MainLight main_light,
                                  const ConversionOptions& options) {
  const SplitLight light = core::split(lighting, main_light, core::kOurAxes, options);
  ThreeLighting out;
  if (!light.has_estimate()) return light.converted(out);
  for (std::size_t i = 0; i < 9; ++i)
    for (std::size_t k = 0; k < 3; ++k) out.sh[3 * i + k] = static_cast<float>(light.radiance[i][k]);
  out.lightProbeIntensity = 1;
  if (light.main) {
    const ColorAndIntensity sun = color_and_intensity(light.main->irradiance);
    out.position = to_floats(light.main->towards);
    out.color = sun.color;
    const double unit = lights == ThreeLights::legacy ? std::numbers::inv_pi : 1;
    out.intensity = static_cast<float>(sun.intensity * unit);
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
    const ColorAndIntensity sun = color_and_intensity(light.main->irradiance);
    out.direction = to_floats(-light.main->towards);
    out.color = sun.color;
    out.intensity = static_cast<float>(sun.intensity);
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
    const ColorAndIntensity sun = color_and_intensity(light.main->irradiance);
    out.forward = to_floats(-light.main->towards);
    out.color = sun.color;
    out.intensity = static_cast<float>(sun.intensity);
    out.lightSourceAngle = static_cast<float>(2 * light.main->angular_radius_rad * kDegrees);
  }
  return light.converted(out);
}

}  // namespace lightwell
