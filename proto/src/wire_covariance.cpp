#include "wire_covariance.hpp"

#include <algorithm>
#include <cmath>

#include "block_float.hpp"

namespace lightwell {
namespace {

/// A symmetric matrix: u·u, u·v, v·v.
using Symmetric = std::array<double, 3>;

template <class T>
Symmetric symmetric(const std::array<T, 3>& m) {
  return {static_cast<double>(m[0]), static_cast<double>(m[1]), static_cast<double>(m[2])};
}

/// Exact if the elements are floats or mantissas: a product of two has at most 48 bits.
bool positive_semidefinite(const Symmetric& m) {
  const auto [uu, uv, vv] = m;
  return uu >= 0 && vv >= 0 && uv * uv <= uu * vv;
}

/// Sets negative eigenvalues to zero (Higham 1988, "Computing a nearest symmetric positive semidefinite matrix",
/// theorem 2.1).
Symmetric nearest_positive_semidefinite(const Symmetric& m) {
  if (positive_semidefinite(m)) return m;
  const auto [uu, uv, vv] = m;
  const double h = (uu - vv) / 2, r = std::sqrt(h * h + uv * uv);
  const double largest_eigenvalue = (uu + vv) / 2 + r;
  if (!(largest_eigenvalue > 0)) return {};
  return {largest_eigenvalue * (r + h) / (2 * r), largest_eigenvalue * uv / (2 * r),
          largest_eigenvalue * (r - h) / (2 * r)};
}

/// Mantissas of a positive semi-definite matrix whose variances grow by at least the rounding error of u·v. The change
/// is diagonally dominant, hence positive semi-definite.
std::array<std::int32_t, 3> round_up(const Symmetric& m, int exponent) {
  const double uu = std::ldexp(m[0], -exponent), uv = std::ldexp(m[1], -exponent), vv = std::ldexp(m[2], -exponent);
  const double rounded_uv = std::nearbyint(uv), error = std::abs(uv - rounded_uv);
  return {static_cast<std::int32_t>(std::ceil(uu + error)), static_cast<std::int32_t>(rounded_uv),
          static_cast<std::int32_t>(std::ceil(vv + error))};
}

}  // namespace

WireCovariance round_covariance(const std::array<float, 3>& covariance) {
  const float largest = std::max({std::abs(covariance[0]), std::abs(covariance[1]), std::abs(covariance[2])});
  int exponent = exponent_for(largest, kCovarianceLimit);
  std::array<std::int32_t, 3> mantissa{};
  for (std::size_t k = 0; k < 3; ++k) mantissa[k] = mantissa_of(covariance[k], exponent);
  if (!positive_semidefinite(symmetric(mantissa))) {
    const Symmetric nearest = nearest_positive_semidefinite(symmetric(covariance));
    exponent = exponent_for(std::max(nearest[0], nearest[2]), kCovarianceLimit);
    mantissa = round_up(nearest, exponent);
    // A variance that is just above 63 units has one exponent more if it is rounded up.
    if (std::max(mantissa[0], mantissa[2]) > kCovarianceLimit) mantissa = round_up(nearest, ++exponent);
  }
  return {mantissa, std::min(exponent, kMaxBlockExponent)};
}

std::array<float, 3> covariance_of(const WireCovariance& received) {
  const Symmetric nearest = nearest_positive_semidefinite(symmetric(received.mantissa));
  std::array<float, 3> out{};
  for (std::size_t k = 0; k < 3; ++k) out[k] = static_cast<float>(std::ldexp(nearest[k], received.exponent));
  // Rounding to float may make u·v too large by a few units in the last place.
  while (!positive_semidefinite(symmetric(out))) out[1] = std::nextafter(out[1], 0.0F);
  return out;
}

}  // namespace lightwell
