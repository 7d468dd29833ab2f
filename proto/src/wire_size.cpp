#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include <lightwell/wire_size.hpp>

#include "wire_covariance.hpp"

namespace lightwell {
namespace {

// Bytes of fields with their tags, which take one byte up to number 15 (proto/README.md, "Bytes").
constexpr std::size_t kTag = 1, kFixed32 = kTag + 4, kFixed64 = kTag + 8;
/// Of enums and of numbers below 128.
constexpr std::size_t kSmallNumber = kTag + 1;
/// Of an exponent: two bytes below -64 and above 63.
constexpr std::size_t kMaxExponent = kTag + 2;
/// Of the microseconds until the encoding, which is still to come.
constexpr std::size_t kMaxUint32 = kTag + 5;
/// The common zeros of mantissas of 13 bits may be moved to the exponent.
constexpr int kMaxCommonZeros = 12;

std::size_t varint(std::uint64_t value) { return (static_cast<std::size_t>(std::bit_width(value | 1)) + 6) / 7; }
std::size_t number(std::uint64_t value) { return value == 0 ? 0 : kTag + varint(value); }
std::size_t nested(std::size_t content) { return kTag + varint(content) + content; }

std::size_t exponent_bytes(int exponent) { return exponent >= -64 && exponent < 64 ? kSmallNumber : kMaxExponent; }

/// The largest number of a field with 32 bits where `value` is out of its range or NaN.
std::uint64_t clamped(double value) {
  constexpr double kMax = std::numeric_limits<std::uint32_t>::max();
  return value < kMax ? static_cast<std::uint64_t>(std::max(value, 0.0)) : static_cast<std::uint64_t>(kMax);
}

std::uint64_t millionths(float share) { return clamped(std::ceil(share * 1e6)); }
std::uint64_t microseconds(Duration d) { return clamped(static_cast<double>(d.ns) / 1000); }

}  // namespace

std::size_t max_radiance_bytes(std::size_t mantissas, int exponent) {
  const bool short_exponent = exponent >= -64 && exponent + kMaxCommonZeros < 64;
  return nested(kSmallNumber + (short_exponent ? kSmallNumber : kMaxExponent) + nested(mantissas));
}

std::size_t max_light_bytes(const Light& light) {
  constexpr std::size_t kThreeMantissas = 3 * 2;
  std::size_t bytes = 2 * nested(kThreeMantissas) + kMaxExponent;
  bytes += number(static_cast<std::uint64_t>(std::lround(light.angular_radius_rad * 1e5) + 1)) + number(light.track);
  const auto& cov = light.direction_covariance;
  if (const WireCovariance sent = round_covariance(cov); sent.mantissa != decltype(sent.mantissa){})
    bytes += nested(cov[0] == cov[2] && cov[1] == 0 ? 1 : 3) + exponent_bytes(sent.exponent);
  if (light.distance_m > 0) bytes += 2 * kMaxUint32;
  return nested(bytes);
}

std::size_t max_bound_bytes(const ErrorBound& bound) {
  std::size_t bytes = 0;
  for (const float v :
       {bound.total, bound.truncation, bound.sampling, bound.noise, bound.quantization, bound.smoothing})
    bytes += number(millionths(v));
  return nested(bytes);
}

std::size_t max_header_bytes(const Descriptor& d) {
  Flags flags = d.flags;
  if (flags.has(Flag::clipped)) flags.set(Flag::recovered);
  const auto flag_count =
      static_cast<std::size_t>(std::ranges::count_if(kWireFlags, [&](Flag f) { return flags.has(f); }));
  const std::size_t time = (d.time.mid_exposure.ns != 0 ? kFixed64 : 0) + kSmallNumber +
                           number(microseconds(d.time.delivered_after)) + kMaxUint32;
  std::size_t bytes = kSmallNumber + number(d.sequence) + nested(time) + kSmallNumber;  // From wire_version to units.
  if (d.coverage != 1) bytes += kFixed32;
  if (d.saturated != 0) bytes += kFixed32;
  if (d.probe_id != 0) bytes += kFixed32;
  if (d.calibration_id != 0) bytes += kFixed32;
  if (flag_count > 0) bytes += nested(flag_count);
  bytes += kSmallNumber;  // setting.
  if (d.flicker != Flicker::unknown) bytes += kSmallNumber;
  if (d.T_probe_origin != Pose{}) bytes += kTag + nested(7 * kFixed64);  // The tag of field 16 takes two bytes.
  return bytes;
}

}  // namespace lightwell
