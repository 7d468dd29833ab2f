// Numerical integration in double.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

namespace lightwell::reference {

/// A rule on [-1, 1]: the integral of f is about the sum of weights[i] f(nodes[i]).
struct GaussLegendre {
  std::vector<double> nodes;
  std::vector<double> weights;
};

/// The n-point Gauss-Legendre rule, exact for polynomials of degree 2n - 1 (Abramowitz & Stegun
/// 25.4.29). Nodes by Newton's method from Tricomi's first guess.
GaussLegendre gauss_legendre(int n);

/// The integral of f over [a, b]. A panel is halved until its 15-point Gauss value and the sum of
/// its halves' values differ by no more than `tolerance` (absolute, per panel). The difference
/// measures the coarse value and the fine one is kept, so for smooth f the error is far less.
/// f should have its kinks at a or b: split there.
double integrate(const std::function<double(double)>& f, double a, double b, double tolerance);

/// Digits of i in the base, mirrored at the point: element i of a sequence that fills [0, 1) evenly (Halton 1960).
double radical_inverse(std::uint64_t i, std::uint64_t base);

}  // namespace lightwell::reference
