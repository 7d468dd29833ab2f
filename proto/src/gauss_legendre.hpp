// Nodes and weights of Gauss-Legendre quadrature.
#pragma once

#include <cmath>
#include <numbers>

namespace lightwell {

struct GaussLegendreNode {
  double x, weight;  ///< On [-1, 1]; x decreases with the index.
};

/// Node i of the n-point rule (Abramowitz & Stegun 25.4.29), by Newton's method on P_n from Tricomi's initial value.
inline GaussLegendreNode gauss_legendre_node(int n, int i) {
  double x = std::cos(std::numbers::pi * (i + 0.75) / (n + 0.5)), slope = 1;
  for (int step = 0; step < 50; ++step) {
    double p0 = 1, p1 = x;
    for (int l = 2; l <= n; ++l) {
      const double p2 = ((2 * l - 1) * x * p1 - (l - 1) * p0) / l;
      p0 = p1;
      p1 = p2;
    }
    slope = n * (x * p1 - p0) / (x * x - 1);
    x -= p1 / slope;
  }
  return {x, 2 / ((1 - x * x) * slope * slope)};
}

}  // namespace lightwell
