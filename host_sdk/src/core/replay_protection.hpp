// Which descriptors may become the newest, where others than the probe may write.
#pragma once

#include <limits>
#include <optional>

#include <lightwell/time.hpp>

#include "core/clock_map.hpp"

namespace lightwell::core {

/// A connection of our own to the probe brings descriptors in their order. A broker brings whatever somebody publishes:
/// a descriptor that was recorded yesterday, one that is dated tomorrow so that it never grows old. Pure; one thread at
/// a time.
class ReplayProtection {
 public:
  /// The middle of the exposure in the host's clock, which is known. Nothing where it is not later than that of the
  /// last one that was let in, or later than now by more than the clocks may be off. Let in, it becomes the last one.
  [[nodiscard]] std::optional<MappedTime> admit(ProbeTime mid_exposure, HostTime now, const ClockMap& clock) {
    // Further off, differences would leave the range.
    constexpr std::int64_t kFar = std::numeric_limits<std::int64_t>::max() / 4;
    if (mid_exposure.ns < 0 || mid_exposure.ns > kFar) return std::nullopt;
    if (last_ && mid_exposure <= *last_) return std::nullopt;
    const MappedTime mapped = clock.mapped(mid_exposure, now);
    if (mapped.at > now + mapped.uncertainty) return std::nullopt;
    last_ = mid_exposure;
    return mapped;
  }

  /// The probe's clock began anew: what was let in says nothing any more.
  void forget() { last_.reset(); }

 private:
  std::optional<ProbeTime> last_;
};

}  // namespace lightwell::core
