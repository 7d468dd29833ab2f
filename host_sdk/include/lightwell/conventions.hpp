// Light in other engines' own terms: a value type for each, in its own words, order, axes and units.
//   Converted, ConversionOptions                   what all conversions have in common
//   WebXrLightEstimate, ArCoreLightEstimate, OpenXrLightEstimate, ArKitLightEstimate      AR platforms
//   UnityLighting, ThreeLighting, FilamentLighting, UnrealLighting                         renderers
//
// Members are spelt as the target spells them. A sphere lit by the target with these numbers is lit as
// Lighting::irradiance says, but for what the target cannot hold: bands above 2 of the harmonics and of all lights but
// the main one, and how wide that is. Converted::residual is that, as a number.
//
// The main light, where it is handed out apart, is in the harmonics no more. All other lights are in the harmonics. Of
// a wide main light the harmonics hold what a light from one direction does not reproduce in bands 0 to 2, so that both
// together are the whole.
//
// Axes: the target's own "right, up, forward" are ours. Turn the light into the application's world first
// (Lighting::in_world), in our axes; the conversion changes handedness.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include <lightwell/exposure.hpp>
#include <lightwell/lighting.hpp>

namespace lightwell {

/// Whether Converted::residual is worked out, which costs more than the conversion (about 512 queries).
enum class Residual : std::uint8_t { measured, left_out };

/// Where the strongest light goes, where the target leaves the choice.
enum class MainLight : std::uint8_t {
  apart,         ///< The target's own directional light: sharp shading, shadows, highlights.
  in_harmonics,  ///< Nowhere else; the directional light is dark.
};

struct ConversionOptions {
  /// Applied to every colour: the target's unit, exposure and white point. mapping_of() of a camera makes a lit white
  /// patch look as in its picture; the identity leaves cd/m² and lux. Negative channels that a map of white points
  /// makes of saturated light go into the harmonics, never into a directional light.
  ColorMatrix color;
  Residual residual = Residual::measured;

  /// invalid_argument names the field.
  [[nodiscard]] Status validate() const;
};

/// A value in the target's terms, and what it is worth.
template <class T>
struct Converted {
  /// Where there is no estimate: the target's own way of saying so, which stands at each type.
  T value{};
  /// Of the Lighting. invalid_query for options that are not finite, and for light that is not.
  Validity validity = Validity::none;
  /// Error of the irradiance by what the target cannot hold: RMS over 512 Fibonacci normals and three channels,
  /// relative to the RMS irradiance, both after ConversionOptions::color. Lighting's own bound comes on top.
  std::optional<float> residual;

  /// valid or stale.
  [[nodiscard]] bool has_estimate() const { return validity == Validity::valid || validity == Validity::stale; }
};

// --- AR platforms ---

/// Signs of the nine functions. Both are real and orthonormal, in the order l(l+1)+m.
enum class ShSigns : std::uint8_t {
  condon_shortley,  ///< Odd m negative, as in ARCore: -y, z, -x; xy, -yz, 3z²-1, -xz, x²-y².
  positive,         ///< All positive, as in Ramamoorthi & Hanrahan 2001, in three.js and in our own descriptors.
};

/// DOMPointReadOnly.
struct DomPoint {
  float x = 0, y = 0, z = 0, w = 0;

