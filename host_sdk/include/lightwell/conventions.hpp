// Conversions to other engines' lighting types: a value type for each, with the target's names, order, axes and units.
// Members are named as in the target. A sphere lit by the target with these values has the irradiance of
// Lighting::irradiance, except for what the target cannot represent: SH bands above 2 of the harmonics and of all
// lights but the main one, and the size of the main light. Converted::residual is the resulting error.
//
// A separate main light is not contained in the harmonics; all other lights are. For a wide main light, the harmonics
// hold the difference in bands 0 to 2 between its cap and a directional light, so that the sum is complete.
//
// Axes: the target's "right, up, forward" correspond to Lightwell's. Transform the lighting to the application's world
// first (Lighting::in_world), in Lightwell's axes; the conversion changes handedness.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include <lightwell/exposure.hpp>
#include <lightwell/lighting.hpp>

namespace lightwell {

/// Whether Converted::residual is computed, which costs more than the conversion (about 512 queries).
enum class Residual : std::uint8_t { measured, left_out };

/// How the strongest light is represented, for targets that allow both.
enum class MainLight : std::uint8_t {
  apart,         ///< As the target's directional light: sharp shading, shadows, highlights.
  in_harmonics,  ///< In the harmonics only; the directional light is zero.
};

struct ConversionOptions {
  /// Applied to every colour: the target's unit, exposure and white point. With mapping_of() of a camera, a lit white
  /// patch looks as in its picture; the identity keeps cd/m² and lux. Negative channels, which chromatic adaptation
  /// produces for saturated light, go into the harmonics, never into a directional light.
  ColorMatrix color;
  Residual residual = Residual::measured;

  /// invalid_argument names the field.
  [[nodiscard]] Status validate() const;
};

/// A value of the target's type, with its validity and representation error.
template <class T>
struct Converted {
  /// Without an estimate, the target's own representation of that, which is stated at each type.
  T value{};
  /// Validity of the Lighting; invalid_query if the options or the lighting are not finite.
  Validity validity = Validity::none;
  /// Irradiance error due to what the target cannot represent: RMS over 512 normals on a Fibonacci lattice and three
  /// channels, relative to the RMS irradiance, both after ConversionOptions::color. The error bound of the Lighting
  /// comes on top.
  std::optional<float> residual;

  /// valid or stale.
  [[nodiscard]] bool has_estimate() const { return validity == Validity::valid || validity == Validity::stale; }
};

// --- AR platforms ---

/// Sign convention of the nine basis functions. Both are real and orthonormal, in the order l(l+1)+m.
enum class ShSigns : std::uint8_t {
  condon_shortley,  ///< Odd m negative, as in ARCore: -y, z, -x; xy, -yz, 3z²-1, -xz, x²-y².
  positive,         ///< All positive, as in Ramamoorthi & Hanrahan 2001, in three.js and in Lightwell's descriptors.
};

/// DOMPointReadOnly.
struct DomPoint {
  float x = 0, y = 0, z = 0, w = 0;

  friend bool operator==(const DomPoint&, const DomPoint&) = default;
};

/// XRLightEstimate (WebXR Lighting Estimation API Level 1, section 2.3). Without an estimate, getLightEstimate()
/// returns null (here: has_estimate() is false); the members have the specification's values for unavailable data.
struct WebXrLightEstimate {
  std::array<float, 27> sphericalHarmonicsCoefficients{};  ///< r, g, b of each; radiance without the primary light.
  DomPoint primaryLightDirection{0, 1, 0, 0};              ///< Towards the light; unit.
  DomPoint primaryLightIntensity{0, 0, 0, 1};              ///< Irradiance at normal incidence, r g b as x y z; >= 0.
};

/// The specification does not define the signs. Browsers pass on ARCore's; three.js expects positive ones.
[[nodiscard]] Converted<WebXrLightEstimate> to_webxr(const Lighting& lighting, ShSigns signs = ShSigns::condon_shortley,
                                                     const ConversionOptions& options = {});

/// com.google.ar.core.LightEstimate.State.
enum class ArLightEstimateState : std::int32_t {
  AR_LIGHT_ESTIMATE_STATE_NOT_VALID = 0,
  AR_LIGHT_ESTIMATE_STATE_VALID = 1,
};

/// com.google.ar.core.LightEstimate, Environmental HDR. Without an estimate, `state` is NOT_VALID. As in Google's
/// samples, E(harmonics) + E(main light) is the total irradiance; the shader divides by pi.
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
  ambient = 1,  ///< Excluding the main light.
};

