// Shading in renderers by harmonics and a directional light: pi times the radiance of a white matte surface, at a unit
// normal in the renderer's axes. Clamping at zero is omitted, as in ar_platforms.hpp.
#pragma once

#include <array>

#include "reference/vector.hpp"

namespace lightwell::reference::engines {

/// UnityEngine.Rendering.SphericalHarmonicsL2, this[rgb, coefficient], and a directional Light.
struct UnityScene {
  std::array<std::array<double, 9>, 3> sh{};
  std::array<double, 3> light_forward{};  ///< Transform.forward: the direction of travel of the light.
  std::array<double, 3> light_color{};    ///< Linear.
  double light_intensity = 0;
};

enum class UnityPipeline {
  universal,        ///< Built-in and URP: a white surface reflects colour times intensity times n.l.
  high_definition,  ///< HDRP: intensity is in lux, a Lambert surface reflects it times n.l / pi.
};

/// The harmonics as SampleSH9 and SHEvalLinearL0L1/L2 evaluate them (Unity-Technologies/Graphics,
/// com.unity.render-pipelines.core/ShaderLibrary/SphericalHarmonics.hlsl) after the packing into unity_SHAr ...
/// unity_SHC (SphericalHarmonicMath.PackCoefficients): the probe "stores each coefficient pre-multiplied by
/// kNormalizationConstants, which fold the SH basis constants and the clamped-cosine (irradiance) kernel into the
/// coefficients", Sloan's fC0..fC4 (2008, appendix A10), which include 1/pi.
Rgb unity_irradiance(const UnityScene& scene, UnityPipeline pipeline, const V3& normal);

/// three.js LightProbe.sh (SphericalHarmonics3.coefficients) and intensity, and a DirectionalLight that shines from its
/// position towards the origin.
struct ThreeScene {
  std::array<std::array<double, 3>, 9> sh{};
  double probe_intensity = 1;
  std::array<double, 3> light_position{};
  std::array<double, 3> light_color{};
  double light_intensity = 0;
};

enum class ThreeLights {
  physical,  ///< From r155 on, and before with physicallyCorrectLights or useLegacyLights = false.
  legacy,    ///< useLegacyLights: direct light, but not a LightProbe, is multiplied by pi.
};

/// shGetIrradianceAt() of lights_pars_begin.glsl.js, with the constants of Ramamoorthi & Hanrahan 2001, eq. 13, and
/// RE_Direct / RE_IndirectDiffuse of lights_lambert_pars_fragment.glsl.js: irradiance times BRDF_Lambert = albedo / pi.
Rgb three_irradiance(const ThreeScene& scene, ThreeLights lights, const V3& normal);

/// filament::IndirectLight and a LightManager directional light. Exposure one.
struct FilamentScene {
  std::array<std::array<double, 3>, 9> irradiance{};  ///< Of Builder::irradiance(3, sh).
  std::array<std::array<double, 3>, 9> radiance{};    ///< Of Builder::radiance(3, sh).
  double indirect_intensity = 0;
  std::array<double, 3> light_direction{};  ///< LightManager::Builder::direction: direction of travel of the light.
  std::array<double, 3> light_color{};
  double light_intensity_lux = 0;
};

/// Irradiance_SphericalHarmonics() of light_indirect.fs, Fd_Lambert baked in, times the intensity.
Rgb filament_irradiance(const FilamentScene& scene, const V3& normal);

/// The same for Builder::radiance(): sh[i] times A_l^m C_l / pi of the table in IndirectLight.h, whose A_l^m have the
/// Condon-Shortley signs, first.
Rgb filament_irradiance_from_radiance(const FilamentScene& scene, const V3& normal);

/// FSHVectorRGB3 of a sky light, and a directional light in lux.
struct UnrealScene {
  std::array<double, 9> r{}, g{}, b{};    ///< FSHVectorRGB3::R.V, G.V, B.V.
  std::array<double, 3> light_forward{};  ///< GetForwardVector(): direction of travel of the light.
  std::array<double, 3> light_color{};    ///< Linear.
  double light_intensity_lux = 0;
};

/// GetSkySHDiffuse() (ReflectionEnvironmentShared.ush) of what SetupSkyIrradianceEnvironmentMapConstants
/// (SceneRendering.cpp) packs: Sloan 2008, appendix A10, in the functions with the phase, times albedo; and for the
/// directional light Diffuse_Lambert = albedo / pi times lux times n.l (BRDF.ush).
Rgb unreal_irradiance(const UnrealScene& scene, const V3& normal);

/// SHBasisFunction() of Math/SHMath.h at a unit direction in Unreal's axes, to test a projection without the diffuse
/// packing.
std::array<double, 9> unreal_basis(const V3& direction);

}  // namespace lightwell::reference::engines
