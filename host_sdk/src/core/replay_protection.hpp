// Replay protection for brokers, where clients other than the probe may publish.
#pragma once

#include <limits>
#include <optional>

#include <lightwell/time.hpp>

#include "core/clock_map.hpp"

namespace lightwell::core {

/// A direct connection to the probe delivers descriptors in order. A broker delivers whatever is published: also a
/// recorded old descriptor, or one that is dated in the future so that it never becomes stale. No I/O; one thread at a
/// time.
class ReplayProtection {
 public:
  /// Maps mid-exposure to the host's clock (clock.known() is required). No value, and the descriptor is rejected, if it
  /// is not later than the last admitted one, or later than `now` by more than the clock uncertainty.
  [[nodiscard]] std::optional<MappedTime> admit(ProbeTime mid_exposure, HostTime now, const ClockMap& clock) {
    // Prevents overflow of differences.
    constexpr std::int64_t kFar = std::numeric_limits<std::int64_t>::max() / 4;
    if (mid_exposure.ns < 0 || mid_exposure.ns > kFar) return std::nullopt;
    if (last_ && mid_exposure <= *last_) return std::nullopt;
    const MappedTime mapped = clock.mapped(mid_exposure, now);
    if (mapped.at > now + mapped.uncertainty) return std::nullopt;
    last_ = mid_exposure;
    return mapped;
  }

  /// Call it after a reset of the probe's clock, which makes the last admitted time meaningless.
  void forget() { last_.reset(); }

 private:
  std::optional<ProbeTime> last_;
};

}  // namespace lightwell::core