/// The structures of XR_ANDROID_light_estimation (OpenXR registry), without type and next. Axes are those of the
/// XrSpace into which the lighting was transformed. Without an estimate, every state is invalid.
struct OpenXrLightEstimate {
  XrLightEstimateState state = XrLightEstimateState::invalid;  ///< XrLightEstimateANDROID.
  /// Mid-exposure, ns of the host's CLOCK_MONOTONIC; XR_KHR_convert_timespec_time converts it to an XrTime.
  std::int64_t lastUpdatedTime = 0;

  struct AmbientLight {
    XrLightEstimateState state = XrLightEstimateState::invalid;
    /// The extension does not define the quantity. Here: the mean radiance of `sphericalHarmonics`.
    std::array<float, 3> intensity{};
    std::array<float, 3> colorCorrection{1, 1, 1};  ///< Always 1: ConversionOptions::color is applied already.
  } ambientLight;

  struct SphericalHarmonics {
    XrLightEstimateState state = XrLightEstimateState::invalid;
    XrSphericalHarmonicsKind kind = XrSphericalHarmonicsKind::total;
    std::array<std::array<float, 3>, 9> coefficients{};  ///< Radiance.
  } sphericalHarmonics;

  /// Invalid with TOTAL harmonics, which include it already, and if there is no light.
  struct DirectionalLight {
    XrLightEstimateState state = XrLightEstimateState::invalid;
    std::array<float, 3> intensity{};         ///< Irradiance at normal incidence.
    std::array<float, 3> direction{0, 1, 0};  ///< Towards the light; unit.
  } directionalLight;
};

/// The extension does not define the basis functions. The default signs are those that ARCore applications and Chromium
/// assume; the paper that the extension cites has positive signs.
[[nodiscard]] Converted<OpenXrLightEstimate> to_openxr(const Lighting& lighting, XrSphericalHarmonicsKind kind,
                                                       ShSigns signs = ShSigns::condon_shortley,
                                                       const ConversionOptions& options = {});

/// ARDirectionalLightEstimate. The harmonics hold ALL light; the primary light repeats the strongest light for
/// renderers without harmonics: use one or the other. Without an estimate, ARFrame.lightEstimate is nil (here:
/// has_estimate() is false).
struct ArKitLightEstimate {
  /// Nine coefficients of red, nine of green, nine of blue; radiance, ShSigns::positive. Apple does not define the
  /// basis functions: untested on a device.
  std::array<float, 27> sphericalHarmonicsCoefficients{};
  /// Direction in which the light shines (away from it); unit; world axes. Straight down without a light.
  std::array<float, 3> primaryLightDirection{0, -1, 0};
  /// "Lumens" as of an SCNLight, 1000 is neutral: a white patch that faces the light has the picture value 1.
  float primaryLightIntensity = 0;
  /// Of all light, 1000 is neutral: the mean radiance has the picture value 1.
  float ambientIntensity = 0;
  float ambientColorTemperature = 6500;  ///< K, of the mean radiance (McCamy 1992).
};

/// options.color must map white to the picture value 1; unscaled cd/m² are far from neutral.
[[nodiscard]] Converted<ArKitLightEstimate> to_arkit(const Lighting& lighting, const ConversionOptions& options = {});

// --- Renderers ---

/// Unit of a Unity light's intensity.
enum class UnityPipeline : std::uint8_t {
  universal,        ///< Built-in and URP: irradiance over pi (a white surface reflects intensity times n.l).
  high_definition,  ///< HDRP: lux.
};

