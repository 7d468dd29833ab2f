// Linear colour: Rec. 709 primaries, D65. Radiance and irradiance are different types.
#pragma once

#include <numbers>

namespace lightwell {

/// Rec. 709 luminance weights of linear r, g, b.
inline constexpr float kLuminanceWeights[3] = {0.2126F, 0.7152F, 0.0722F};

/// Luminance of three linear channels, in the unit of the channels.
template <class Real>
[[nodiscard]] constexpr Real luminance_of(Real r, Real g, Real b) {
  return Real{kLuminanceWeights[0]} * r + Real{kLuminanceWeights[1]} * g + Real{kLuminanceWeights[2]} * b;
}

/// Three linear channels of one physical quantity. Sums only meet their like.
template <class Quantity>
struct Rgb {
  float r = 0, g = 0, b = 0;

  friend constexpr Rgb operator+(Rgb a, Rgb o) { return {a.r + o.r, a.g + o.g, a.b + o.b}; }
  friend constexpr Rgb operator-(Rgb a, Rgb o) { return {a.r - o.r, a.g - o.g, a.b - o.b}; }
  friend constexpr Rgb operator*(Rgb a, float s) { return {a.r * s, a.g * s, a.b * s}; }
  friend constexpr Rgb operator*(float s, Rgb a) { return a * s; }
  constexpr Rgb& operator+=(Rgb o) { return *this = *this + o; }
  friend constexpr bool operator==(const Rgb&, const Rgb&) = default;

  [[nodiscard]] constexpr float operator[](int channel) const { return channel == 0 ? r : channel == 1 ? g : b; }
  [[nodiscard]] constexpr float& operator[](int channel) { return channel == 0 ? r : channel == 1 ? g : b; }
  /// cd/m² of a radiance, lux of an irradiance, where units are absolute.
  [[nodiscard]] constexpr float luminance() const { return luminance_of(r, g, b); }
};

struct RadianceTag {};
struct IrradianceTag {};

/// Light per area and solid angle, from a direction. Luminance in cd/m² where units are absolute.
using Radiance = Rgb<RadianceTag>;
/// Light per area, from everywhere. Luminance in lux where units are absolute. Never divided by pi in silence.
using Irradiance = Rgb<IrradianceTag>;

/// Share of light that a surface sends back, per channel, 0 to 1.
struct Albedo {
  float r = 0, g = 0, b = 0;
};

/// What a matte surface sends back: albedo / pi * E.
[[nodiscard]] constexpr Radiance reflected_radiance(Irradiance e, Albedo albedo) {
  constexpr float k = std::numbers::inv_pi_v<float>;
  return {e.r * albedo.r * k, e.g * albedo.g * k, e.b * albedo.b * k};
}

}  // namespace lightwell
