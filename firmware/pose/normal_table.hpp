// Normal distribution function and density from a table. Private to firmware/pose.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace lightwell {

/// Cubic Hermite interpolation in a table with steps of 1/32. The error is 4e-9; it takes a tenth of the time of erfc
/// and exp, which would be a third of the time of an edge fit.
class NormalTable {
 public:
  struct Value {
    double integral, density;
  };
  NormalTable() {
    for (std::size_t i = 0; i < table_.size(); ++i) {
      const double x = static_cast<double>(i) / kPerUnit - kEnd;
      table_[i] = {0.5 * std::erfc(-x / std::numbers::sqrt2), std::exp(-x * x / 2) / std::sqrt(2 * std::numbers::pi)};
    }
  }
  [[nodiscard]] Value at(double x) const {
    if (!(std::abs(x) < kEnd)) return {x > 0 ? 1.0 : 0.0, 0};
    const double scaled = (x + kEnd) * kPerUnit;
    const auto i = static_cast<std::size_t>(scaled);
    const double t = scaled - static_cast<double>(i), x0 = static_cast<double>(i) / kPerUnit - kEnd;
    const Value &a = table_[i], &b = table_[i + 1];
    // Derivatives at the nodes: the integral's is the density, the density's is -x times the density.
    const double h = 1.0 / kPerUnit, u = 1 - t;
    const double wa = u * u * (1 + 2 * t), wb = t * t * (3 - 2 * t), sa = u * u * t * h, sb = -t * t * u * h;
    return {wa * a.integral + wb * b.integral + sa * a.density + sb * b.density,
            wa * a.density + wb * b.density - sa * x0 * a.density - sb * (x0 + h) * b.density};
  }

 private:
  static constexpr double kPerUnit = 32, kEnd = 7;
  std::array<Value, static_cast<std::size_t>(2 * kEnd * kPerUnit) + 2> table_;
};

inline const NormalTable& normal_table() {
  static const NormalTable table;
  return table;
}

}  // namespace lightwell
