// C ABI of the conversions to other engines' lighting types.
#include <algorithm>
#include <array>
#include <initializer_list>
#include <iterator>
#include <string>

#include <lightwell/conventions.h>
#include <lightwell/conventions.hpp>

#include "c/call.hpp"

namespace lightwell::c {
namespace {

static_assert(LW_SH_POSITIVE == static_cast<int>(ShSigns::positive) &&
              LW_MAIN_LIGHT_IN_HARMONICS == static_cast<int>(MainLight::in_harmonics) &&
              LW_UNITY_HIGH_DEFINITION == static_cast<int>(UnityPipeline::high_definition) &&
              LW_THREE_LEGACY == static_cast<int>(ThreeLights::legacy) &&
              LW_OPENXR_AMBIENT == static_cast<int>(XrSphericalHarmonicsKind::ambient) &&
              LW_RESIDUAL_LEFT_OUT == static_cast<int>(Residual::left_out));

/// A caller's enum value that must be 0 or 1.
struct Choice {
  std::int32_t value;
  const char* name;
};

Status checked(const Choice& choice) {
  if (choice.value == 0 || choice.value == 1) return {};
  return invalid(std::string(choice.name) + " is " + std::to_string(choice.value) + "; it is 0 or 1");
}

Result<ConversionOptions> options_of(const lw_conversion_options* given) {
  ConversionOptions out;
  if (given == nullptr) return out;
  lw_conversion_options options{};
  if (Status s = read_sized(given, "lw_conversion_options", options); !s.ok()) return s;
  if (Status s = checked({options.residual, "lw_conversion_options.residual"}); !s.ok()) return s;
  out.residual = static_cast<Residual>(options.residual);
  if (std::any_of(std::begin(options.color), std::end(options.color), [](float v) { return v != 0; }))
    for (std::size_t i = 0; i < 9; ++i) out.color.m[i / 3][i % 3] = options.color[i];
  return out;
}

template <std::size_t n>
void copy(const std::array<float, n>& from, float (&to)[n]) {
  std::copy(from.begin(), from.end(), to);
}

template <std::size_t n>
void copy(const std::array<std::array<float, 3>, n>& from, float (&to)[3 * n]) {
  for (std::size_t i = 0; i < n; ++i) std::copy(from[i].begin(), from[i].end(), to + 3 * i);
}

void copy(const DomPoint& from, float (&to)[4]) { copy(std::array{from.x, from.y, from.z, from.w}, to); }

void fill(const WebXrLightEstimate& from, lw_webxr& to) {
  copy(from.sphericalHarmonicsCoefficients, to.sphericalHarmonicsCoefficients);
  copy(from.primaryLightDirection, to.primaryLightDirection);
  copy(from.primaryLightIntensity, to.primaryLightIntensity);
}

void fill(const ArCoreLightEstimate& from, lw_arcore& to) {
  to.state = static_cast<std::int32_t>(from.state);
  to.timestamp = from.timestamp;
  copy(from.environmentalHdrMainLightDirection, to.environmentalHdrMainLightDirection);
  copy(from.environmentalHdrMainLightIntensity, to.environmentalHdrMainLightIntensity);
  copy(from.environmentalHdrAmbientSphericalHarmonics, to.environmentalHdrAmbientSphericalHarmonics);
}

void fill(const OpenXrLightEstimate& from, lw_openxr& to) {
  to.state = static_cast<std::int32_t>(from.state);
  to.lastUpdatedTime = from.lastUpdatedTime;
  to.ambientLightState = static_cast<std::int32_t>(from.ambientLight.state);
  copy(from.ambientLight.intensity, to.ambientLightIntensity);
  copy(from.ambientLight.colorCorrection, to.ambientLightColorCorrection);
  to.sphericalHarmonicsState = static_cast<std::int32_t>(from.sphericalHarmonics.state);
  to.sphericalHarmonicsKind = static_cast<lw_openxr_harmonics>(from.sphericalHarmonics.kind);
  copy(from.sphericalHarmonics.coefficients, to.sphericalHarmonicsCoefficients);
  to.directionalLightState = static_cast<std::int32_t>(from.directionalLight.state);
  copy(from.directionalLight.intensity, to.directionalLightIntensity);
  copy(from.directionalLight.direction, to.directionalLightDirection);
}

void fill(const ArKitLightEstimate& from, lw_arkit& to) {
  copy(from.sphericalHarmonicsCoefficients, to.sphericalHarmonicsCoefficients);
  copy(from.primaryLightDirection, to.primaryLightDirection);
  to.primaryLightIntensity = from.primaryLightIntensity;
  to.ambientIntensity = from.ambientIntensity;
  to.ambientColorTemperature = from.ambientColorTemperature;
}

void fill(const UnityLighting& from, lw_unity& to) {
  copy(from.sphericalHarmonicsL2, to.sphericalHarmonicsL2);
  copy(from.forward, to.forward);
  copy(from.color, to.color);
  to.intensity = from.intensity;
}

void fill(const ThreeLighting& from, lw_three& to) {
  copy(from.sh, to.sh);
  to.lightProbeIntensity = from.lightProbeIntensity;
  copy(from.position, to.position);
  copy(from.color, to.color);
  to.intensity = from.intensity;
}

void fill(const FilamentLighting& from, lw_filament& to) {
  copy(from.irradiance, to.irradiance);
  copy(from.radiance, to.radiance);
  to.indirectIntensity = from.indirectIntensity;
  copy(from.direction, to.direction);
  copy(from.color, to.color);
  to.intensity = from.intensity;
  to.sunAngularRadius = from.sunAngularRadius;
}

void fill(const UnrealLighting& from, lw_unreal& to) {
  copy(from.R, to.R);
  copy(from.G, to.G);
  copy(from.B, to.B);
  copy(from.forward, to.forward);
  copy(from.color, to.color);
  to.intensity = from.intensity;
  to.lightSourceAngle = from.lightSourceAngle;
}

/// `make(lighting, options)` returns the Converted value.
template <class C, class Make>
lw_status convert(const lw_lighting* lighting, const lw_conversion_options* options, const char* name, C* out,
                  std::initializer_list<Choice> choices, const Make& make) {
  const lw_status status = with_handle(lighting, [&](const Lighting& l) -> Status {
    for (const Choice& choice : choices)
      if (Status s = checked(choice); !s.ok()) return s;
    const Result<ConversionOptions> parsed_options = options_of(options);
    if (!parsed_options.ok()) return parsed_options.status();
    const auto made = make(l, *parsed_options);
    C c{};
    c.size = sizeof c;
    c.validity = static_cast<lw_validity>(made.validity);
    c.residual = made.residual.value_or(-1.0F);
    fill(made.value, c);
    return write_sized(c, name, out);
  });
  return write_failure(status, name, out);
}

}  // namespace
}  // namespace lightwell::c

