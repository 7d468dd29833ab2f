#include "camera/backends/libcamera/frame_pairs.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "camera/bracket_cycle.hpp"

namespace lightwell::libcam {

PendingFrame FramePairer::FrameQueue::take_front() {
  const PendingFrame front = frames[0];
  std::move(frames.begin() + 1, frames.begin() + static_cast<std::ptrdiff_t>(size), frames.begin());
  --size;
  return front;
}

void FramePairer::offer(int lens, const PendingFrame& frame) {
  const auto l = static_cast<std::size_t>(lens);
  FrameQueue& queue = queues_[l];
  if ((queue.seen && frame.at <= queue.last) || queue.size == queue.frames.size()) {
    // A full queue cannot occur if the caller calls next() after each offer().
    ++counts_.disordered[l];
    refused_.kind = Kind::dropped;
    refused_.lens = lens;
    refused_.tokens[l] = frame.token;
    return;
  }
  queue.seen = true;
  queue.last = frame.at;
  queue.frames[queue.size++] = frame;
}

FramePairer::PairResult FramePairer::drop_front(int lens) {
  const auto l = static_cast<std::size_t>(lens);
  ++counts_.unpaired[l];
  PairResult v{Kind::dropped, lens, {}};
  v.tokens[l] = queues_[l].take_front().token;
  return v;
}

FramePairer::PairResult FramePairer::next() {
  if (refused_.kind != Kind::nothing) return std::exchange(refused_, {});
  FrameQueue& a = queues_[0];
  FrameQueue& b = queues_[1];
  if (a.size > 0 && b.size > 0) {
    const Duration apart = a.frames[0].at - b.frames[0].at;
    // Frames come in order, so the older one cannot get a nearer counterpart.
    if (apart > half_) return drop_front(1);
    if (apart < Duration{} - half_) return drop_front(0);
    ++counts_.pairs;
    const int first = a.take_front().token, second = b.take_front().token;
    return {Kind::pair, 0, {first, second}};
  }
  for (const int lens : {0, 1})
    if (queues_[static_cast<std::size_t>(lens)].size > kMaxWaiting) return drop_front(lens);
  return {};
}

void FramePairer::restart() {
  queues_ = {};
  refused_ = {};
}

std::optional<int> index_in_cycle(std::span<const double> exposure_s, double in_force_s) {
  std::optional<int> found;
  for (std::size_t i = 0; i < exposure_s.size(); ++i) {
    if (!(std::abs(in_force_s - exposure_s[i]) <= kExposureTolerance * exposure_s[i])) continue;
    if (found) return std::nullopt;
    found = static_cast<int>(i);
  }
  return found;
}

bool distinct(std::span<const double> exposure_s) {
  // No value may be within the tolerance of two exposures.
  for (std::size_t i = 0; i < exposure_s.size(); ++i)
    for (std::size_t k = 0; k < exposure_s.size(); ++k)
      if (i != k && std::abs(exposure_s[i] - exposure_s[k]) <= kExposureTolerance * (exposure_s[i] + exposure_s[k]))
        return false;
  return true;
}

int CycleAlignment::observe(int first, int second) {
  const int apart = ((first - second) % size_ + size_) % size_;
  if (apart == 0) {
    waited_ = patience_;
    return 0;
  }
  if (waited_ < patience_) {
    ++waited_;
    return 0;
  }
  waited_ = 0;
  return apart;
}

}  // namespace lightwell::libcam
