// The light in the few numbers that AR platforms' light estimation gives: intensity in lumens, colour temperature, main
// light. With a gain, a fade while a probe is gone, and the choice of what is estimated.
//   color_temperature    correlated colour temperature and distance from the Planckian locus
//   estimate_light       the numbers of a Lighting
//   fade_weight          weight of the light of a probe that no longer sends
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include <lightwell/conventions.hpp>

namespace lightwell {

struct ColorTemperature {
  double kelvin = 0;
  /// Distance from the Planckian locus in CIE 1960 u, v: positive above it (greenish), negative below (pinkish).
  double duv = 0;
};

/// Largest |Duv| at which a colour temperature has a meaning (CIE 15:2004, 9.5).
inline constexpr double kMaxDuv = 0.05;

/// Correlated colour temperature: that of the nearest point of the Planckian locus in CIE 1960 u, v (CIE 15:2004, 9.5),
/// found as in Ohno, "Practical Use and Calculation of CCT and Duv", LEUKOS 10(1), 2014, from a table of the locus,
/// here with a cubic through four entries in place of his triangle and parabola. Within 0.03 % of the integration of
/// Planck's law, from 1,000 to 100,000 K. No value where it has no meaning: |Duv| above kMaxDuv, or a nearest point
/// beyond that range.
[[nodiscard]] std::optional<ColorTemperature> color_temperature(Chromaticity c);
/// Of a colour in linear Rec. 709; no value for black.
[[nodiscard]] std::optional<ColorTemperature> color_temperature(float r, float g, float b);

/// What an application wants to know: bits, with the numbers of AR Foundation's LightEstimation. An application that
/// leaves one out gets nothing from which it could be computed, except that harmonics hold all light, blurred.
/// Harmonics alone tell least about a room: no direction of a light sharper than 60 degrees.
enum class LightRequest : std::uint32_t {
  none = 0,
  ambient_intensity = 1U << 0,
  ambient_color = 1U << 1,
  ambient_spherical_harmonics = 1U << 2,
  main_light_direction = 1U << 3,
  main_light_intensity = 1U << 4,
  all = (1U << 5) - 1,
};
[[nodiscard]] constexpr LightRequest operator|(LightRequest a, LightRequest b) {
  return static_cast<LightRequest>(static_cast<std::uint32_t>(a) | static_cast<std::uint32_t>(b));
}
[[nodiscard]] constexpr bool has(LightRequest set, LightRequest part) {
  return (static_cast<std::uint32_t>(set) & static_cast<std::uint32_t>(part)) == static_cast<std::uint32_t>(part);
}

struct LightEstimateOptions {
  LightRequest requested = LightRequest::all;
  /// Factor on all light, above 0 and finite: an artist's choice, or a weight. It does not change colours.
  float gain = 1;
  /// The illuminance, lux, at which intensities are "1000 lumens", ARKit's neutral. 1000: lumens are lux. For a camera
  /// picture pi / exposure(ev100), at which a white patch has the picture value 1. Above 0 and finite.
  float neutral_illuminance = 1000;

  /// invalid_argument names the field.
  [[nodiscard]] Status validate() const;
};

/// The light in a few numbers; zero where a value was not requested or there is none (`available`). Intensities are in
/// proportion only, if units are relative.
struct LightEstimate {
  /// What was requested and is known: a colour not of darkness, a main light only if there is one.
  LightRequest available = LightRequest::none;
  /// ARKit's ambientIntensity, AR Foundation's averageIntensityInLumens: 1000 * gain * mean_illuminance /
  /// neutral_illuminance. Platforms say "lumens"; the quantity is an illuminance (lumens per square metre) in a
  /// picture's exposure, not the luminous flux of a light source.
  float ambient_lumens = 0;
  /// Mean of the illuminance over all orientations of a surface, lux: pi times the mean luminance, a quarter of the
  /// spherical illuminance (CIE S 017, 17-21-063). Main light included; times gain.
  float mean_illuminance = 0;
  /// Of all light, K: AR Foundation's averageColorTemperature. 0 where it has no meaning (color_temperature()).
  float color_temperature = 0;
  float duv = 0;
  /// Of all light, linear, largest channel 1: the chromatic part of ARCore's colorCorrection.
  std::array<float, 3> ambient_color{};
  /// Nine coefficients, r, g, b of each, as descriptors have them (radiance, ShSigns::positive), times gain. Without
  /// the main light if both its direction and its intensity are requested; with all light otherwise.
  std::array<float, 27> ambient_spherical_harmonics{};
  /// Towards the main light, the strongest one; unit.
  std::array<float, 3> main_light_direction{};
  /// Linear, largest channel 1; with main_light_intensity.
  std::array<float, 3> main_light_color{};
  /// 1000 * gain * (its illuminance at normal incidence) / neutral_illuminance: AR Foundation's
  /// mainLightIntensityLumens.
  float main_light_lumens = 0;
};

/// Validity is that of the lighting; invalid_query for options that validate() refuses. No residual.
[[nodiscard]] Converted<LightEstimate> estimate_light(const Lighting& lighting,
                                                      const LightEstimateOptions& options = {});

/// How the light of a probe gives way to an application's own light once no descriptor arrives.
struct FadeTimes {
  Duration hold = Lighting::kDefaultMaxAge;  ///< Up to this age the weight is 1; not negative.
  Duration fade{500'000'000};                ///< Then it falls to 0 within this time; not negative. 0: at once.

  /// invalid_argument names the field.
  [[nodiscard]] Status validate() const;
};

/// Weight of the probe's light at an age: 1 up to `hold`, 0 after `hold + fade`, between them 1 - t² (3 - 2 t), which
/// has no kinks. A pure function: evaluate it every frame, and light with weight * probe + (1 - weight) * own. For
/// light that comes back, 1 - fade_weight(time since it is back, {0, fade}). invalid_argument: the times.
[[nodiscard]] Result<float> fade_weight(Duration age, const FadeTimes& times);
/// For a lighting of Probe::latest(): by its age; 0 without light.
[[nodiscard]] Result<float> fade_weight(const Lighting& lighting, const FadeTimes& times);

}  // namespace lightwell
