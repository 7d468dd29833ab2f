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

/// Three linear channels of one physical quantity. Only equal quantities can be added.
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
  /// Luminance in cd/m² of a radiance, illuminance in lux of an irradiance, if units are absolute.
  [[nodiscard]] constexpr float luminance() const { return luminance_of(r, g, b); }
};

struct RadianceTag {};
struct IrradianceTag {};

/// Radiance from a direction. Its luminance is in cd/m² if units are absolute.
using Radiance = Rgb<RadianceTag>;
/// Irradiance of a surface. Its luminance is in lux if units are absolute. Not divided by pi.
using Irradiance = Rgb<IrradianceTag>;

/// Fraction of light that a surface reflects, per channel, 0 to 1.
struct Albedo {
  float r = 0, g = 0, b = 0;
};

/// Radiance reflected by a matte (Lambertian) surface: albedo / pi * E.
[[nodiscard]] constexpr Radiance reflected_radiance(Irradiance e, Albedo albedo) {
  constexpr float k = std::numbers::inv_pi_v<float>;
  return {e.r * albedo.r * k, e.g * albedo.g * k, e.b * albedo.b * k};
}

}  // namespace lightwell
