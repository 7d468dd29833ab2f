#include "estimate/common/size_budget.hpp"

#include <algorithm>
#include <limits>

#include <lightwell/wire_size.hpp>

namespace lightwell::estimate {

SizeBudget divide_bytes(std::size_t max_bytes, const Descriptor& descriptor, const ErrorBound& largest) {
  const std::size_t rest = max_bytes - std::min(max_bytes, max_header_bytes(descriptor));
  SizeBudget out{max_bound_bytes(largest), 0};
  // Bands 0 to 2 hold nine tenths of the irradiance: 27 mantissas of one byte.
  if (out.bound + max_radiance_bytes(3 * sh_count(2), 0) > rest)
    out.bound = max_bound_bytes({.total = std::numeric_limits<float>::infinity()});
  out.lights_and_radiance = rest - std::min(rest, out.bound);
  return out;
}

ErrorBound largest_bound(Flags flags, const RelativeErrors& errors, std::span<const Light> candidates,
                         const IrradianceRms& smoothed) {
  if (flags.has(Flag::dark)) return error_bound(BoundParts{}, flags);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const auto of_rms = [&](const IrradianceRms& e) { return std::max(e.plain, e.weighted) / errors.rms; };
  BoundParts parts;
  parts.truncation = 1;
  parts.sampling = errors.sampling + errors.stale + of_rms(direction_error_rms(candidates));
  parts.noise = 3 * errors.noise + errors.near_black_bias;
  parts.quantization = 1;
  parts.smoothing = of_rms(smoothed);
  if (flags.has(Flag::clipped)) parts.sampling = parts.quantization = kInfinity;
  return error_bound(parts, flags);
}

void limit_size(std::size_t max_bytes, ErrorBound& bound) {
  if (max_bound_bytes(bound) > max_bytes) bound = {.total = bound.total};
}

}  // namespace lightwell::estimate
