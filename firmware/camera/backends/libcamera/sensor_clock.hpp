// From libcamera's timestamps to the middle of an exposure in the probe's clock.
//
// libcamera documents SensorTimestamp as CLOCK_BOOTTIME, and hands through what the kernel's driver stamps, which is
// CLOCK_MONOTONIC with most. They differ by the time that the machine has slept: so a stamp is read as the clock by
// which the frame is not from the future.
#pragma once

#include <cstdint>
#include <optional>

#include <lightwell/time.hpp>

namespace lightwell::libcam {

/// Both clocks at one instant.
struct ClockReading {
  std::int64_t monotonic_ns = 0;
  std::int64_t boottime_ns = 0;  ///< Also counts while the machine sleeps.
};
[[nodiscard]] ClockReading read_clocks();

class SensorClock {
 public:
  /// In CLOCK_MONOTONIC, `now` being just after the frame came. Nothing where the stamp is of neither clock: not before
  /// `now`, or more than 5 s ago. Once a stamp can only be CLOCK_BOOTTIME, all later ones are.
  [[nodiscard]] std::optional<ProbeTime> to_probe_time(std::int64_t timestamp_ns, const ClockReading& now);

 private:
  bool boottime_ = false;
};

/// What happens at the instant that a camera stamps.
enum class TimestampEvent : std::uint8_t {
  readout,   ///< The first row is read out (its exposure ends): where the driver stamps what arrives, CSI-2 and USB.
  exposure,  ///< The first row's exposure begins: libcamera's documentation to the letter.
};

/// Rows expose one after the other, `row_readout` apart (zero for a global shutter).
struct FrameTiming {
  double exposure_s = 0;
  Duration row_readout;
  int rows = 0;
  TimestampEvent event = TimestampEvent::readout;
};

/// Of the centre row.
[[nodiscard]] ProbeTime mid_exposure(ProbeTime stamp, const FrameTiming& timing);
/// Of the first row.
[[nodiscard]] ProbeTime exposure_begin(ProbeTime stamp, const FrameTiming& timing);

}  // namespace lightwell::libcam
