#include <algorithm>
#include <numbers>

#include <lightwell/lobes.hpp>

#include "gauss_legendre.hpp"

namespace lightwell {

double cosine_lobe(int l) {
  if (l == 0) return std::numbers::pi;
  if (l == 1) return 2 * std::numbers::pi / 3;
  if (l % 2 == 1) return 0;
  // 2 pi (-1)^(l/2-1) / ((l+2)(l-1)) * l! / (2^l (l/2)!²), the last factor as a product of terms near one.
  double central = 1;
  for (int k = 1; k <= l / 2; ++k) central *= (2.0 * k - 1) / (2.0 * k);
  const double sign = (l / 2) % 2 == 1 ? 1 : -1;
  return sign * 2 * std::numbers::pi * central / ((l + 2.0) * (l - 1.0));
}

const GaussLegendre32& GaussLegendre32::get() {
  static const GaussLegendre32 rule = [] {
    GaussLegendre32 r{};
    for (std::size_t i = 0; i < 32; ++i) {
      const GaussLegendreNode at = gauss_legendre_node(32, static_cast<int>(i));
      r.node[i] = 0.5 * (1 - at.x);
      r.weight[i] = 0.5 * at.weight;
    }
    return r;
  }();
  return rule;
}

GgxLobe::GgxLobe(double roughness) {
  // The order of the comparison maps NaN to the widest lobe.
  const double r = roughness < 1 ? std::max(roughness, kMinRoughness) : 1;
  const double alpha = r * r;
  alpha2_ = alpha * alpha;
  beta_ = (1 - alpha2_) / 2;
  norm_ = 1 / (2 * std::numbers::pi * integral(0, 1, [](double) { return 1.0; }));
}

double GgxLobe::value(double x) const {
  if (!(x > 0)) return 0;
  const double d = alpha2_ + beta_ * std::max(0.0, 1 - x);
  return norm_ * x * alpha2_ / (d * d);
}

std::array<double, kMaxBand + 1> GgxLobe::coefficients() const {
  std::array<double, kMaxBand + 1> k{};
  for (int l = 0; l <= kMaxBand; ++l) {
    k[static_cast<std::size_t>(l)] =
        2 * std::numbers::pi * integral(0, 1, [l](double x) { return l == 0 ? 1 : legendre(l, x)[1]; });
  }
  return k;
}

}  // namespace lightwell
