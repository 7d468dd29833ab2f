#include "camera/backends/v4l2/timing.hpp"

#include <algorithm>
#include <cmath>

#include <linux/videodev2.h>

namespace lightwell::v4l2 {

Timestamp validate_timestamp(std::uint32_t flags, ProbeTime stamp, ProbeTime arrival, Duration oldest) {
  const bool monotonic = (flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  if (!monotonic || stamp > arrival || arrival - stamp > oldest) return {arrival, Timestamp::Event::end_of_frame};
  const bool start = (flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  return {stamp, start ? Timestamp::Event::start_of_exposure : Timestamp::Event::end_of_frame};
}

ProbeTime mid_exposure(const Timestamp& stamp, double exposure_s, const RowTiming& rows) {
  const Duration half{std::llround(exposure_s * 1e9 / 2)};
  const auto rows_long = [&rows](double n) { return Duration{std::llround(n * static_cast<double>(rows.readout.ns))}; };
  if (stamp.event == Timestamp::Event::start_of_exposure) return stamp.at + rows_long(rows.centre) + half;
  return stamp.at - rows_long(rows.count - rows.centre) - half;
}

void SequenceCounter::restart(std::uint64_t lost) {
  next_ += lost;
  fresh_ = true;
}

std::uint64_t SequenceCounter::number(std::uint32_t driver) {
  // The unsigned difference, converted to signed, is correct across the 32-bit overflow.
  const auto step = static_cast<std::int32_t>(driver - driver_);
  if (!fresh_ && step > 1) next_ += static_cast<std::uint64_t>(step - 1);
  fresh_ = false;
  driver_ = driver;
  return next_++;
}

ExposureSchedule::ExposureSchedule(int bracket, int delay)
    : bracket_(std::clamp(bracket, 1, kMaxBracket)), delay_(std::clamp(delay, 1, kMaxDelay)) {}

std::optional<ExposureSchedule::Write> ExposureSchedule::due(std::uint64_t newest) const {
  if (bracket_ == 1) return std::nullopt;
  const std::uint64_t from = newest + static_cast<std::uint64_t>(delay_);
  if (count_ > 0 && changes_[(count_ - 1) % changes_.size()].from >= from) return std::nullopt;
  return Write{from, static_cast<int>(from % static_cast<std::uint64_t>(bracket_))};
}

void ExposureSchedule::written(const Write& write, Outcome outcome) {
  changes_[count_ % changes_.size()] = {write.from, outcome == Outcome::in_time ? write.index : kUnknown};
  ++count_;
}

std::optional<int> ExposureSchedule::index_of(std::uint64_t sequence) const {
  if (bracket_ == 1) return 0;
  const std::size_t kept = std::min(count_, changes_.size());
  for (std::size_t back = 1; back <= kept; ++back) {
    const Change& change = changes_[(count_ - back) % changes_.size()];
    if (change.from > sequence) continue;
    const int own = static_cast<int>(sequence % static_cast<std::uint64_t>(bracket_));
    return change.index == own ? std::optional(own) : std::nullopt;
  }
  return std::nullopt;
}

bool LatencyMonitor::in_time(int index, Duration latency, Duration interval) {
  LatencyMinimum& least = minima_[static_cast<std::size_t>(index)];
  if (least.count++ == kBlock) {
    least.before = least.now;
    least.now = kNever;
    least.count = 1;
  }
  least.now = std::min(least.now, latency);
  return latency - std::min(least.before, least.now) <= Duration{interval.ns / 3};
}

}  // namespace lightwell::v4l2
