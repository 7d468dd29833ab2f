#include "core/clock_map.hpp"

#include <cstdint>
#include <cstdlib>

namespace lightwell::core {

void ClockMap::add(HostTime sent, ProbeTime probe, HostTime received) {
  if (received < sent) return;
  // Half first: the sum of two times can leave the range.
  const std::int64_t half = (received.ns - sent.ns) / 2;
  const RoundTrip fresh{{probe.ns - (sent.ns + half)}, {half + 1}, received};
  if (kept_) {
    const Duration aged = uncertainty(received);
    const bool contradicts =
        std::llabs(fresh.offset.ns - kept_->offset.ns) > aged.ns + fresh.half.ns;
    if (fresh.half > aged && !contradicts) return;
  }
  kept_ = fresh;
}

Duration ClockMap::offset() const { return kept_ ? kept_->offset : Duration{}; }

Duration ClockMap::uncertainty(HostTime now) const {
  if (!kept_) return {};
  const double age_ns = now > kept_->received ? static_cast<double>((now - kept_->received).ns) : 0;
  return kept_->half + Duration{static_cast<std::int64_t>(kDrift * age_ns)};
}

}  // namespace lightwell::core
