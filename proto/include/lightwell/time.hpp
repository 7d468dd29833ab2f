// Durations and time points; time points of different clocks (probe, host) are different types.
#pragma once

#include <chrono>
#include <compare>
#include <cstdint>

namespace lightwell {

struct Duration {
  std::int64_t ns = 0;

  [[nodiscard]] static constexpr Duration from_seconds(double s) { return {static_cast<std::int64_t>(s * 1e9)}; }
  [[nodiscard]] constexpr double seconds() const { return static_cast<double>(ns) * 1e-9; }
  [[nodiscard]] constexpr double milliseconds() const { return static_cast<double>(ns) * 1e-6; }

  friend constexpr auto operator<=>(const Duration&, const Duration&) = default;
  friend constexpr Duration operator+(Duration a, Duration b) { return {a.ns + b.ns}; }
  friend constexpr Duration operator-(Duration a, Duration b) { return {a.ns - b.ns}; }
};

/// Nanoseconds since an arbitrary epoch of a monotonic clock.
template <class Clock>
struct TimePoint {
  std::int64_t ns = 0;

  friend constexpr auto operator<=>(const TimePoint&, const TimePoint&) = default;
  friend constexpr Duration operator-(TimePoint a, TimePoint b) { return {a.ns - b.ns}; }
  friend constexpr TimePoint operator+(TimePoint a, Duration d) { return {a.ns + d.ns}; }
  friend constexpr TimePoint operator-(TimePoint a, Duration d) { return {a.ns - d.ns}; }
};

struct ProbeClock {};
struct HostClock {};

/// CLOCK_MONOTONIC of the machine that runs the firmware.
using ProbeTime = TimePoint<ProbeClock>;
/// CLOCK_MONOTONIC of the machine that runs the SDK.
using HostTime = TimePoint<HostClock>;

/// Nanoseconds of this machine's CLOCK_MONOTONIC: probe time in the firmware, host time in the SDK.
[[nodiscard]] inline std::int64_t monotonic_now_ns() {
  return std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace lightwell