using namespace lightwell;
using namespace lightwell::c;

extern "C" {

lw_status lw_lighting_to_webxr(const lw_lighting* lighting, lw_sh_signs signs, const lw_conversion_options* options,
                               lw_webxr* out) {
  return convert(lighting, options, "lw_webxr", out, {{signs, "signs"}},
                 [&](const auto& l, const auto& o) { return to_webxr(l, static_cast<ShSigns>(signs), o); });
}

lw_status lw_lighting_to_arcore(const lw_lighting* lighting, const lw_conversion_options* options, lw_arcore* out) {
  return convert(lighting, options, "lw_arcore", out, {},
                 [&](const auto& l, const auto& o) { return to_arcore(l, o); });
}

lw_status lw_lighting_to_openxr(const lw_lighting* lighting, lw_openxr_harmonics kind, lw_sh_signs signs,
                                const lw_conversion_options* options, lw_openxr* out) {
  return convert(lighting, options, "lw_openxr", out, {{kind, "kind"}, {signs, "signs"}},
                 [&](const auto& l, const auto& o) {
                   return to_openxr(l, static_cast<XrSphericalHarmonicsKind>(kind), static_cast<ShSigns>(signs), o);
                 });
}

lw_status lw_lighting_to_arkit(const lw_lighting* lighting, const lw_conversion_options* options, lw_arkit* out) {
  return convert(lighting, options, "lw_arkit", out, {}, [&](const auto& l, const auto& o) { return to_arkit(l, o); });
}

lw_status lw_lighting_to_unity(const lw_lighting* lighting, lw_unity_pipeline pipeline, lw_main_light main_light,
                               const lw_conversion_options* options, lw_unity* out) {
  return convert(lighting, options, "lw_unity", out, {{pipeline, "pipeline"}, {main_light, "main_light"}},
                 [&](const auto& l, const auto& o) {
                   return to_unity(l, static_cast<UnityPipeline>(pipeline), static_cast<MainLight>(main_light), o);
                 });
}

lw_status lw_lighting_to_three(const lw_lighting* lighting, lw_three_lights lights, lw_main_light main_light,
                               const lw_conversion_options* options, lw_three* out) {
  return convert(lighting, options, "lw_three", out, {{lights, "lights"}, {main_light, "main_light"}},
                 [&](const auto& l, const auto& o) {
                   return to_three(l, static_cast<ThreeLights>(lights), static_cast<MainLight>(main_light), o);
                 });
}

lw_status lw_lighting_to_filament(const lw_lighting* lighting, lw_main_light main_light,
                                  const lw_conversion_options* options, lw_filament* out) {
  return convert(lighting, options, "lw_filament", out, {{main_light, "main_light"}},
                 [&](const auto& l, const auto& o) { return to_filament(l, static_cast<MainLight>(main_light), o); });
}

lw_status lw_lighting_to_unreal(const lw_lighting* lighting, lw_main_light main_light,
                                const lw_conversion_options* options, lw_unreal* out) {
  return convert(lighting, options, "lw_unreal", out, {{main_light, "main_light"}},
                 [&](const auto& l, const auto& o) { return to_unreal(l, static_cast<MainLight>(main_light), o); });
}

}  // extern "C"
