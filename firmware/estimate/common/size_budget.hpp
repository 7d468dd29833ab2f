// How the bytes of a descriptor of limited size (panorama.max_bytes) are divided: header and bound first, the rest for
// lights and harmonics.
#pragma once

#include <cstddef>
#include <span>

#include <lightwell/descriptor.hpp>

#include "estimate/common/error_bound.hpp"

namespace lightwell::estimate {

struct SizeBudget {
  std::size_t bound = 0;                ///< Of the bound.
  std::size_t lights_and_radiance = 0;  ///< OptimizerOptions::max_bytes.
};

/// The bytes of a descriptor whose header and flags are set. `max_bytes`: at least kMinMaxBytes, without the map.
/// `largest`: the bound, whose values are at least those that are sent. Where its parts leave no room for bands 0 to
/// 2, only its total is counted.
[[nodiscard]] SizeBudget divide_bytes(std::size_t max_bytes, const Descriptor& descriptor, const ErrorBound& largest);

/// Limits of the bound of a descriptor before its lights, out of `candidates`, and its bands are chosen: without a loss
/// above all light in truncation or quantization. Infinite where clipped lights may still be recovered.
[[nodiscard]] ErrorBound largest_bound(Flags flags, const RelativeErrors& errors, std::span<const Light> candidates,
                                       const IrradianceRms& smoothed);

/// Sets the parts of a bound to zero, all but its total, where it takes more than `max_bytes`.
void limit_size(std::size_t max_bytes, ErrorBound& bound);

}  // namespace lightwell::estimate
