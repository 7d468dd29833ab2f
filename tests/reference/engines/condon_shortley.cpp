#include "reference/engines/condon_shortley.hpp"

#include <cmath>

namespace lightwell::reference::engines {

double condon_shortley(int l, int m, const V3& d) {
  const unsigned order = static_cast<unsigned>(m < 0 ? -m : m);
  const unsigned degree = static_cast<unsigned>(l);
  const double ratio = std::tgamma(degree - order + 1.0) / std::tgamma(degree + order + 1.0);
  const double k = std::sqrt((2.0 * l + 1.0) / (4.0 * pi) * ratio);
  // The standard library's function omits the phase.
  const double phase = order % 2 == 1 ? -1.0 : 1.0;
  const double p = phase * std::assoc_legendre(degree, order, d.z > 1 ? 1.0 : d.z < -1 ? -1.0 : d.z);
  const double phi = std::atan2(d.y, d.x);
  if (m > 0) return std::numbers::sqrt2 * k * p * std::cos(m * phi);
  if (m < 0) return std::numbers::sqrt2 * k * p * std::sin(order * phi);
  return k * p;
}

}  // namespace lightwell::reference::engines
