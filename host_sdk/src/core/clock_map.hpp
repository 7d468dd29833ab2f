// The probe's clock against the host's, from round trips.
#pragma once

#include <optional>

#include <lightwell/time.hpp>

namespace lightwell::core {

/// Two monotonic clocks that run at nearly the same rate. Each round trip says what the offset is,
/// within half its duration (RFC 5905, section 8, with one time stamp at the peer). The best is
/// kept: a slow round trip says nothing that a quick one did not say better. Pure; one thread at a
/// time.
class ClockMap {
 public:
  /// How far two quartz clocks may drift apart, each 50 ppm: the kept round trip is worth less by
  /// so much of its age.
  static constexpr double kDrift = 100e-6;

  /// The host sent at `sent` and had the answer at `received`; in between the probe read `probe`.
  /// Taken where it is at least as certain as the aged kept one, or contradicts it: then the
  /// probe's clock was set anew (it rebooted). A round trip that ended before it began is passed
  /// over.
  void add(HostTime sent, ProbeTime probe, HostTime received);

  [[nodiscard]] bool known() const { return kept_.has_value(); }

  /// Probe minus host; zero where nothing is known.
  [[nodiscard]] Duration offset() const;

  /// The true offset at `now` is within this of offset(); zero where nothing is known.
  [[nodiscard]] Duration uncertainty(HostTime now) const;

  [[nodiscard]] HostTime to_host(ProbeTime time) const { return {time.ns - offset().ns}; }

  void forget() { kept_.reset(); }

 private:
  struct RoundTrip {
    Duration offset;
    Duration half;
    HostTime received;
  };
  std::optional<RoundTrip> kept_;
};

}  // namespace lightwell::core
