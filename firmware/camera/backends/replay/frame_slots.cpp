#include "camera/backends/replay/frame_slots.hpp"

#include <chrono>

namespace lightwell::replay {

FrameSlots::FrameSlots(int lendable, int read_ahead)
    : frames_(static_cast<std::size_t>(lendable + read_ahead)), lendable_(lendable) {
  free_.reserve(frames_.size());
  ready_.reserve(frames_.size());
  for (int i = 0; i < lendable + read_ahead; ++i) free_.push_back(i);
}

void FrameSlots::begin() {
  const std::lock_guard lock(mutex_);
  free_.insert(free_.end(), ready_.begin(), ready_.end());
  ready_.clear();
  stopped_ = false;
  ended_ = false;
}

void FrameSlots::stop() {
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  changed_.notify_all();
}

int FrameSlots::wait_free() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return stopped_ || !free_.empty(); });
  if (stopped_) return kNone;
  const int slot = free_.back();
  free_.pop_back();
  return slot;
}

void FrameSlots::make_ready(int slot) {
  const std::lock_guard lock(mutex_);
  ready_.push_back(slot);
  changed_.notify_all();
}

void FrameSlots::end() {
  const std::lock_guard lock(mutex_);
  ended_ = true;
  changed_.notify_all();
}

FrameSlots::Ready FrameSlots::wait_ready() {
  std::unique_lock lock(mutex_);
  Ready ready;
  if (ready_.empty()) ready.read_timing = ReadTiming::late;
  changed_.wait(lock, [this] { return stopped_ || ended_ || !ready_.empty(); });
  if (stopped_ || ready_.empty()) return ready;
  ready.slot = ready_.front();
  ready_.erase(ready_.begin());
  return ready;
}

bool FrameSlots::wait_until(ProbeTime due) {
  // steady_clock is CLOCK_MONOTONIC on Linux, the probe's clock.
  const std::chrono::steady_clock::time_point when{std::chrono::nanoseconds(due.ns)};
  std::unique_lock lock(mutex_);
  return !changed_.wait_until(lock, when, [this] { return stopped_; });
}

bool FrameSlots::may_lend() {
  const std::lock_guard lock(mutex_);
  return lent_ < lendable_;
}

bool FrameSlots::wait_may_lend() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return stopped_ || lent_ < lendable_; });
  return !stopped_;
}

Frame FrameSlots::lend(int slot) {
  {
    const std::lock_guard lock(mutex_);
    ++lent_;
  }
  const StoredFrame& stored = frame(slot);
  Frame out(*this, slot);
  out.info = stored.info;
  for (std::size_t i = 0; i < stored.view_count; ++i) out.add_view(stored.views[i]);
  return out;
}

void FrameSlots::drop(int slot) {
  const std::lock_guard lock(mutex_);
  free_.push_back(slot);
  changed_.notify_all();
}

bool FrameSlots::stopped() {
  const std::lock_guard lock(mutex_);
  return stopped_;
}

void FrameSlots::release(int slot) {
  const std::lock_guard lock(mutex_);
  --lent_;
  free_.push_back(slot);
  changed_.notify_all();
}

}  // namespace lightwell::replay
