// Converts libcamera's timestamps to mid-exposure times in the probe's clock (CLOCK_MONOTONIC).
//
// libcamera documents SensorTimestamp as CLOCK_BOOTTIME, but passes on the timestamp of the kernel's driver, which is
// usually CLOCK_MONOTONIC. The two differ by the time the machine was suspended, so a timestamp that lies in the future
// of CLOCK_MONOTONIC must be CLOCK_BOOTTIME.
#pragma once

#include <cstdint>
#include <optional>

#include <lightwell/time.hpp>

namespace lightwell::libcam {

/// Both clocks at one instant.
struct ClockReading {
  std::int64_t monotonic_ns = 0;
  std::int64_t boottime_ns = 0;  ///< Includes the time the machine was suspended.
};
[[nodiscard]] ClockReading read_clocks();

class SensorClock {
 public:
  /// Converts to CLOCK_MONOTONIC; `now` is the time of arrival. Empty if the timestamp fits neither clock: it is not
  /// before `now`, or more than 5 s ago. Once a timestamp can only be CLOCK_BOOTTIME, all later ones are read as such.
  [[nodiscard]] std::optional<ProbeTime> to_probe_time(std::int64_t timestamp_ns, const ClockReading& now);

 private:
  bool boottime_ = false;
};

/// The event that a camera's timestamp refers to.
enum class TimestampEvent : std::uint8_t {
  readout,   ///< The first row is read out (its exposure ends): drivers that stamp on arrival, CSI-2 and USB.
  exposure,  ///< The first row's exposure begins, as libcamera documents it.
};

/// Rows are exposed `row_readout` after one another (zero for a global shutter).
struct FrameTiming {
  double exposure_s = 0;
  Duration row_readout;
  int rows = 0;
  TimestampEvent event = TimestampEvent::readout;
};

/// Middle of the centre row's exposure.
[[nodiscard]] ProbeTime mid_exposure(ProbeTime stamp, const FrameTiming& timing);
/// Start of the first row's exposure.
[[nodiscard]] ProbeTime exposure_begin(ProbeTime stamp, const FrameTiming& timing);

}  // namespace lightwell::libcam
