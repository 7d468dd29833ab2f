// Time, sequence number and exposure of a frame, from the driver's metadata of a buffer.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

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

/// Frame s should have index s % bracket of the cycle. A value that is set when s is the newest frame takes effect at
/// frame s + delay. Frames whose value was set too late, or not at all because frames were lost, have no index.
class ExposureSchedule {
 public:
  /// bracket 1 to kMaxBracket, delay 1 to kMaxDelay.
  static constexpr int kMaxDelay = 30;
  ExposureSchedule(int bracket, int delay);

  /// Discards all writes: the exposure of the next frames is unknown.
  void restart() { count_ = 0; }

  struct Write {
    std::uint64_t from = 0;  ///< First frame with this exposure.
    int index = 0;           ///< Index in the cycle.
  };
  /// The write that is due after frame `newest`; empty if it was made already, or the exposure is constant.
  [[nodiscard]] std::optional<Write> due(std::uint64_t newest) const;

  enum class Outcome : std::uint8_t {
    in_time,
    uncertain,  ///< It failed, or another frame had come by then: it may take effect a frame later.
  };
  void written(const Write& write, Outcome outcome);

  /// Index in the cycle of a frame's exposure; empty if it is unknown or not the one that the frame should have.
  [[nodiscard]] std::optional<int> index_of(std::uint64_t sequence) const;

 private:
  static constexpr int kUnknown = -1;
  struct Change {
    std::uint64_t from = 0;
    int index = kUnknown;
  };

  int bracket_, delay_;
  /// Ring buffer of the newest changes; more than can be pending.
  std::array<Change, 2 * static_cast<std::size_t>(kMaxDelay) + 4> changes_{};
  std::size_t count_ = 0;
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
