// Sizes on the wire of the parts of a descriptor (codec.hpp), for choosing what to send in a limited message. All are
// upper limits: the message of Encoder::encode() without a map is at most as long as their sum.
#pragma once

#include <cstddef>
#include <cstdint>

#include <lightwell/descriptor.hpp>

namespace lightwell {

/// Of a mantissa as zigzag varint, at most 8191.
[[nodiscard]] constexpr std::size_t mantissa_bytes(std::int32_t mantissa) {
  return mantissa >= -64 && mantissa < 64 ? 1 : 2;
}
/// Of the radiance. `mantissas`: bytes of all mantissas; `exponent`: of the step to which they are rounded.
[[nodiscard]] std::size_t max_radiance_bytes(std::size_t mantissas, int exponent);
/// Of radiance of band 0 alone, whatever it is.
inline constexpr std::size_t kMaxBand0Bytes = 15;
/// Of one light, whatever its irradiance.
[[nodiscard]] std::size_t max_light_bytes(const Light& light);
[[nodiscard]] std::size_t max_bound_bytes(const ErrorBound& bound);
/// Of all other fields but the map, whenever the message is encoded. Flag::recovered may still be set where
/// Flag::clipped is.
[[nodiscard]] std::size_t max_header_bytes(const Descriptor& descriptor);

}  // namespace lightwell
