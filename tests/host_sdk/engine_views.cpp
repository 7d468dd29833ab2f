#include "host_sdk/engine_views.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

#include "reference/engines/ar_platforms.hpp"
#include "reference/engines/renderers.hpp"

namespace lightwell::test {
namespace {

namespace engines = reference::engines;
using reference::Rgb;
using reference::V3;

template <std::size_t N>
std::array<double, N> doubles(const std::array<float, N>& a) {
  std::array<double, N> out{};
  std::copy(a.begin(), a.end(), out.begin());
  return out;
}

template <std::size_t N>
std::array<std::array<double, 3>, N> doubles(const std::array<std::array<float, 3>, N>& a) {
  std::array<std::array<double, 3>, N> out{};
  for (std::size_t i = 0; i < N; ++i) out[i] = doubles(a[i]);
  return out;
}

std::array<double, 4> doubles(const DomPoint& p) { return {p.x, p.y, p.z, p.w}; }

engines::WebXrEstimate raw(const WebXrLightEstimate& e) {
  return {doubles(e.sphericalHarmonicsCoefficients), doubles(e.primaryLightDirection),
          doubles(e.primaryLightIntensity)};
}

engines::ArCoreEstimate raw(const ArCoreLightEstimate& e) {
  return {doubles(e.environmentalHdrMainLightDirection), doubles(e.environmentalHdrMainLightIntensity),
          doubles(e.environmentalHdrAmbientSphericalHarmonics)};
}

engines::OpenXrEstimate raw(const OpenXrLightEstimate& e) {
  return {static_cast<int>(e.state),
          static_cast<int>(e.sphericalHarmonics.state),
          static_cast<int>(e.sphericalHarmonics.kind),
          doubles(e.sphericalHarmonics.coefficients),
          static_cast<int>(e.directionalLight.state),
          doubles(e.directionalLight.direction),
          doubles(e.directionalLight.intensity)};
}

engines::UnityScene raw(const UnityLighting& e) {
  engines::UnityScene out{{}, doubles(e.forward), doubles(e.color), static_cast<double>(e.intensity)};
  // C#'s this[rgb, coefficient].
  for (std::size_t rgb = 0; rgb < 3; ++rgb)
    for (std::size_t c = 0; c < 9; ++c) out.sh[rgb][c] = e.sphericalHarmonicsL2[9 * rgb + c];
  return out;
}

engines::ThreeScene raw(const ThreeLighting& e) {
  engines::ThreeScene out;
  // SphericalHarmonics3.fromArray.
  for (std::size_t i = 0; i < 9; ++i) out.sh[i] = {e.sh[3 * i], e.sh[3 * i + 1], e.sh[3 * i + 2]};
  out.probe_intensity = e.lightProbeIntensity;
  out.light_position = doubles(e.position);
  out.light_color = doubles(e.color);
  out.light_intensity = e.intensity;
  return out;
}

engines::FilamentScene raw(const FilamentLighting& e) {
  return {doubles(e.irradiance), doubles(e.radiance), static_cast<double>(e.indirectIntensity),
          doubles(e.direction),  doubles(e.color),    static_cast<double>(e.intensity)};
}

engines::UnrealScene raw(const UnrealLighting& e) {
  return {doubles(e.R),       doubles(e.G),     doubles(e.B),
          doubles(e.forward), doubles(e.color), static_cast<double>(e.intensity)};
}

constexpr engines::Frame kYUp = engines::y_up_right_handed;

template <class T, class Irradiance>
EngineView view(std::string name, const engines::Frame& frame, MainLightIs main, const Converted<T>& converted,
                Irradiance irradiance) {
  return {std::move(name),
          frame,
          main,
          [scene = raw(converted.value), irradiance](const V3& n) { return irradiance(scene, n); },
          converted.validity,
          converted.residual};
}

void add_ar_platforms(std::vector<EngineView>& out, const Lighting& lighting, const ConversionOptions& options) {
  out.push_back(view("WebXR, as browsers give it", kYUp, MainLightIs::apart,
                     to_webxr(lighting, ShSigns::condon_shortley, options),
                     engines::webxr_irradiance_as_browsers_give_it));
  out.push_back(view("WebXR, as three.js reads it", kYUp, MainLightIs::apart,
                     to_webxr(lighting, ShSigns::positive, options), engines::webxr_irradiance_as_three_js_reads_it));
  out.push_back(view("ARCore", kYUp, MainLightIs::apart, to_arcore(lighting, options), engines::arcore_irradiance));
  for (const auto kind : {XrSphericalHarmonicsKind::total, XrSphericalHarmonicsKind::ambient})
    for (const auto signs : {ShSigns::condon_shortley, ShSigns::positive}) {
      const bool total = kind == XrSphericalHarmonicsKind::total;
      const auto basis = signs == ShSigns::positive ? engines::OpenXrBasis::ramamoorthi_hanrahan
                                                    : engines::OpenXrBasis::condon_shortley;
      out.push_back(view(
          std::string("OpenXR ") + (total ? "TOTAL" : "AMBIENT") + (signs == ShSigns::positive ? ", by the paper" : ""),
          kYUp, total ? MainLightIs::in_harmonics : MainLightIs::apart, to_openxr(lighting, kind, signs, options),
          [basis](const auto& e, const V3& n) { return engines::openxr_irradiance(e, basis, n); }));
    }
  const auto arkit = to_arkit(lighting, options);
  out.push_back({"ARKit", kYUp, MainLightIs::in_harmonics,
                 [planes = doubles(arkit.value.sphericalHarmonicsCoefficients)](const V3& n) {
                   return engines::arkit_irradiance(planes, n);
                 },
                 arkit.validity, arkit.residual});
}

void add_renderers(std::vector<EngineView>& out, const Lighting& lighting, MainLight choice,
                   const ConversionOptions& options) {
  const bool apart = choice == MainLight::apart;
  const MainLightIs main = apart ? MainLightIs::apart : MainLightIs::in_harmonics;
  const std::string how = apart ? "" : ", one set of harmonics";
  for (const auto pipeline : {UnityPipeline::universal, UnityPipeline::high_definition}) {
    const bool hd = pipeline == UnityPipeline::high_definition;
    const auto theirs = hd ? engines::UnityPipeline::high_definition : engines::UnityPipeline::universal;
    out.push_back(view((hd ? "Unity HDRP" : "Unity URP") + how, engines::unity_frame, main,
                       to_unity(lighting, pipeline, choice, options),
                       [theirs](const auto& e, const V3& n) { return engines::unity_irradiance(e, theirs, n); }));
  }
  for (const auto lights : {ThreeLights::physical, ThreeLights::legacy}) {
    const bool legacy = lights == ThreeLights::legacy;
    const auto theirs = legacy ? engines::ThreeLights::legacy : engines::ThreeLights::physical;
    out.push_back(view((legacy ? "three.js with legacy lights" : "three.js") + how, kYUp, main,
                       to_three(lighting, lights, choice, options),
                       [theirs](const auto& e, const V3& n) { return engines::three_irradiance(e, theirs, n); }));
  }
  const auto filament = to_filament(lighting, choice, options);
  out.push_back(view("Filament irradiance()" + how, kYUp, main, filament, engines::filament_irradiance));
  out.push_back(view("Filament radiance()" + how, kYUp, main, filament, engines::filament_irradiance_from_radiance));
  out.push_back(view("Unreal" + how, engines::unreal_frame, main, to_unreal(lighting, choice, options),
                     engines::unreal_irradiance));
}

}  // namespace

std::vector<EngineView> every_engine(const Lighting& lighting, const ConversionOptions& options) {
  std::vector<EngineView> out;
  add_ar_platforms(out, lighting, options);
  add_renderers(out, lighting, MainLight::apart, options);
  add_renderers(out, lighting, MainLight::in_harmonics, options);
  return out;
}

}  // namespace lightwell::test
