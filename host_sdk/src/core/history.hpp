// The last descriptors of a probe, and queries at a time: interpolation, extrapolation, staleness.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include <lightwell/lighting.hpp>
#include <lightwell/time.hpp>

#include "core/sample.hpp"

namespace lightwell::core {

/// Immutable once shared: the writer makes a new one for every descriptor, so that readers see a consistent history
/// without a lock. Ascending in mid_exposure, never empty.
struct History {
  std::vector<std::shared_ptr<const Sample>> samples;
};

/// `before` (may be null) with one more sample, at most `capacity` in all. Samples that are not older than the new one
/// are removed: the clock was corrected, or the probe restarted.
[[nodiscard]] std::shared_ptr<const History> appended(const History* before, std::shared_ptr<const Sample> sample,
                                                      std::size_t capacity);

/// The newest sample; Validity::none if `history` is null.
[[nodiscard]] Lighting newest_lighting(const History* history, HostTime now, Duration max_age);

/// As Probe::at().
[[nodiscard]] Lighting lighting_at(const History* history, HostTime time, Duration max_age, Duration extrapolation);

}  // namespace lightwell::core
