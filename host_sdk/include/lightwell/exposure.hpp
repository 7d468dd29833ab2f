// Exposure and white balance: maps radiance and irradiance to picture values, so that a rendered white patch has the
// brightness and colour of a real one in the picture of a pass-through camera.
// If units are relative, mappings have one unknown factor, except that of mapping_of_patch(), which includes it.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <lightwell/color.hpp>
#include <lightwell/result.hpp>

namespace lightwell {

/// A 3x3 matrix for column vectors of linear r, g, b; stored by rows. The identity leaves cd/m² and lux unchanged.
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

  /// Matrix product: b is applied first.
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

/// Exposure settings of a camera.
struct CameraExposure {
  double f_number = 0;  ///< N in f/N.
  double shutter_s = 0;
  double iso = 0;  ///< Sensitivity S of ISO 12232.
};

/// log2(N² / t * 100 / S): the exposure value at ISO 100 (Lagarde & de Rousiers 2014, "Moving Frostbite to PBR",
/// section 5.1.1). invalid_argument names the field that is not positive and finite.
[[nodiscard]] Result<double> ev100(const CameraExposure& camera);

/// The luminance in cd/m² that saturates the picture: 78 / (100 q) 2^EV100 with q = 0.65, which is 1.2 * 2^EV100
/// (ISO 12232, saturation-based; Filament, section 8.1.2).
[[nodiscard]] double saturating_luminance(double ev100);

/// Inverse of saturating_luminance(). -infinity for zero, NaN for a negative luminance.
[[nodiscard]] double ev100_of_saturating_luminance(double nits);

/// Exposure factor, picture value per cd/m², with saturation at 1: 1 / (1.2 * 2^EV100). The factor in Filament's and
/// Frostbite's shaders.
[[nodiscard]] double exposure(double ev100);

/// CIE 1931 x, y.
struct Chromaticity {
  double x = 0.3127, y = 0.3290;

  friend bool operator==(const Chromaticity&, const Chromaticity&) = default;
};

/// The white point of Rec. 709: r = g = b.
inline constexpr Chromaticity kD65{};

/// Locus of illuminants that a colour temperature refers to.
enum class Locus : std::uint8_t {
  daylight,   ///< CIE 15:2004, eq. 3.3 and 3.4; 4,000 to 25,000 K. The locus of camera settings such as "6500 K".
  planckian,  ///< Black bodies, cubic fit of Kim et al. 2002; 1,667 to 25,000 K. For lamps below 4,000 K.
};

/// The chromaticity of a colour temperature. invalid_argument outside the locus' range.
[[nodiscard]] Result<Chromaticity> chromaticity_of(double kelvin, Locus locus);

/// Correlated colour temperature of a chromaticity, K (McCamy 1992); accurate to a few kelvin from 2,800 to 6,500 K.
[[nodiscard]] double correlated_temperature(Chromaticity c);

/// Chromaticity of a colour in linear Rec. 709; D65 for black.
[[nodiscard]] Chromaticity chromaticity_of(float r, float g, float b);

/// Chromatic adaptation from white point `from` to white point `to`, in linear Rec. 709, with the Bradford cone
/// responses (Lindbloom, "Chromatic Adaptation"; ICC.1:2010, annex E). White keeps its luminance. invalid_argument for
/// values that are not a chromaticity.
[[nodiscard]] Result<ColorMatrix> white_adaptation(Chromaticity from, Chromaticity to);

/// A camera whose picture is the background of the rendered content. The picture is linear, 1 is white.
struct PassThroughCamera {
  double ev100 = 0;
  Chromaticity white;  ///< Light of this chromaticity is neutral in its picture.
  /// Picture value of a luminance of saturating_luminance(): 1 by the standard. For an exact match, use the value
  /// measured for a headset (mapping_of_patch).
  double calibration = 1;

  /// invalid_argument names the field.
  [[nodiscard]] Status validate() const;
};

/// Matrix from radiance or irradiance (cd/m², lux) to this camera's picture values: lights multiplied by it and
/// rendered with exposure 1 give a white patch, which reflects E / pi, the value of a real one in the picture.
[[nodiscard]] Result<ColorMatrix> mapping_of(const PassThroughCamera& camera);

/// White balance as Varjo's headsets report it (varjo_WBNormalizationData): rendered content, made for 6500 K, is
/// multiplied by invCCM, by the gains, and by ccm. Varjo uses row vectors, `color * invCCM * diag(gains) * ccm`; the
/// matrices here are for column vectors, so they are the transposes. Varjo clips to the pixel range between gains and
/// ccm; this linear mapping does not, so it differs for colours outside of that range.
struct VarjoWhiteBalance {
  std::array<double, 3> white_balance_color_gains{1, 1, 1};
  ColorMatrix inv_ccm;  ///< Inverse colour correction matrix for 6500 K.
  ColorMatrix ccm;      ///< Colour correction matrix for the camera's colour temperature.
  double ev100 = 0;
  double calibration = 1;  ///< As PassThroughCamera::calibration.

  [[nodiscard]] Status validate() const;
};

[[nodiscard]] Result<ColorMatrix> mapping_of(const VarjoWhiteBalance& camera);

/// Per-channel gains from a patch: `lit_by` is the irradiance at the patch (Lighting::irradiance of its normal),
/// `albedo` its reflectance, `seen` its linear value in the camera's picture. invalid_argument unless all of them are
/// positive and finite in every channel.
[[nodiscard]] Result<ColorMatrix> mapping_of_patch(Irradiance lit_by, Albedo albedo, std::array<float, 3> seen);

}  // namespace lightwell
