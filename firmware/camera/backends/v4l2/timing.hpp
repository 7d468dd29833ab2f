// Exposure time and sequence number of a frame, from the driver's metadata of a buffer.
//   Timestamp, RowTiming, validate_timestamp(), mid_exposure()
//   SequenceCounter
//   LatencyMonitor
#pragma once

#include <array>
#include <cstdint>

#include <lightwell/time.hpp>

#include "imaging/frame.hpp"

namespace lightwell::v4l2 {

/// A time of CLOCK_MONOTONIC and the event it refers to.
struct Timestamp {
  enum class Event : std::uint8_t {
    start_of_exposure,  ///< Of the first row.
    end_of_frame,       ///< The last row has been read out.
  };
  ProbeTime at;
  Event event = Event::end_of_frame;
};

/// Rolling shutter: timing of the rows of the driver's picture.
struct RowTiming {
  int count = 0;
  double centre = 0;  ///< Row that the mid-exposure time refers to, from 0: the middle of the view.
  Duration readout;   ///< Delay between successive rows.
};

/// The timestamp of a buffer. `flags`: V4L2's; `arrival`: time of dequeuing. If the clock is not CLOCK_MONOTONIC, or
/// the timestamp is in the future or more than `oldest` before the arrival (errors of drivers that convert a device's
/// clock), the arrival is used as the end of the frame.
[[nodiscard]] Timestamp validate_timestamp(std::uint32_t flags, ProbeTime stamp, ProbeTime arrival, Duration oldest);

/// Middle of the exposure of row rows.centre.
///   start_of_exposure: row r begins r readouts later; its middle is half the exposure after that.
///   end_of_frame: row r's exposure ended (count - r) readouts earlier; its middle is half the exposure before that.
[[nodiscard]] ProbeTime mid_exposure(const Timestamp& stamp, double exposure_s, const RowTiming& rows);

/// Extends a driver's 32-bit sequence numbers, which restart with each stream, to 64 bits that always increase.
class SequenceCounter {
 public:
  /// The driver's counter restarts. `lost`: number of frames lost in between.
  void restart(std::uint64_t lost = 0);
  /// Number of the next frame. Gaps of the driver are kept. If the driver's number does not increase, the result is the
  /// previous one plus 1.
  [[nodiscard]] std::uint64_t number(std::uint32_t driver);

 private:
  std::uint64_t next_ = 0;
  std::uint32_t driver_ = 0;
  bool fresh_ = true;
};

/// Detects that the thread handled a frame later than usual. After a delay of half a frame no newer frame is waiting
/// yet, but a control that is set then may take effect a frame too late.
class LatencyMonitor {
 public:
  /// `latency`: from the frame's timestamp to the write of the control. `index`: index in the cycle; minima are kept
  /// per index, because timestamps of the start of exposure make long exposures look late. False if the latency exceeds
  /// the minimum of the last 64 to 128 frames by more than a third of `interval`.
  [[nodiscard]] bool in_time(int index, Duration latency, Duration interval);

 private:
  static constexpr int kBlock = 64;
  static constexpr Duration kNever{INT64_MAX};
  struct LatencyMinimum {
    Duration before = kNever, now = kNever;  ///< Of the previous block and of this one.
    int count = 0;
  };
  std::array<LatencyMinimum, kMaxBracket> minima_{};
};

}  // namespace lightwell::v4l2
