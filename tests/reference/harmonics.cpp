#include "reference/harmonics.hpp"

#include <cmath>
#include <cstddef>

#include "reference/quadrature.hpp"

namespace lightwell::reference {

namespace {

int band_of(const std::vector<Rgb>& coefficients) {
  return static_cast<int>(std::lround(std::sqrt(static_cast<double>(coefficients.size())))) - 1;
}

}  // namespace

int harmonic_index(int l, int m) { return l * (l + 1) + m; }

double legendre(int l, double x) {
  double previous = 1;
  double value = x;
  if (l == 0) return previous;
  for (int k = 2; k <= l; ++k) {
    const double next = ((2.0 * k - 1.0) * x * value - (k - 1.0) * previous) / k;
    previous = value;
    value = next;
  }
  return value;
}

std::vector<double> harmonics(const V3& d, int band) {
  std::vector<double> y(static_cast<std::size_t>((band + 1) * (band + 1)));
  const auto put = [&](int l, int m, double value) { y[static_cast<std::size_t>(harmonic_index(l, m))] = value; };
  double cosine = 1;                        // Re (x + iy)^m
  double sine = 0;                          // Im (x + iy)^m
  double sectoral = 1 / std::sqrt(4 * pi);  // normalised P_m^m / sin^m
  for (int m = 0; m <= band; ++m) {
    if (m > 0) {
      const double next_cosine = d.x * cosine - d.y * sine;
      sine = d.x * sine + d.y * cosine;
      cosine = next_cosine;
      sectoral *= std::sqrt((2.0 * m + 1.0) / (2.0 * m));
    }
    double before = 0;        // normalised P_(l-1)^m / sin^m
    double value = sectoral;  // normalised P_l^m / sin^m
    for (int l = m; l <= band; ++l) {
      if (l > m) {
        const double ll = l;
        const double a = std::sqrt((4 * ll * ll - 1) / (ll * ll - m * m));
        const double b = std::sqrt(((ll - 1) * (ll - 1) - m * m) / (4 * (ll - 1) * (ll - 1) - 1));
        const double next = a * (d.z * value - b * before);
        before = value;
        value = next;
      }
      if (m == 0) {
        put(l, 0, value);
      } else {
        put(l, m, std::sqrt(2.0) * value * cosine);
        put(l, -m, std::sqrt(2.0) * value * sine);
      }
    }
  }
  return y;
}

std::vector<Rgb> project(const Panorama& p, int band) {
  std::vector<Rgb> coefficients(static_cast<std::size_t>((band + 1) * (band + 1)));
  for (int j = 0; j < p.height; ++j) {
    const double solid_angle = pixel_solid_angle(j, p.width, p.height);
    // One row is summed by itself first, so that rounding grows with W + H and not with W H.
    std::vector<Rgb> row(coefficients.size());
    for (int i = 0; i < p.width; ++i) {
      const Rgb radiance = pixel(p, i, j);
      const std::vector<double> y = harmonics(pixel_direction(i, j, p.width, p.height), band);
      for (std::size_t k = 0; k < y.size(); ++k) {
        for (std::size_t c = 0; c < 3; ++c) row[k][c] += radiance[c] * y[k];
      }
    }
    for (std::size_t k = 0; k < row.size(); ++k) {
      for (std::size_t c = 0; c < 3; ++c) coefficients[k][c] += solid_angle * row[k][c];
    }
  }
  return coefficients;
}

Rgb evaluate(const std::vector<Rgb>& coefficients, const V3& d) {
  const std::vector<double> y = harmonics(d, band_of(coefficients));
  Rgb value{};
  for (std::size_t k = 0; k < y.size(); ++k) {
    for (std::size_t c = 0; c < 3; ++c) value[c] += coefficients[k][c] * y[k];
  }
  return value;
}

double cosine_lobe(int l) {
  if (l == 1) return 2 * pi / 3;
  if (l % 2 == 1) return 0;
  double central = 1;  // l! / (2^l ((l/2)!)^2)
  for (int k = 1; k <= l / 2; ++k) central *= (2.0 * k - 1.0) / (2.0 * k);
  const double sign = (l / 2) % 2 == 1 ? 1 : -1;
  return sign * 2 * pi * central / ((l + 2.0) * (l - 1.0));
}

double cosine_lobe_by_quadrature(int l) {
  const GaussLegendre rule = gauss_legendre(l + 2);
  double sum = 0;
  for (std::size_t i = 0; i < rule.nodes.size(); ++i) {
    const double c = 0.5 * (1 + rule.nodes[i]);
    sum += 0.5 * rule.weights[i] * c * legendre(l, c);
  }
  return 2 * pi * sum;
}

Rgb irradiance_from_sh(const std::vector<Rgb>& radiance_coefficients, const V3& n) {
  std::vector<Rgb> irradiance = radiance_coefficients;
  for (int l = 0; l <= band_of(irradiance); ++l) {
    for (int m = -l; m <= l; ++m) {
      for (double& value : irradiance[static_cast<std::size_t>(harmonic_index(l, m))]) {
        value *= cosine_lobe(l);
      }
    }
  }
  return evaluate(irradiance, n);
}

}  // namespace lightwell::reference
