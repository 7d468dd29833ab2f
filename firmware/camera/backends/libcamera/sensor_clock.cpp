#include "camera/backends/libcamera/sensor_clock.hpp"

#include <ctime>

namespace lightwell::libcam {
namespace {

/// Largest plausible age of a frame on arrival.
constexpr std::int64_t kMaxAge_ns = 5'000'000'000;

std::int64_t clock_ns(clockid_t id) {
  timespec t{};
  clock_gettime(id, &t);
  return static_cast<std::int64_t>(t.tv_sec) * 1'000'000'000 + t.tv_nsec;
}

}  // namespace

ClockReading read_clocks() {
  // CLOCK_MONOTONIC is read before and after CLOCK_BOOTTIME, and averaged, so that the time between the calls cancels.
  const std::int64_t before = clock_ns(CLOCK_MONOTONIC);
  const std::int64_t boottime = clock_ns(CLOCK_BOOTTIME);
  const std::int64_t after = clock_ns(CLOCK_MONOTONIC);
  return {before + (after - before) / 2, boottime};
}

std::optional<ProbeTime> SensorClock::to_probe_time(std::int64_t timestamp_ns, const ClockReading& now) {
  const auto plausible = [&](std::int64_t t) {
    return t > 0 && t <= now.monotonic_ns && t >= now.monotonic_ns - kMaxAge_ns;
  };
  if (timestamp_ns <= 0) return std::nullopt;
  const std::int64_t slept_ns = now.boottime_ns - now.monotonic_ns;
  const std::int64_t from_boottime = timestamp_ns - slept_ns;
  if (!boottime_ && plausible(timestamp_ns)) return ProbeTime{timestamp_ns};
  if (!plausible(from_boottime)) return std::nullopt;
  boottime_ = true;
  return ProbeTime{from_boottime};
}

ProbeTime exposure_begin(ProbeTime stamp, const FrameTiming& timing) {
  return timing.event == TimestampEvent::exposure ? stamp : stamp - Duration::from_seconds(timing.exposure_s);
}

ProbeTime mid_exposure(ProbeTime stamp, const FrameTiming& timing) {
  const Duration half_exposure = Duration::from_seconds(timing.exposure_s / 2);
  const Duration to_centre{timing.row_readout.ns * timing.rows / 2};
  return exposure_begin(stamp, timing) + half_exposure + to_centre;
}

}  // namespace lightwell::libcam
