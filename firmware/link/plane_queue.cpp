#include "link/plane_queue.hpp"

#include <utility>

namespace lightwell {

void PlaneQueue::put(std::shared_ptr<const EncodedPlane> plane) {
  // The replaced one is never sent, so changes to it are no use to the client.
  if (next_) {
    needs_whole_ = true;
    ++replaced_;
  }
  next_ = std::move(plane);
}

EncodedMessage PlaneQueue::take() {
  if (!current_) {
    if (!next_) return nullptr;
    current_ = std::exchange(next_, nullptr);
    messages_ = std::exchange(needs_whole_, false) ? &current_->whole : &current_->changes;
    sent_ = 0;
  }
  EncodedMessage message;
  if (sent_ < messages_->size()) message = EncodedMessage(current_, &(*messages_)[sent_++]);
  if (sent_ >= messages_->size()) current_.reset();
  return message;
}

void PlaneQueue::clear() {
  current_.reset();
  next_.reset();
  needs_whole_ = true;
}

}  // namespace lightwell
