// When a frame was exposed, and which number it has: from what a driver says of a buffer.
//   Stamp, Rows, validate_timestamp(), mid_exposure()
//   SequenceCounter
//   LatencyMonitor
#pragma once

#include <array>
#include <cstdint>

#include <lightwell/time.hpp>

#include "camera/frame.hpp"

namespace lightwell::v4l2 {

/// An instant of CLOCK_MONOTONIC and what happened then.
struct Timestamp {
  enum class Event : std::uint8_t {
    start_of_exposure,  ///< Of the first row.
    end_of_frame,       ///< The last row has been read out.
  };
  ProbeTime at;
  Event event = Event::end_of_frame;
};

/// What the shutter does to the rows of the driver's picture.
struct RowTiming {
  int count = 0;
  double centre = 0;  ///< Number of the row that counts, from 0: the middle of what frames show.
  Duration readout;   ///< From one row's exposure to the next row's.
};

/// What a driver says of a buffer's time. `flags` are V4L2's; `arrival` is when the buffer was taken. Where the clock
/// is not CLOCK_MONOTONIC, and where the stamp lies in the future or more than `oldest` ago (drivers that convert a
/// device's clock err like that), the arrival stands in as the end of the frame.
[[nodiscard]] Timestamp validate_timestamp(std::uint32_t flags, ProbeTime stamp, ProbeTime arrival, Duration oldest);

/// Of the centre row.
///   start_of_exposure: row r begins r readouts later, and half the exposure after that is its middle.
///   end_of_frame: row r's exposure ended (count - r) readouts earlier, and its middle half the exposure before that.
[[nodiscard]] ProbeTime mid_exposure(const Timestamp& stamp, double exposure_s, const RowTiming& rows);

/// Numbers that grow for ever, from a driver's 32 bits that start anew with each stream.
class SequenceCounter {
 public:
  /// The driver counts anew. `lost`: frames that nobody saw meanwhile.
  void restart(std::uint64_t lost = 0);
  /// A gap of the driver's is a gap. A driver that repeats itself or goes back does not count: then it is the next one.
  [[nodiscard]] std::uint64_t number(std::uint32_t driver);

 private:
  std::uint64_t next_ = 0;
  std::uint32_t driver_ = 0;
  bool fresh_ = true;
};

/// Whether a frame was answered about as soon as others were. A thread that was held up for half a frame sees no newer
/// one waiting, and what it sets may come too late for the frame that it was meant for.
class LatencyMonitor {
 public:
  /// Of one frame: `latency` from its stamp to the answer. `index` is its place in the cycle, as stamps of the start
  /// make long exposures look late. False for more than a third of `interval` beyond the least of the last 64 to 128.
  [[nodiscard]] bool in_time(int index, Duration latency, Duration interval);

 private:
  static constexpr int kBlock = 64;
  static constexpr Duration kNever{INT64_MAX};
  struct LatencyMinimum {
    Duration before = kNever, now = kNever;  ///< Of the block before and of this one.
    int count = 0;
  };
  std::array<LatencyMinimum, kMaxBracket> minima_{};
};

}  // namespace lightwell::v4l2
