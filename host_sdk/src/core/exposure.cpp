#include <string>

#include <lightwell/conventions.hpp>
#include <lightwell/exposure.hpp>

namespace lightwell {
namespace {

using Matrix = std::array<std::array<double, 3>, 3>;
using Column = std::array<double, 3>;

/// ISO 12232: with the saturation-based sensitivity S the exposure at saturation is 78 / S lx s. With the lens factor
/// q = 0.65 that is the luminance 78 / (100 q) 2^EV100.
constexpr double kSaturation = 78 / (100 * 0.65);

/// Linear Rec. 709 to CIE XYZ, white Y = 1 (IEC 61966-2-1).
constexpr Matrix kXyzOfRgb{{{0.4123907992659595, 0.3575843393838780, 0.1804807884018343},
                            {0.2126390058715104, 0.7151686787677559, 0.0721923153607337},
                            {0.0193308187155918, 0.1191947797946259, 0.9505321522496608}}};

/// Bradford cone responses (Lam 1985; ICC.1:2010, annex E).
constexpr Matrix kBradford{{{0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}}};

Column times(const Matrix& m, const Column& v) {
  Column out{};
  for (std::size_t i = 0; i < 3; ++i) out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
  return out;
}

Matrix times(const Matrix& a, const Matrix& b) {
  Matrix out{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) out[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j];
  return out;
}

/// Inverse of an invertible matrix.
Matrix inverse(const Matrix& m) {
  const auto minor = [&](std::size_t i, std::size_t j) {
    const std::size_t r0 = (i + 1) % 3, r1 = (i + 2) % 3, c0 = (j + 1) % 3, c1 = (j + 2) % 3;
    return m[r0][c0] * m[r1][c1] - m[r0][c1] * m[r1][c0];
  };
  const double determinant = m[0][0] * minor(0, 0) + m[0][1] * minor(0, 1) + m[0][2] * minor(0, 2);
  Matrix out{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) out[j][i] = minor(i, j) / determinant;
  return out;
}

ColorMatrix floats(const Matrix& m) {
  ColorMatrix out;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) out.m[i][j] = static_cast<float>(m[i][j]);
  return out;
}

bool positive(double v) { return v > 0 && std::isfinite(v); }

Status check_chromaticity(const char* name, Chromaticity c) {
  if (positive(c.x) && positive(c.y) && c.x + c.y < 1) return {};
  return invalid_argument(std::string(name) + ": x and y must be positive and their sum below 1");
}

Column xyz_of_white(Chromaticity c) { return {c.x / c.y, 1, (1 - c.x - c.y) / c.y}; }

Status check_picture(double ev100, double calibration) {
  if (!std::isfinite(ev100) || ev100 < -50 || ev100 > 50) return invalid_argument("ev100: must be within -50 and 50");
  if (!positive(calibration)) return invalid_argument("calibration: must be positive and finite");
  return {};
}

ColorMatrix exposed(double ev100, double calibration) {
  return ColorMatrix::scale(static_cast<float>(exposure(ev100) * calibration));
}

}  // namespace

Status ConversionOptions::validate() const {
  if (color.finite()) return {};
  return invalid_argument("color: every element must be finite");
}

Result<double> ev100(const CameraExposure& camera) {
  if (!positive(camera.f_number)) return invalid_argument("f_number: must be positive and finite");
  if (!positive(camera.shutter_s)) return invalid_argument("shutter_s: must be positive and finite, in seconds");
  if (!positive(camera.iso)) return invalid_argument("iso: must be positive and finite");
  return std::log2(camera.f_number * camera.f_number / camera.shutter_s * 100 / camera.iso);
}

double saturating_luminance(double ev100) { return kSaturation * std::exp2(ev100); }
double ev100_of_saturating_luminance(double nits) { return std::log2(nits / kSaturation); }
double exposure(double ev100) { return 1 / saturating_luminance(ev100); }

