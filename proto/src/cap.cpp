#include <algorithm>
#include <cmath>
#include <numbers>

#include <lightwell/cap.hpp>

namespace lightwell {
namespace {

constexpr double kHalfPi = std::numbers::pi / 2;

/// Radius below which the cap is treated as a point: the error of that (rho) is less than the cancellation error of the
/// closed forms (1e-16 / rho²).
constexpr double kPointRadius = 2e-5;

double clamped(double rho) { return rho > 0 ? std::min(rho, kHalfPi) : 0; }

}  // namespace

double cap_vector_irradiance(double rho) {
  const double s = std::sin(clamped(rho));
  return std::numbers::pi * s * s;
}

double cap_radius(double mean_one_minus_cos) { return std::acos(std::clamp(1 - 2 * mean_one_minus_cos, 0.0, 1.0)); }

double cap_irradiance(double cos_angle, double rho) {
  const double sigma = clamped(rho);
  const double c = std::clamp(cos_angle, -1.0, 1.0);
  if (sigma < kPointRadius) return std::max(0.0, c);
  const double omega = std::acos(c);
  if (omega <= kHalfPi - sigma) return c;
  if (omega >= kHalfPi + sigma) return 0;

  const double sin_s = std::sin(sigma), cos_s = std::cos(sigma), sin_w = std::sin(omega);
  const double gamma = std::asin(std::clamp(cos_s / sin_w, -1.0, 1.0));
  const double cos_g = std::cos(gamma), sin_g = std::sin(gamma);
  const double g = -2 * sin_w * cos_s * cos_g + kHalfPi - gamma + sin_g * cos_g;
  const double h = c * (cos_g * std::sqrt(std::max(0.0, sin_s * sin_s - cos_g * cos_g)) +
                        sin_s * sin_s * std::asin(std::clamp(cos_g / sin_s, -1.0, 1.0)));
  const double full = std::numbers::pi * sin_s * sin_s;
  const double part = omega < kHalfPi ? full * c + g - h : g + h;
  return std::max(0.0, part / full);
}

double cap_zonal(int l, double rho) {
  const double sigma = clamped(rho);
  if (sigma < kPointRadius) return 1;
  // 2 pi times the integral of P_l from a to 1, (P_{l-1}(a) - P_{l+1}(a)) / (2l+1), with P_{-1} = 1.
  const double a = std::cos(sigma);
  double below = 1, p = 1, above = a;
  for (int n = 1; n <= l; ++n) {
    below = p;
    p = above;
    above = ((2 * n + 1) * a * p - n * below) / (n + 1);
  }
  return 2 * std::numbers::pi * (below - above) / (2 * l + 1) / cap_vector_irradiance(sigma);
}

double cap_radiance(double cos_angle, double rho, const GgxLobe& lobe) {
  const double sigma = clamped(rho);
  const double c = std::clamp(cos_angle, -1.0, 1.0);
  if (sigma < kPointRadius) return lobe.value(c);
  const double omega = std::acos(c);
  // Integrate over rings of polar angle t around the lobe's axis; the fraction phi_max/pi of each is inside the cap.
  const double first = std::max(0.0, omega - sigma), last = std::min(omega + sigma, kHalfPi);
  if (first >= last) return 0;
  const double sin_w = std::sin(omega), cos_s = std::cos(sigma);
  const auto share = [&](double x) {
    const double reach = sin_w * std::sqrt(std::max(0.0, 1 - x * x));
    if (reach < 1e-15) return x * c >= cos_s ? 1.0 : 0.0;
    return std::acos(std::clamp((cos_s - c * x) / reach, -1.0, 1.0)) / std::numbers::pi;
  };
  // Split where full rings become arcs and where arcs end: there the fraction has a square-root singularity.
  const double whole = sigma > omega ? sigma - omega : 0;
  double sum = 0;
  if (whole > 0) sum += lobe.integral(std::cos(std::min(whole, kHalfPi)), 1, [](double) { return 1.0; });
  const double a = std::cos(last), b = std::cos(std::max(first, whole));
  constexpr int kPieces = 4;
  for (int i = 0; i < kPieces && a < b; ++i) {
    // Subintervals that get shorter towards both ends.
    const auto knot = [&](int k) {
      const double s = 0.5 - 0.5 * std::cos(std::numbers::pi * k / kPieces);
      return a + (b - a) * s;
    };
    sum += lobe.integral(knot(i), knot(i + 1), share);
  }
  return 2 * std::numbers::pi * sum / cap_vector_irradiance(sigma);
}

}  // namespace lightwell
