// The domain of a camera model: directions up to a largest angle from the z axis.
#pragma once

#include <cmath>
#include <numbers>

#include <lightwell/geometry.hpp>

namespace lightwell {

/// Relative tolerance of the domain's end for rounding errors, so that unproject() accepts the pixel that project()
/// returns for the last direction.
template <class T>
inline constexpr T kDomainTolerance = T(1e-12);
template <>
inline constexpr float kDomainTolerance<float> = 4e-6F;

/// Whether the angle of a direction from the z axis is at most `max_angle`, rad.
template <class T>
[[nodiscard]] bool is_within(Vec3<T> direction, T max_angle) {
  if (max_angle >= std::numbers::pi_v<T>) return true;
  return std::atan2(std::hypot(direction.x, direction.y), direction.z) <= max_angle * (1 + kDomainTolerance<T>);
}

/// The angle up to which `is_valid(angle)` holds, at most `limit`, rad. It is evaluated at a thousand angles, then
/// bisected: a shorter interval of invalid angles is not detected.
template <class IsValid>
[[nodiscard]] double largest_valid_angle(double limit, const IsValid& is_valid) {
  constexpr int kSteps = 1000, kBisections = 60;
  double low = 0;
  for (int i = 1; i <= kSteps; ++i) {
    double high = limit * i / kSteps;
    if (is_valid(high)) {
      low = high;
      continue;
    }
    for (int n = 0; n < kBisections; ++n) {
      const double middle = (low + high) / 2;
      (is_valid(middle) ? low : high) = middle;
    }
    return low;
  }
  return limit;
}

}  // namespace lightwell
