#include "app/bracket_slot.hpp"

#include <utility>

namespace lightwell {

void BracketSlot::push(Frame frame) {
  Bracket replaced, incomplete;  // Released after the lock, because a backend's release() must not run under it.
  {
    const std::lock_guard lock(mutex_);
    // Only a forward jump is a loss: a restarted camera may begin again at 0.
    if (counts_.frames > 0 && frame.info.sequence > last_sequence_ + 1)
      counts_.lost += frame.info.sequence - last_sequence_ - 1;
    last_sequence_ = frame.info.sequence;
    ++counts_.frames;
    if (closed_) return;
    const int index = frame.info.bracket_index, size = frame.info.bracket_size;
    const std::uint64_t first = frame.info.sequence - static_cast<std::uint64_t>(index);
    const bool continues = index > 0 && static_cast<std::size_t>(index) == filling_.frames().size() &&
                           filling_.frames().back().info.sequence + 1 == frame.info.sequence;
    if (!continues) {
      if (!filling_.empty()) count_incomplete(filling_.frames().front().info.sequence);
      incomplete = std::move(filling_);
    }
    if (index > 0 && !continues) {
      // An exposure is missing, so the rest of this bracket is discarded, too.
      count_incomplete(first);
      return;
    }
    filling_.add(std::move(frame));
    if (index + 1 < size) return;
    if (!whole_.empty()) ++counts_.dropped;
    replaced = std::move(whole_);
    whole_ = std::move(filling_);
  }
  ready_.notify_one();
}

void BracketSlot::count_incomplete(std::uint64_t first_sequence) {
  if (last_incomplete_ == first_sequence) return;
  last_incomplete_ = first_sequence;
  ++counts_.incomplete;
}

bool BracketSlot::take(Bracket& out) {
  out.clear();
  std::unique_lock lock(mutex_);
  ready_.wait(lock, [this] { return closed_ || !whole_.empty(); });
  if (closed_) return false;
  out = std::move(whole_);
  lock.unlock();
  space_available_.notify_one();
  return true;
}

bool BracketSlot::wait_for_space(std::stop_token stop) {
  std::unique_lock lock(mutex_);
  return space_available_.wait(lock, std::move(stop), [this] { return !closed_ && whole_.empty(); });
}

void BracketSlot::close() {
  Bracket filling, whole;
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    filling = std::move(filling_);
    whole = std::move(whole_);
  }
  ready_.notify_all();
}

BracketSlot::Counts BracketSlot::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

}  // namespace lightwell
