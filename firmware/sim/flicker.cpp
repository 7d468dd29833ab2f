#include "sim/flicker.hpp"

#include <cmath>
#include <numbers>

namespace lightwell::sim {

double MainsFlicker::factor(double middle_s, double exposure_s) const {
  const double half = std::numbers::pi * hz * exposure_s;
  const double kept = std::abs(half) < 1e-9 ? 1 : std::sin(half) / half;
  return 1 + depth * kept * std::sin(2 * std::numbers::pi * hz * middle_s);
}

}  // namespace lightwell::sim
