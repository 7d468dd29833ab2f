#include "reference/cap.hpp"

#include <algorithm>
#include <cmath>

#include "reference/quadrature.hpp"
#include "reference/vector.hpp"

namespace lightwell::reference {

namespace {

/// The integral over phi = 0..2 pi of max(0, A + B cos phi), B >= 0.
double clipped_ring(double a, double b) {
  if (a >= b) return 2 * pi * a;
  if (a <= -b) return 0;
  const double edge = std::acos(-a / b);
  return 2 * (a * edge + b * std::sin(edge));
}

}  // namespace

double cap_irradiance(double radius_rad, double normal_to_axis_rad) {
  const double cosine = std::cos(normal_to_axis_rad);
  const double sine = std::sin(normal_to_axis_rad);
  const auto ring = [&](double angle) {
    return std::sin(angle) * clipped_ring(cosine * std::cos(angle), sine * std::sin(angle));
  };
  const double tolerance = 1e-12 * cap_vector_irradiance(radius_rad);
  const double touch = std::min(radius_rad, std::abs(pi / 2 - normal_to_axis_rad));
  return integrate(ring, 0, touch, tolerance) + integrate(ring, touch, radius_rad, tolerance);
}

double cap_vector_irradiance(double radius_rad) { return pi * std::sin(radius_rad) * std::sin(radius_rad); }

double cap_solid_angle(double radius_rad) {
  const double s = std::sin(radius_rad / 2);
  return 4 * pi * s * s;
}

double cap_radius_from_mean_versine(double mean_versine) {
  return 2 * std::asin(std::sqrt(std::clamp(mean_versine, 0.0, 1.0)));
}

}  // namespace lightwell::reference
