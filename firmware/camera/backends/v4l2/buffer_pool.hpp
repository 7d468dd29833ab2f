// Tracks which memory is lent: the driver's buffers, or own buffers with converted pictures.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "camera/backends/v4l2/device.hpp"
#include "camera/backends/v4l2/v4l2_backend.hpp"
#include "imaging/frame.hpp"

namespace lightwell::v4l2 {

/// Lends a slot with each frame. Thread-safe, except adopt(), retire(), lend_buffer(), take_idle() and take_returned(),
/// which concern the buffers of the current device and are called by the streaming thread.
class BufferPool final : public FrameOwner {
 public:
  /// V4L2's limit per queue.
  static constexpr std::size_t kMaxBuffers = 32;

  /// At most `limit` frames are lent at the same time, including those of devices that are gone.
  explicit BufferPool(int limit) : slots_(static_cast<std::size_t>(limit)) {
    for (int slot = 0; slot < limit; ++slot) free_.push_back(slot);
    returned_.reserve(kMaxBuffers);
  }

  /// Takes over the buffers of a newly opened device.
  void adopt(MappedBuffers buffers) {
    const std::lock_guard lock(mutex_);
    current_ = std::make_shared<const MappedBuffers>(std::move(buffers));
    returned_.clear();
  }
  /// The device is gone; its buffers are unmapped when their last frame is released.
  void retire() {
    const std::lock_guard lock(mutex_);
    current_.reset();
    returned_.clear();
  }
  [[nodiscard]] std::span<const MappedBuffers::Buffer> buffers() const { return current_->all(); }

  /// Allocates memory for a converted picture in each slot, aligned for any format.
  void allocate(std::size_t bytes_each) {
    constexpr std::size_t kUnit = sizeof(std::max_align_t);
    picture_bytes_ = bytes_each;
    for (Slot& slot : slots_) slot.picture = std::make_unique<std::max_align_t[]>((bytes_each + kUnit - 1) / kUnit);
  }

  [[nodiscard]] bool may_lend() const {
    const std::lock_guard lock(mutex_);
    return !free_.empty();
  }
  /// Requires may_lend(), and that the buffer is not lent.
  [[nodiscard]] Frame lend_buffer(int index) {
    const std::lock_guard lock(mutex_);
    Slot& slot = slots_[static_cast<std::size_t>(free_.back())];
    slot.buffers = current_;
    slot.index = index;
    return take_slot();
  }
  /// Requires may_lend(). `picture`: the memory for it.
  [[nodiscard]] Frame lend_picture(std::span<std::byte>& picture) {
    const std::lock_guard lock(mutex_);
    auto* const memory = slots_[static_cast<std::size_t>(free_.back())].picture.get();
    picture = {reinterpret_cast<std::byte*>(memory), picture_bytes_};
    return take_slot();
  }

  /// Before streaming: replaces `out` by all buffers of the current device that are not lent.
  void take_idle(std::vector<int>& out) {
    const std::lock_guard lock(mutex_);
    out.clear();
    for (int i = 0; i < static_cast<int>(current_->all().size()); ++i) {
      const auto has_it = [&](const Slot& slot) { return slot.buffers == current_ && slot.index == i; };
      if (std::ranges::none_of(slots_, has_it)) out.push_back(i);
    }
    // The returned buffers are among the idle ones.
    returned_.clear();
  }
  /// While streaming: replaces `out`, which has the capacity kMaxBuffers, by the buffers released since the last call.
  void take_returned(std::vector<int>& out) {
    const std::lock_guard lock(mutex_);
    out.clear();
    std::swap(out, returned_);
  }

  /// The DMABUF that contains a lent address; empty if none does.
  [[nodiscard]] std::optional<V4l2Camera::DmaBuffer> dma_buffer(const std::byte* address) const {
    const std::lock_guard lock(mutex_);
    for (const Slot& slot : slots_) {
      if (!slot.buffers) continue;
      const MappedBuffers::Buffer& buffer = slot.buffers->all()[static_cast<std::size_t>(slot.index)];
      const std::byte* const begin = buffer.memory.data();
      if (address < begin || address >= begin + buffer.memory.size() || buffer.dmabuf.get() < 0) continue;
      return V4l2Camera::DmaBuffer{buffer.dmabuf.get(), static_cast<std::size_t>(address - begin)};
    }
    return std::nullopt;
  }

  void release(int slot) override {
    const std::lock_guard lock(mutex_);
    Slot& released = slots_[static_cast<std::size_t>(slot)];
    if (released.buffers && released.buffers == current_) returned_.push_back(released.index);
    released.buffers.reset();
    free_.push_back(slot);
  }

 private:
  struct Slot {
    std::shared_ptr<const MappedBuffers> buffers;  ///< Set while a buffer of the driver is lent.
    int index = 0;                                 ///< Of that buffer.
    std::unique_ptr<std::max_align_t[]> picture;
  };

  Frame take_slot() {
    const int slot = free_.back();
    free_.pop_back();
    return {*this, slot};
  }

  mutable std::mutex mutex_;
  std::vector<Slot> slots_;
  std::shared_ptr<const MappedBuffers> current_;  ///< Null without a device.
  std::vector<int> free_, returned_;              ///< Free slots; buffers of current_.
  std::size_t picture_bytes_ = 0;
};

}  // namespace lightwell::v4l2