  friend bool operator==(const DomPoint&, const DomPoint&) = default;
};

/// XRLightEstimate (WebXR Lighting Estimation API Level 1, section 2.3). No estimate: getLightEstimate() returns null,
/// which is has_estimate() here; the members have what the specification prescribes for what is not available.
struct WebXrLightEstimate {
  std::array<float, 27> sphericalHarmonicsCoefficients{};  ///< r, g, b of each; radiance without the primary light.
  DomPoint primaryLightDirection{0, 1, 0, 0};              ///< Towards the light; unit.
  DomPoint primaryLightIntensity{0, 0, 0, 1};              ///< Irradiance at normal incidence, r g b as x y z; >= 0.
};

/// The specification leaves the signs open. Browsers hand ARCore's through; three.js reads positive ones.
[[nodiscard]] Converted<WebXrLightEstimate> to_webxr(const Lighting& lighting, ShSigns signs = ShSigns::condon_shortley,
                                                     const ConversionOptions& options = {});

/// com.google.ar.core.LightEstimate.State.
enum class ArLightEstimateState : std::int32_t {
  AR_LIGHT_ESTIMATE_STATE_NOT_VALID = 0,
  AR_LIGHT_ESTIMATE_STATE_VALID = 1,
};

/// com.google.ar.core.LightEstimate, Environmental HDR. No estimate: state. As in Google's samples, E(harmonics) +
/// E(main light) is all of the light; the shader divides by pi.
struct ArCoreLightEstimate {
  ArLightEstimateState state = ArLightEstimateState::AR_LIGHT_ESTIMATE_STATE_NOT_VALID;
  std::int64_t timestamp = 0;  ///< Mid-exposure, ns of the host's CLOCK_MONOTONIC.
  std::array<float, 3> environmentalHdrMainLightDirection{0, 1, 0};   ///< Towards the light; unit; world axes.
  std::array<float, 3> environmentalHdrMainLightIntensity{};          ///< Irradiance at normal incidence.
  std::array<float, 27> environmentalHdrAmbientSphericalHarmonics{};  ///< r, g, b of each; ShSigns::condon_shortley.
};

[[nodiscard]] Converted<ArCoreLightEstimate> to_arcore(const Lighting& lighting, const ConversionOptions& options = {});

/// XrLightEstimateStateANDROID.
enum class XrLightEstimateState : std::int32_t { valid = 0, invalid = 1 };

/// XrSphericalHarmonicsKindANDROID.
enum class XrSphericalHarmonicsKind : std::int32_t {
  total = 0,    ///< Including the main light.
  ambient = 1,  ///< Excluding it.
};

/// The structures of XR_ANDROID_light_estimation (OpenXR registry), without type and next. Axes are those of the
/// XrSpace that the light was turned into. No estimate: every state is invalid.
struct OpenXrLightEstimate {
  XrLightEstimateState state = XrLightEstimateState::invalid;  ///< XrLightEstimateANDROID.
  /// Mid-exposure, ns of the host's CLOCK_MONOTONIC: XR_KHR_convert_timespec_time makes an XrTime of it.
  std::int64_t lastUpdatedTime = 0;

  struct AmbientLight {
    XrLightEstimateState state = XrLightEstimateState::invalid;
    /// The extension does not say of what. Here: the mean radiance of what `sphericalHarmonics` holds.
    std::array<float, 3> intensity{};
    std::array<float, 3> colorCorrection{1, 1, 1};  ///< None: ConversionOptions::color is applied already.
  } ambientLight;

  struct SphericalHarmonics {
    XrLightEstimateState state = XrLightEstimateState::invalid;
    XrSphericalHarmonicsKind kind = XrSphericalHarmonicsKind::total;
    std::array<std::array<float, 3>, 9> coefficients{};  ///< Radiance.
  } sphericalHarmonics;