Result<Chromaticity> chromaticity_of(double kelvin, Locus locus) {
  const double lowest = locus == Locus::daylight ? 4000 : 1667;
  if (!(kelvin >= lowest && kelvin <= 25000))
    return invalid_argument(locus == Locus::daylight
                                ? "kelvin: daylight is from 4000 to 25000; lamps below are planckian"
                                : "kelvin: must be from 1667 to 25000");
  const double t = 1000 / kelvin;
  const auto cubic = [](double v, double a, double b, double c, double d) { return ((a * v + b) * v + c) * v + d; };
  Chromaticity out;
  if (locus == Locus::daylight) {
    out.x =
        kelvin <= 7000 ? cubic(t, -4.6070, 2.9678, 0.09911, 0.244063) : cubic(t, -2.0064, 1.9018, 0.24748, 0.237040);
    out.y = cubic(out.x, 0, -3.000, 2.870, -0.275);
    return out;
  }
  out.x = kelvin <= 4000 ? cubic(t, -0.2661239, -0.2343589, 0.8776956, 0.179910)
                         : cubic(t, -3.0258469, 2.1070379, 0.2226347, 0.240390);
  out.y = kelvin <= 2222   ? cubic(out.x, -1.1063814, -1.34811020, 2.18555832, -0.20219683)
          : kelvin <= 4000 ? cubic(out.x, -0.9549476, -1.37418593, 2.09137015, -0.16748867)
                           : cubic(out.x, 3.0817580, -5.87338670, 3.75112997, -0.37001483);
  return out;
}

double correlated_temperature(Chromaticity c) {
  const double n = (c.x - 0.3320) / (c.y - 0.1858);
  return ((-449 * n + 3525) * n - 6823.3) * n + 5520.33;
}

Chromaticity chromaticity_of(float r, float g, float b) {
  const Column xyz = times(kXyzOfRgb, Column{static_cast<double>(r), static_cast<double>(g), static_cast<double>(b)});
  const double sum = xyz[0] + xyz[1] + xyz[2];
  if (!positive(sum)) return kD65;
  return {xyz[0] / sum, xyz[1] / sum};
}

Result<ColorMatrix> white_adaptation(Chromaticity from, Chromaticity to) {
  if (Status s = check_chromaticity("from", from); !s.ok()) return s;
  if (Status s = check_chromaticity("to", to); !s.ok()) return s;
  const Column cone_from = times(kBradford, xyz_of_white(from)), cone_to = times(kBradford, xyz_of_white(to));
  Matrix gain{};
  for (std::size_t i = 0; i < 3; ++i) {
    if (!(cone_from[i] > 0)) return invalid_argument("from: no light of this chromaticity is white to an eye");
    gain[i][i] = cone_to[i] / cone_from[i];
  }
  const Matrix cones_of_rgb = times(kBradford, kXyzOfRgb);
  return floats(times(inverse(cones_of_rgb), times(gain, cones_of_rgb)));
}

Status PassThroughCamera::validate() const {
  if (Status s = check_picture(ev100, calibration); !s.ok()) return s;
  return check_chromaticity("white", white);
}

Result<ColorMatrix> mapping_of(const PassThroughCamera& camera) {
  if (Status s = camera.validate(); !s.ok()) return s;
  const auto adaptation = white_adaptation(camera.white, kD65);
  if (!adaptation.ok()) return adaptation.status();
  return exposed(camera.ev100, camera.calibration) * *adaptation;
}

Status VarjoWhiteBalance::validate() const {
  if (Status s = check_picture(ev100, calibration); !s.ok()) return s;
  for (const double gain : white_balance_color_gains)
    if (!positive(gain)) return invalid_argument("white_balance_color_gains: must be positive and finite");
  if (!inv_ccm.finite()) return invalid_argument("inv_ccm: every element must be finite");
  if (!ccm.finite()) return invalid_argument("ccm: every element must be finite");
  return {};
}

Result<ColorMatrix> mapping_of(const VarjoWhiteBalance& camera) {
  if (Status s = camera.validate(); !s.ok()) return s;
  const auto& g = camera.white_balance_color_gains;
  const ColorMatrix gains =
      ColorMatrix::gains(static_cast<float>(g[0]), static_cast<float>(g[1]), static_cast<float>(g[2]));
  return exposed(camera.ev100, camera.calibration) * camera.ccm * gains * camera.inv_ccm;
}

Result<ColorMatrix> mapping_of_patch(Irradiance lit_by, Albedo albedo, std::array<float, 3> seen) {
  const Radiance reflected = reflected_radiance(lit_by, albedo);
  std::array<float, 3> gain{};
  for (int k = 0; k < 3; ++k) {
    const auto at = static_cast<std::size_t>(k);
    if (!positive(static_cast<double>(reflected[k])))
      return invalid_argument("lit_by and albedo: every channel must be positive; a black patch cannot be used");
    if (!positive(static_cast<double>(seen[at])))
      return invalid_argument("seen: every channel must be positive and finite");
    gain[at] = seen[at] / reflected[k];
    if (!positive(static_cast<double>(gain[at]))) return invalid_argument("seen: is out of proportion to the light");
  }
  return ColorMatrix::gains(gain[0], gain[1], gain[2]);
}

}  // namespace lightwell
