// Offset and drift between the probe's and the host's clock, estimated from round trips; replay protection by time.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include <lightwell/time.hpp>

namespace lightwell::core {

/// A time of the probe mapped to the host's clock; the true value is within `uncertainty` of it.
struct MappedTime {
  HostTime at;
  Duration uncertainty;
};

/// Model: two monotonic clocks with a nearly constant rate difference. Each round trip bounds the offset to an interval
/// of its duration (RFC 5905, section 8, with one time stamp at the peer). The feasible set is all lines (offset,
/// drift) that pass through all intervals; the estimate is the centre of the feasible offsets, and the uncertainty half
/// their width, which is a hard bound. Short round trips narrow the set, long ones do not widen it, and two that are
/// far apart in time determine the drift. If no line is feasible, a clock was reset: then only the newest round trip is
/// used. No I/O, no allocation; one thread at a time.
class ClockMap {
 public:
  /// Largest drift between two quartz clocks of 50 ppm each.
  static constexpr double kMaxDrift = 100e-6;
  /// Largest change of the drift among the stored round trips: a quartz whose temperature changes by a few kelvin.
  static constexpr double kMaxDriftChange = 1e-6;
  /// Number of stored round trips.
  static constexpr std::size_t kMaxRoundTrips = 32;

  /// Adds a round trip: the host sent at `sent` and received the response at `received`; in between the probe read
  /// `probe` from its clock. Ignored if `received` is before `sent` or before the last round trip.
  void add(HostTime sent, ProbeTime probe, HostTime received);

  [[nodiscard]] bool known() const { return count_ > 0; }

  /// Probe time minus host time at `now`; zero if not known().
  [[nodiscard]] Duration offset(HostTime now) const;
  /// Maximum error of offset(now); zero if not known().
  [[nodiscard]] Duration uncertainty(HostTime now) const;
  /// Drift of the probe's clock against the host's, s/s; zero if not known().
  [[nodiscard]] double drift() const { return known() ? (slowest_ + fastest_) / 2 : 0; }

  /// Maps a probe time to the host's clock. The error grows by up to 100 ppm of the distance from the last round trip.
  [[nodiscard]] HostTime to_host(ProbeTime time) const;
  /// The same with the uncertainty at `now`.
  [[nodiscard]] MappedTime mapped(ProbeTime time, HostTime now) const { return {to_host(time), uncertainty(now)}; }

  void forget() { count_ = 0; }

 private:
  /// Differences to the newest round trip are computed in double.
  struct RoundTrip {
    HostTime at;
    Duration offset;
    std::int64_t half_ns = 0;
  };
  struct Range {
    double low = 0, high = 0;
  };
  /// Computes the feasible set of the stored round trips; false if it is empty.
  [[nodiscard]] bool fit();
  /// Range of the feasible offsets at `now`, minus the offset of the newest round trip, ns.
  [[nodiscard]] Range offsets(HostTime now) const;

  std::array<RoundTrip, kMaxRoundTrips> kept_{};  ///< Sorted by time.
  std::size_t count_ = 0;
  /// Vertices of the feasible polygon: offset at the newest round trip (ns, minus its own offset) and drift.
  std::array<std::array<double, 2>, 2 * kMaxRoundTrips + 8> corners_{};
  std::size_t corner_count_ = 0;
  double slowest_ = 0, fastest_ = 0;
};

/// Replay protection for brokers, where clients other than the probe may publish. A direct connection to the probe
/// delivers descriptors in order. A broker delivers whatever is published: also a recorded old descriptor, or one that
/// is dated in the future so that it never becomes stale. No I/O; one thread at a time.
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

/// Replay protection for the messages of captured planes, of which many have the same mid-exposure. The order within a
/// capture is checked by PlaneReader. One thread at a time.
class PlaneReplayProtection {
 public:
  enum class Verdict : std::uint8_t { refused, same_capture, other_capture };
  /// A capture of which no message was admitted for this long is replaced by any other, also by an earlier one: a
  /// message that another client forged does not exclude the probe's for longer. Three key intervals of the probe.
  static constexpr Duration kCaptureTimeout{30'000'000'000};
  /// A capture is replaced after this time at the earliest: each new one costs a reader megabytes of memory to clear.
  static constexpr Duration kMinCaptureTime{1'000'000'000};

  /// refused: later than `now` by more than the clock uncertainty; or of another capture than the last admitted
  /// message, and not later than all of that or within kMinCaptureTime of its first. clock.known() is required.
  [[nodiscard]] Verdict admit(std::uint32_t capture, ProbeTime mid_exposure, HostTime now, const ClockMap& clock) {
    // Prevents overflow of differences.
    constexpr std::int64_t kFar = std::numeric_limits<std::int64_t>::max() / 4;
    if (mid_exposure.ns < 0 || mid_exposure.ns > kFar) return Verdict::refused;
    const MappedTime mapped = clock.mapped(mid_exposure, now);
    if (mapped.at > now + mapped.uncertainty) return Verdict::refused;
    const bool same = last_ && last_->capture == capture;
    if (last_ && !same && now - last_->began < kMinCaptureTime) return Verdict::refused;
    if (last_ && !same && mid_exposure <= last_->mid_exposure && now - last_->admitted <= kCaptureTimeout)
      return Verdict::refused;
    last_ = same ? Admitted{capture, std::max(mid_exposure, last_->mid_exposure), last_->began, now}
                 : Admitted{capture, mid_exposure, now, now};
    return same ? Verdict::same_capture : Verdict::other_capture;
  }

  /// Call it after a reset of the probe's clock.
  void forget() { last_.reset(); }

 private:
  struct Admitted {
    std::uint32_t capture = 0;
    ProbeTime mid_exposure;    ///< Of the newest message.
    HostTime began, admitted;  ///< When the first and the last message of the capture were admitted.
  };
  std::optional<Admitted> last_;
};

}  // namespace lightwell::core