  /// Invalid beside TOTAL harmonics, which hold it already, and where there is no light.
  struct DirectionalLight {
    XrLightEstimateState state = XrLightEstimateState::invalid;
    std::array<float, 3> intensity{};         ///< Irradiance at normal incidence.
    std::array<float, 3> direction{0, 1, 0};  ///< Towards the light; unit.
  } directionalLight;
};

/// The extension names no functions. The default is what ARCore's users, whom it serves, and Chromium take it for; the
/// paper that it cites has positive signs.
[[nodiscard]] Converted<OpenXrLightEstimate> to_openxr(const Lighting& lighting, XrSphericalHarmonicsKind kind,
                                                       ShSigns signs = ShSigns::condon_shortley,
                                                       const ConversionOptions& options = {});

/// ARDirectionalLightEstimate. The harmonics hold ALL light; the primary light repeats the strongest of it for
/// renderers that have no harmonics: use one or the other. No estimate: ARFrame.lightEstimate is nil, which is
/// has_estimate() here.
struct ArKitLightEstimate {
  /// Nine of red, nine of green, nine of blue; radiance, ShSigns::positive. Apple names no functions: untested on a
  /// device.
  std::array<float, 27> sphericalHarmonicsCoefficients{};
  /// Where it shines, the light's orientation; unit; world axes. Straight down without a light.
  std::array<float, 3> primaryLightDirection{0, -1, 0};
  /// "Lumens", 1000 is neutral, as of an SCNLight: a white patch that faces it has the picture value 1.
  float primaryLightIntensity = 0;
  /// Of all light, 1000 is neutral: the mean radiance has the picture value 1.
  float ambientIntensity = 0;
  float ambientColorTemperature = 6500;  ///< K, of the mean radiance (McCamy 1992).
};

/// options.color is what makes 1 the picture's white; cd/m² are far from neutral.
[[nodiscard]] Converted<ArKitLightEstimate> to_arkit(const Lighting& lighting, const ConversionOptions& options = {});

// --- Renderers ---

/// What a Unity light's intensity means.
enum class UnityPipeline : std::uint8_t {
  universal,        ///< Built-in and URP: a white surface reflects intensity times n.l, so the irradiance over pi.
  high_definition,  ///< HDRP: lux.
};

/// SphericalHarmonicsL2 and a directional Light. Left-handed, +Y up, +Z forward. No estimate: all zero.
struct UnityLighting {
  /// this[rgb, coefficient] at 9 rgb + coefficient. Pre-scaled as RenderSettings.ambientProbe is: of 1, y, z, x, xy,
  /// yz, 3z²-1, xz, x²-y² of the normal, and the sum is the irradiance over pi.
  std::array<float, 27> sphericalHarmonicsL2{};
  std::array<float, 3> forward{0, -1, 0};  ///< Light.transform.forward: where it shines; unit.
  std::array<float, 3> color{1, 1, 1};     ///< Linear, largest channel 1: Light.color = color.gamma.
  float intensity = 0;
};

[[nodiscard]] Converted<UnityLighting> to_unity(const Lighting& lighting, UnityPipeline pipeline,
                                                MainLight main_light = MainLight::apart,
                                                const ConversionOptions& options = {});

/// What three.js multiplies direct light by.
enum class ThreeLights : std::uint8_t {
  physical,  ///< r155 and later, and useLegacyLights = false: intensity is irradiance.
  legacy,    ///< useLegacyLights = true: direct light times pi; a LightProbe is not.
};

/// LightProbe and DirectionalLight of three.js. Right-handed, +Y up. No estimate: intensities are 0.
struct ThreeLighting {
  /// LightProbe.sh.fromArray(sh): r, g, b of each coefficient of radiance, ShSigns::positive. three.js does the
  /// cosine's convolution, and its materials divide by pi.
  std::array<float, 27> sh{};
  float lightProbeIntensity = 0;           ///< LightProbe.intensity: 1.
  std::array<float, 3> position{0, 1, 0};  ///< DirectionalLight.position, target at the origin: towards the light.
  std::array<float, 3> color{1, 1, 1};     ///< Linear, largest channel 1: Color.setRGB.
  float intensity = 0;
};

[[nodiscard]] Converted<ThreeLighting> to_three(const Lighting& lighting, ThreeLights lights = ThreeLights::physical,
                                                MainLight main_light = MainLight::apart,
                                                const ConversionOptions& options = {});

/// IndirectLight::Builder and LightManager::Builder (DIRECTIONAL or SUN). Right-handed, +Y up. No estimate: intensities
/// are 0. A reflections cubemap of cmgen's is mirrored unless made with --no-mirror; these are not.
struct FilamentLighting {
  /// irradiance(3, sh): pre-convolved, over pi, times the reconstruction factors. What the shader evaluates as it is.
  std::array<std::array<float, 3>, 9> irradiance{};
  /// radiance(3, sh): the same light for the other builder function; ShSigns::condon_shortley.
  std::array<std::array<float, 3>, 9> radiance{};
  float indirectIntensity = 0;               ///< intensity(): 1, as the harmonics are in cd/m² already.
  std::array<float, 3> direction{0, -1, 0};  ///< Where it shines; unit.
  std::array<float, 3> color{1, 1, 1};       ///< Linear, largest channel 1.
  float intensity = 0;                       ///< Lux.
  float sunAngularRadius = 0;                ///< Degrees; Filament takes 0.25 to 20.
};

[[nodiscard]] Converted<FilamentLighting> to_filament(const Lighting& lighting, MainLight main_light = MainLight::apart,
                                                      const ConversionOptions& options = {});

/// FSHVectorRGB3 of a sky light (FSkyLightSceneProxy::IrradianceEnvironmentMap) and a directional light. Left-handed,
/// X forward, Y right, Z up; a direction has no centimetres. No estimate: all zero.
struct UnrealLighting {
  /// R.V, G.V, B.V: radiance, in the functions of SHMath.h, ShSigns::condon_shortley of Unreal's axes.
  std::array<float, 9> R{}, G{}, B{};
  std::array<float, 3> forward{0, 0, -1};  ///< GetForwardVector(): where it shines; unit.
  std::array<float, 3> color{1, 1, 1};     ///< FLinearColor, largest channel 1.
  float intensity = 0;                     ///< Lux.
  float lightSourceAngle = 0;              ///< Degrees across.
};

[[nodiscard]] Converted<UnrealLighting> to_unreal(const Lighting& lighting, MainLight main_light = MainLight::apart,
                                                  const ConversionOptions& options = {});

}  // namespace lightwell
