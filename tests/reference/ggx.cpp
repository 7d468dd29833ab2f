#include "reference/ggx.hpp"

#include <cmath>
#include <cstddef>
#include <functional>
#include <stdexcept>

#include "reference/harmonics.hpp"
#include "reference/quadrature.hpp"

namespace lightwell::reference {

namespace {

/// The integral over the hemisphere of a zonal function of s = 1 - cos theta that changes on the
/// scale of a2: 2 pi times the integral over s = 0..1, with s = a2 (e^u - 1), in `panels` equal
/// parts of u.
double integral_over_hemisphere(const std::function<double(double)>& f, double a2, int panels) {
  const double end = std::log1p(1 / a2);
  const auto integrand = [&](double u) { return 2 * pi * f(a2 * std::expm1(u)) * a2 * std::exp(u); };
  double sum = 0;
  for (int k = 0; k < panels; ++k) {
    sum += integrate(integrand, end * k / panels, end * (k + 1) / panels, 1e-14);
  }
  return sum;
}

}  // namespace

GgxKernel::GgxKernel(double perceptual_roughness) {
  if (!(perceptual_roughness > 0 && perceptual_roughness <= 1)) {
    throw std::domain_error("GgxKernel: roughness must be above 0 and at most 1");
  }
  a2_ = std::pow(perceptual_roughness, 4);
  integral_ = integral_over_hemisphere([this](double s) { return weight(s); }, a2_, 8);
}

double GgxKernel::weight(double s) const {
  if (s >= 1) return 0;
  const double denominator = a2_ + s * (1 - a2_) / 2;
  return a2_ * (1 - s) / (pi * denominator * denominator);
}

double GgxKernel::at_versine(double s) const { return weight(s) / integral_; }

double GgxKernel::at_cosine(double cosine) const { return at_versine(1 - cosine); }

std::vector<double> GgxKernel::legendre_coefficients(int band) const {
  std::vector<double> coefficients;
  for (int l = 0; l <= band; ++l) {
    const auto product = [this, l](double s) { return at_versine(s) * legendre(l, 1 - s); };
    // Enough parts to resolve the oscillation of P_l.
    coefficients.push_back(integral_over_hemisphere(product, a2_, 8 + l));
  }
  return coefficients;
}

std::vector<double> ggx_legendre(double perceptual_roughness, int band) {
  return GgxKernel(perceptual_roughness).legendre_coefficients(band);
}

Rgb radiance_ggx(const Panorama& p, const V3& d, double perceptual_roughness, int samples_per_axis) {
  if (perceptual_roughness == 0) return sample(p, d);
  const GgxKernel kernel(perceptual_roughness);
  const int n = samples_per_axis;
  Rgb sum{};
  double weights = 0;
  for (int j = 0; j < p.height; ++j) {
    for (int i = 0; i < p.width; ++i) {
      double weight = 0;
      for (int b = 0; b < n; ++b) {
        const double solid_angle = pixel_solid_angle(j * n + b, p.width * n, p.height * n);
        for (int a = 0; a < n; ++a) {
          const V3 l = pixel_direction(i - 0.5 + (a + 0.5) / n, j - 0.5 + (b + 0.5) / n, p.width, p.height);
          const V3 chord = l - d;
          weight += kernel.weight(0.5 * dot(chord, chord)) * solid_angle;
        }
      }
      const Rgb radiance = pixel(p, i, j);
      for (std::size_t c = 0; c < 3; ++c) sum[c] += weight * radiance[c];
      weights += weight;
    }
  }
  for (double& value : sum) value /= weights;
  return sum;
}

}  // namespace lightwell::reference
