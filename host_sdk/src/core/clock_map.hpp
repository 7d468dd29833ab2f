// The probe's clock against the host's, from round trips.
#pragma once

#include <array>
#include <cstddef>

#include <lightwell/time.hpp>

namespace lightwell::core {

/// A moment of the probe's in the host's clock; the truth is within `uncertainty` of it.
struct MappedTime {
  HostTime at;
  Duration uncertainty;
};

/// Two monotonic clocks that run at nearly the same rate. Each round trip says that the offset was within half its
/// duration of a value (RFC 5905, section 8, with one time stamp at the peer). Offsets that lie on a straight line
/// through all of these intervals are possible, and no others: what is said is the middle of the possible ones, and the
/// uncertainty is half their width, so that the truth is never outside. A quick round trip narrows the line, a slow one
/// cannot widen it, and two that are far apart tell the drift. What no line explains is a clock that was set anew: then
/// only the newest counts. Pure, without a heap; one thread at a time.
class ClockMap {
 public:
  /// How far two quartz clocks may drift apart, each 50 ppm.
  static constexpr double kMaxDrift = 100e-6;
  /// How far the drift itself may wander while round trips are kept: quartz over some degrees in a quarter of an hour.
  static constexpr double kMaxDriftChange = 1e-6;
  /// Round trips that are kept.
  static constexpr std::size_t kMaxRoundTrips = 32;

  /// The host sent at `sent` and had the answer at `received`; in between the probe read `probe`. A round trip that
  /// ended before it began is passed over.
  void add(HostTime sent, ProbeTime probe, HostTime received);

  [[nodiscard]] bool known() const { return count_ > 0; }

  /// Probe minus host at `now`, by the host's clock; zero where nothing is known.
  [[nodiscard]] Duration offset(HostTime now) const;
  /// The true offset at `now` is within this of offset(now); zero where nothing is known.
  [[nodiscard]] Duration uncertainty(HostTime now) const;
  /// How fast the probe's clock gains on the host's, seconds a second; zero where nothing is known.
  [[nodiscard]] double drift() const { return known() ? (slowest_ + fastest_) / 2 : 0; }

  /// Of moments about the last round trip, within 100 ppm of the distance from it.
  [[nodiscard]] HostTime to_host(ProbeTime time) const;
  /// The same with what is open about it at `now`.
  [[nodiscard]] MappedTime mapped(ProbeTime time, HostTime now) const { return {to_host(time), uncertainty(now)}; }

  void forget() { count_ = 0; }

 private:
  /// In ns from the newest round trip, so that doubles hold them.
  struct RoundTrip {
    HostTime at;
    Duration offset;
    std::int64_t half_ns = 0;
  };
  struct Range {
    double low = 0, high = 0;
  };
  /// Fills what the lines through all that is kept say; false where there is none.
  [[nodiscard]] bool fit();
  /// Of the possible offsets at `now`, less that of the newest round trip.
  [[nodiscard]] Range offsets(HostTime now) const;

  std::array<RoundTrip, kMaxRoundTrips> kept_{};  ///< By time.
  std::size_t count_ = 0;
  /// Corners of what is possible: offset at the newest round trip (ns, less its own) and drift.
  std::array<std::array<double, 2>, 2 * kMaxRoundTrips + 8> corners_{};
  std::size_t corner_count_ = 0;
  double slowest_ = 0, fastest_ = 0;
};

}  // namespace lightwell::core
