// The covariance of a light's direction on the wire. Specification: proto/README.md, "Covariance of a light".
#pragma once

#include <array>
#include <cstdint>

namespace lightwell {

/// Largest magnitude of a covariance's mantissa: one byte as a zigzag varint. Two significant digits suffice.
inline constexpr std::int32_t kCovarianceLimit = 63;

/// u·u, u·v, v·v in rad²: mantissas times 2^exponent.
struct WireCovariance {
  std::array<std::int32_t, 3> mantissa{};
  int exponent = 0;
};

/// Rounds a finite covariance (u·u, u·v, v·v) to mantissas that are positive semi-definite. If the nearest mantissas
/// are not, the result minus `covariance` is positive semi-definite: the variance decreases in no direction.
/// Covariances above the range of the wire, 63 * 2^100 rad², are scaled to it.
[[nodiscard]] WireCovariance round_covariance(const std::array<float, 3>& covariance);

/// The covariance of a message (u·u, u·v, v·v); of an indefinite one the nearest positive semi-definite matrix in the
/// Frobenius norm. Positive semi-definite as floats, too: u·v² <= u·u v·v in exact arithmetic.
[[nodiscard]] std::array<float, 3> covariance_of(const WireCovariance& received);

}  // namespace lightwell
