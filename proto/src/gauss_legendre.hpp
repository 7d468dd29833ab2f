// Legendre polynomials, and Gauss-Legendre quadrature on an interval and on the sphere.
#pragma once

#include <array>
#include <cmath>
#include <numbers>

#include <lightwell/geometry.hpp>

namespace lightwell {

/// P_{n-1}(x) and P_n(x), n at least 1, by Bonnet's recursion.
inline std::array<double, 2> legendre(int n, double x) {
  double p0 = 1, p1 = x;
  for (int l = 2; l <= n; ++l) {
    const double p2 = ((2 * l - 1) * x * p1 - (l - 1) * p0) / l;
    p0 = p1;
    p1 = p2;
  }
  return {p0, p1};
}

struct GaussLegendreNode {
  double x, weight;  ///< On [-1, 1]; x decreases with the index.
};

/// Node i of the n-point rule (Abramowitz & Stegun 25.4.29), by Newton's method on P_n from Tricomi's initial value.
inline GaussLegendreNode gauss_legendre_node(int n, int i) {
  double x = std::cos(std::numbers::pi * (i + 0.75) / (n + 0.5)), slope = 1;
  for (int step = 0; step < 50; ++step) {
    const auto [p0, p1] = legendre(n, x);
    slope = n * (x * p1 - p0) / (x * x - 1);
    x -= p1 / slope;
  }
  return {x, 2 / ((1 - x * x) * slope * slope)};
}

/// Calls visit(direction, weight) for each node of a quadrature on the sphere: Gauss-Legendre in z, equidistant in
/// azimuth, the first node of a ring `first` steps from +X.
template <class Visit>
void for_each_sphere_node(int rings, int steps, double first, Visit visit) {
  for (int i = 0; i < rings; ++i) {
    const auto [z, ring_weight] = gauss_legendre_node(rings, i);
    const double s = std::sqrt(1 - z * z);
    for (int k = 0; k < steps; ++k) {
      const double phi = 2 * std::numbers::pi * (k + first) / steps;
      visit(Vec3d{s * std::cos(phi), s * std::sin(phi), z}, ring_weight * 2 * std::numbers::pi / steps);
    }
  }
}

}  // namespace lightwell
