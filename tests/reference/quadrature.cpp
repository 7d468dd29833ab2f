#include "reference/quadrature.hpp"

#include <cmath>
#include <cstddef>
#include <numbers>

namespace lightwell::reference {

GaussLegendre gauss_legendre(int n) {
  GaussLegendre rule;
  for (int i = 0; i < n; ++i) {
    double x = std::cos(std::numbers::pi * (i + 0.75) / (n + 0.5));
    double slope = 1;
    for (int step = 0; step < 100; ++step) {
      double previous = 1;
      double value = x;
      for (int l = 2; l <= n; ++l) {
        const double next = ((2.0 * l - 1.0) * x * value - (l - 1.0) * previous) / l;
        previous = value;
        value = next;
      }
      slope = n * (x * value - previous) / (x * x - 1.0);
      const double change = value / slope;
      x -= change;
      if (std::abs(change) < 1e-15) break;
    }
    rule.nodes.push_back(x);
    rule.weights.push_back(2.0 / ((1.0 - x * x) * slope * slope));
  }
  return rule;
}

namespace {

using Function = std::function<double(double)>;

double panel(const Function& f, double a, double b) {
  static const GaussLegendre rule = gauss_legendre(15);
  double sum = 0;
  for (std::size_t i = 0; i < rule.nodes.size(); ++i) {
    sum += rule.weights[i] * f(0.5 * (a + b) + 0.5 * (b - a) * rule.nodes[i]);
  }
  return 0.5 * (b - a) * sum;
}

double refine(const Function& f, double a, double b, double whole, double tolerance, int depth) {
  const double middle = 0.5 * (a + b);
  const double left = panel(f, a, middle);
  const double right = panel(f, middle, b);
  if (depth == 0 || std::abs(left + right - whole) <= tolerance) return left + right;
  return refine(f, a, middle, left, tolerance, depth - 1) + refine(f, middle, b, right, tolerance, depth - 1);
}

}  // namespace

double integrate(const Function& f, double a, double b, double tolerance) {
  constexpr int deepest = 50;
  return a == b ? 0.0 : refine(f, a, b, panel(f, a, b), tolerance, deepest);
}

double radical_inverse(std::uint64_t i, std::uint64_t base) {
  double out = 0, digit = 1;
  for (; i > 0; i /= base) {
    digit /= static_cast<double>(base);
    out += digit * static_cast<double>(i % base);
  }
  return out;
}

}  // namespace lightwell::reference