/// SphericalHarmonicsL2 and a directional Light. Left-handed, +Y up, +Z forward. Without an estimate, all zero.
struct UnityLighting {
  /// this[rgb, coefficient] at 9 rgb + coefficient. Pre-scaled as RenderSettings.ambientProbe: coefficients of 1, y, z,
  /// x, xy, yz, 3z²-1, xz, x²-y² of the normal, whose sum is the irradiance over pi.
  std::array<float, 27> sphericalHarmonicsL2{};
  std::array<float, 3> forward{0, -1, 0};  ///< Light.transform.forward, the direction in which it shines; unit.
  std::array<float, 3> color{1, 1, 1};     ///< Linear, largest channel 1: Light.color = color.gamma.
  float intensity = 0;
};

[[nodiscard]] Converted<UnityLighting> to_unity(const Lighting& lighting, UnityPipeline pipeline,
                                                MainLight main_light = MainLight::apart,
                                                const ConversionOptions& options = {});

/// Factor that three.js applies to direct light.
enum class ThreeLights : std::uint8_t {
  physical,  ///< r155 and later, and useLegacyLights = false: intensity is irradiance.
  legacy,    ///< useLegacyLights = true: direct light is multiplied by pi, a LightProbe is not.
};

/// LightProbe and DirectionalLight of three.js. Right-handed, +Y up. Without an estimate, intensities are 0.
struct ThreeLighting {
  /// LightProbe.sh.fromArray(sh): r, g, b of each coefficient of radiance, ShSigns::positive. three.js convolves with
  /// the cosine lobe, and its materials divide by pi.
  std::array<float, 27> sh{};
  float lightProbeIntensity = 0;           ///< LightProbe.intensity: 1.
  std::array<float, 3> position{0, 1, 0};  ///< DirectionalLight.position, target at the origin: towards the light.
  std::array<float, 3> color{1, 1, 1};     ///< Linear, largest channel 1: Color.setRGB.
  float intensity = 0;
};

[[nodiscard]] Converted<ThreeLighting> to_three(const Lighting& lighting, ThreeLights lights = ThreeLights::physical,
                                                MainLight main_light = MainLight::apart,
                                                const ConversionOptions& options = {});

/// IndirectLight::Builder and LightManager::Builder (DIRECTIONAL or SUN). Right-handed, +Y up. Without an estimate,
/// intensities are 0. cmgen mirrors reflection cube maps unless called with --no-mirror; these harmonics are not
/// mirrored.
struct FilamentLighting {
  /// irradiance(3, sh): pre-convolved, over pi, times the reconstruction factors; the shader evaluates them unchanged.
  std::array<std::array<float, 3>, 9> irradiance{};
  /// radiance(3, sh): the same light for the other builder function; ShSigns::condon_shortley.
  std::array<std::array<float, 3>, 9> radiance{};
  float indirectIntensity = 0;               ///< intensity(): 1, as the harmonics are in cd/m² already.
  std::array<float, 3> direction{0, -1, 0};  ///< Direction in which it shines; unit.
  std::array<float, 3> color{1, 1, 1};       ///< Linear, largest channel 1.
  float intensity = 0;                       ///< Lux.
  float sunAngularRadius = 0;                ///< Degrees; Filament takes 0.25 to 20.
};

[[nodiscard]] Converted<FilamentLighting> to_filament(const Lighting& lighting, MainLight main_light = MainLight::apart,
                                                      const ConversionOptions& options = {});

/// FSHVectorRGB3 of a sky light (FSkyLightSceneProxy::IrradianceEnvironmentMap) and a directional light. Left-handed,
/// X forward, Y right, Z up; directions have no unit. Without an estimate, all zero.
struct UnrealLighting {
  /// R.V, G.V, B.V: radiance, in the basis of SHMath.h: ShSigns::condon_shortley in Unreal's axes.
  std::array<float, 9> R{}, G{}, B{};
  std::array<float, 3> forward{0, 0, -1};  ///< GetForwardVector(), the direction in which it shines; unit.
  std::array<float, 3> color{1, 1, 1};     ///< FLinearColor, largest channel 1.
  float intensity = 0;                     ///< Lux.
  float lightSourceAngle = 0;              ///< Angular diameter, degrees.
};

[[nodiscard]] Converted<UnrealLighting> to_unreal(const Lighting& lighting, MainLight main_light = MainLight::apart,
                                                  const ConversionOptions& options = {});

}  // namespace lightwell
