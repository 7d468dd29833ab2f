// From light to the values of a picture: exposure and white point, so that a lit white patch looks as bright, and as
// white, as a real one in the picture of a pass-through camera.
//   ColorMatrix                         a linear map of linear colour; what conversions (conventions.hpp) take
//   CameraExposure, ev100, exposure     ISO 12232, saturation-based
//   Chromaticity, white_adaptation      white points, Bradford
//   PassThroughCamera, VarjoWhiteBalance, mapping_of   what a camera tells of itself
//   mapping_of_patch                    what a patch in its picture tells
//
// Where units are relative, all of it holds but for one unknown factor: mapping_of_patch() finds that, too.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <lightwell/color.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// A linear map of linear r, g, b (columns), row by row. The identity leaves cd/m² and lux as they are.
struct ColorMatrix {
  std::array<std::array<float, 3>, 3> m{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

  [[nodiscard]] static constexpr ColorMatrix gains(float r, float g, float b) {
    return {{{{r, 0, 0}, {0, g, 0}, {0, 0, b}}}};
  }
  [[nodiscard]] static constexpr ColorMatrix scale(float s) { return gains(s, s, s); }

  [[nodiscard]] bool finite() const {
    for (const auto& row : m)
      for (const float v : row)
        if (!std::isfinite(v)) return false;
    return true;
  }

  /// First b, then a.
  friend constexpr ColorMatrix operator*(const ColorMatrix& a, const ColorMatrix& b) {
    ColorMatrix out;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j)
        out.m[i][j] = a.m[i][0] * b.m[0][j] + a.m[i][1] * b.m[1][j] + a.m[i][2] * b.m[2][j];
    return out;
  }

  template <class Quantity>
  friend constexpr Rgb<Quantity> operator*(const ColorMatrix& a, Rgb<Quantity> c) {
    const auto row = [&](std::size_t i) { return a.m[i][0] * c.r + a.m[i][1] * c.g + a.m[i][2] * c.b; };
    return {row(0), row(1), row(2)};
  }

  friend bool operator==(const ColorMatrix&, const ColorMatrix&) = default;
};

/// What a camera was set to.
struct CameraExposure {
  double f_number = 0;  ///< N of f/N.
  double shutter_s = 0;
  double iso = 0;  ///< Sensitivity S of ISO 12232.
};

/// log2(N² / t * 100 / S): the exposure value at ISO 100 (Lagarde & de Rousiers 2014, "Moving Frostbite to PBR",
/// section 5.1.1). invalid_argument names the field that is not positive and finite.
[[nodiscard]] Result<double> ev100(const CameraExposure& camera);

/// The luminance in cd/m² that saturates the picture: 78 / (100 q) 2^EV100 with q = 0.65, which is 1.2 * 2^EV100
/// (ISO 12232, saturation-based; Filament, section 8.1.2).
[[nodiscard]] double saturating_luminance(double ev100);

/// Its inverse. -infinity for zero; NaN for less.
[[nodiscard]] double ev100_of_saturating_luminance(double nits);

/// Picture value for each cd/m², so that 1 saturates: 1 / (1.2 * 2^EV100). What Filament's and Frostbite's shaders
/// multiply by.
[[nodiscard]] double exposure(double ev100);

/// CIE 1931 x, y.
struct Chromaticity {
  double x = 0.3127, y = 0.3290;

  friend bool operator==(const Chromaticity&, const Chromaticity&) = default;
};

/// The white of Rec. 709, which our r = g = b are.
inline constexpr Chromaticity kD65{};

/// Which lights a colour temperature is meant of.
enum class Locus : std::uint8_t {
  daylight,   ///< CIE 15:2004, eq. 3.3 and 3.4; 4,000 to 25,000 K. What cameras mean by "6500 K".
  planckian,  ///< Glowing bodies, by the cubic fit of Kim et al. 2002; 1,667 to 25,000 K. Lamps below 4,000 K.
};

/// The chromaticity of a colour temperature. invalid_argument outside the locus' range.
[[nodiscard]] Result<Chromaticity> chromaticity_of(double kelvin, Locus locus);

/// The colour temperature nearest to a chromaticity, K (McCamy 1992); good to some kelvin between 2,800 and 6,500 K.
[[nodiscard]] double correlated_temperature(Chromaticity c);

/// Of a colour in linear Rec. 709; D65 for black.
[[nodiscard]] Chromaticity chromaticity_of(float r, float g, float b);

/// Turns light of white `from` into light of white `to`, in linear Rec. 709, with the Bradford cone responses
/// (Lindbloom, "Chromatic Adaptation"; ICC.1:2010, annex E). A white of luminance one stays of luminance one.
/// invalid_argument for a chromaticity that is none.
[[nodiscard]] Result<ColorMatrix> white_adaptation(Chromaticity from, Chromaticity to);

/// A camera whose picture is shown behind what is rendered. The picture is linear, 1 is white.
struct PassThroughCamera {
  double ev100 = 0;
  Chromaticity white;  ///< Light of this chromaticity is neutral in its picture.
  /// Picture value of a luminance of saturating_luminance(): 1 by the standard. A headset's own constant, once measured
  /// (mapping_of_patch), makes its picture exact.
  double calibration = 1;

  /// invalid_argument names the field.
  [[nodiscard]] Status validate() const;
};

/// Radiance and irradiance (cd/m², lux) to this camera's picture: light multiplied by it, and rendered with exposure 1,
/// makes a white patch look as the camera shows a real one: the patch reflects E / pi.
[[nodiscard]] Result<ColorMatrix> mapping_of(const PassThroughCamera& camera);

/// What Varjo's headsets tell of a picture's colour (varjo_WBNormalizationData): rendered content, made for 6500 K, is
/// multiplied by invCCM, by the gains, and by ccm. Varjo writes colours as rows, `color * invCCM * diag(gains) * ccm`;
/// the matrices here are by rows for colours as columns, so the transposes. Varjo clips to what its pixels hold between
/// gains and ccm, which no linear map can: it differs where colours leave the picture's range.
struct VarjoWhiteBalance {
  std::array<double, 3> white_balance_color_gains{1, 1, 1};
  ColorMatrix inv_ccm;  ///< Of 6500 K, inverted.
  ColorMatrix ccm;      ///< Of the camera's colour temperature.
  double ev100 = 0;
  double calibration = 1;  ///< As PassThroughCamera.

  [[nodiscard]] Status validate() const;
};

[[nodiscard]] Result<ColorMatrix> mapping_of(const VarjoWhiteBalance& camera);

/// The gains that make a patch look as it does: `lit_by` is our irradiance at the patch (Lighting::irradiance of its
/// normal), `albedo` what it reflects, `seen` its linear value in the camera's picture. invalid_argument where one of
/// them is not positive and finite in every channel: a black patch tells nothing.
[[nodiscard]] Result<ColorMatrix> mapping_of_patch(Irradiance lit_by, Albedo albedo, std::array<float, 3> seen);

}  // namespace lightwell
