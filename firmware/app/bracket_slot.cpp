#include "app/bracket_slot.hpp"

#include <utility>

namespace lightwell {

void BracketSlot::push(Frame frame) {
  Bracket replaced;  // Given back after the lock: a backend's release() is not ours to hold locks over.
  {
    const std::lock_guard lock(mutex_);
    ++counts_.frames;
    if (closed_) return;
    const int index = frame.info.bracket_index, size = frame.info.bracket_size;
    const bool next_in_line =
        index > 0 && static_cast<std::size_t>(index) == filling_.frames().size() &&
        filling_.frames().back().info.sequence + 1 == frame.info.sequence;
    if (index != 0 && !next_in_line) {
      // An exposure is missing: what came so far and the rest of this bracket are of no use.
      if (!filling_.empty()) ++counts_.incomplete;
      filling_.clear();
      return;
    }
    if (index == 0) {
      if (!filling_.empty()) ++counts_.incomplete;
      filling_.clear();
    }
    filling_.add(std::move(frame));
    if (index + 1 < size) return;
    if (!whole_.empty()) ++counts_.dropped;
    replaced = std::move(whole_);
    whole_ = std::move(filling_);
  }
  ready_.notify_one();
}

bool BracketSlot::take(Bracket& out) {
  out.clear();
  std::unique_lock lock(mutex_);
  ready_.wait(lock, [this] { return closed_ || !whole_.empty(); });
  if (closed_) return false;
  out = std::move(whole_);
  return true;
}

void BracketSlot::close() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    filling_.clear();
    whole_.clear();
  }
  ready_.notify_all();
}

BracketSlot::Counts BracketSlot::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

}  // namespace lightwell
