// Reflection lobes of surfaces: the clamped cosine lobe, and the GGX lobe of radiance(d, r).
#pragma once

#include <array>

#include <lightwell/harmonics.hpp>

namespace lightwell {

/// Coefficients A_l of the clamped cosine: pi, 2pi/3, pi/4, 0, -pi/24, 0, pi/64, ... (Ramamoorthi & Hanrahan 2001, eq.
/// 8). l: 0 to kMaxBasisBand.
[[nodiscard]] double cosine_lobe(int l);

/// The lobe of `radiance(d, r)`: light weighted by GGX with N = V = R = d and by N·L, normalised to one
/// (Karis 2013, "Real Shading in Unreal Engine 4", the prefiltered environment map). It depends only on the cosine x of
/// the angle to d: k(x) ~ x / (alpha² + (1 - alpha²)/2 (1 - x))², x in (0, 1], alpha = r².
class GgxLobe {
 public:
  /// Perceptual roughness, clamped to [kMinRoughness, 1].
  explicit GgxLobe(double roughness);

  /// Below this the lobe is narrower than any pixel or texel used here. Roughness 0, a mirror, has no GgxLobe.
  static constexpr double kMinRoughness = 0.02;

  /// The lobe at cosine x, sr⁻¹. Integrates to one over the sphere; zero for x <= 0.
  [[nodiscard]] double value(double x) const;

  /// Integral of value(x) f(x) dx from x0 to x1, 0 <= x0 <= x1 <= 1, by Gauss-Legendre quadrature in the logarithm of
  /// the denominator, in which the integrand has no sharp peak.
  template <class F>
  [[nodiscard]] double integral(double x0, double x1, F&& f) const;

  /// Legendre coefficients K_l, K_0 = 1. Convolution with the lobe multiplies L_lm by K_l.
  [[nodiscard]] std::array<double, kMaxBand + 1> coefficients() const;

 private:
  double alpha2_;
  double beta_;  // (1 - alpha²) / 2
  double norm_ = 1;
};

/// Nodes and weights of 32-point Gauss-Legendre quadrature on [0, 1].
struct GaussLegendre32 {
  std::array<double, 32> node, weight;
  static const GaussLegendre32& get();
};

template <class F>
double GgxLobe::integral(double x0, double x1, F&& f) const {
  const GaussLegendre32& rule = GaussLegendre32::get();
  // With y = 1 - x and D = alpha² + beta y = alpha² e^u: dy = D/beta du. For a tiny beta, D is constant.
  const double y0 = 1 - x1, y1 = 1 - x0;
  double sum = 0;
  if (beta_ < 1e-6) {
    for (int i = 0; i < 32; ++i) {
      const double y = y0 + (y1 - y0) * rule.node[i];
      sum += rule.weight[i] * value(1 - y) * f(1 - y);
    }
    return sum * (y1 - y0);
  }
  const double u0 = std::log1p(beta_ / alpha2_ * y0), u1 = std::log1p(beta_ / alpha2_ * y1);
  for (int i = 0; i < 32; ++i) {
    const double u = u0 + (u1 - u0) * rule.node[i];
    const double y = alpha2_ / beta_ * std::expm1(u);
    sum += rule.weight[i] * value(1 - y) * f(1 - y) * (alpha2_ * std::exp(u)) / beta_;
  }
  return sum * (u1 - u0);
}

}  // namespace lightwell
