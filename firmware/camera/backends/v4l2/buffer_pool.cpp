#include "camera/backends/v4l2/buffer_pool.hpp"

#include <algorithm>
#include <utility>

namespace lightwell::v4l2 {

BufferPool::BufferPool(int limit) : limit_(limit), sets_(static_cast<std::size_t>(limit) + 1) {}

void BufferPool::adopt(MappedBuffers buffers) {
  const std::lock_guard lock(mutex_);
  const auto empty = std::ranges::find_if(sets_, [](const Set& s) { return s.mapped.all().empty(); });
  current_ = static_cast<int>(empty - sets_.begin());
  *empty = {};
  empty->mapped = std::move(buffers);
  returned_count_ = 0;
}

void BufferPool::retire() {
  const std::lock_guard lock(mutex_);
  if (current_ == kNone) return;
  Set& set = sets_[static_cast<std::size_t>(std::exchange(current_, kNone))];
  if (set.lent_count == 0) set.mapped.clear();
  returned_count_ = 0;
}

std::span<const MappedBuffers::Buffer> BufferPool::buffers() const {
  const std::lock_guard lock(mutex_);
  if (current_ == kNone) return {};
  return sets_[static_cast<std::size_t>(current_)].mapped.all();
}

void BufferPool::allocate(std::size_t bytes_each) {
  const std::lock_guard lock(mutex_);
  constexpr std::size_t kUnit = sizeof(std::max_align_t);
  picture_bytes_ = bytes_each;
  pictures_.resize(static_cast<std::size_t>(limit_));
  for (Picture& picture : pictures_)
    picture.memory = std::make_unique<std::max_align_t[]>((bytes_each + kUnit - 1) / kUnit);
}

bool BufferPool::may_lend() const {
  const std::lock_guard lock(mutex_);
  return lent_ < limit_;
}

Frame BufferPool::lend_buffer(int index) {
  const std::lock_guard lock(mutex_);
  Set& set = sets_[static_cast<std::size_t>(current_)];
  set.lent[static_cast<std::size_t>(index)] = true;
  ++set.lent_count;
  ++lent_;
  return {*this, current_ * kMaxBuffers + index};
}

std::size_t BufferPool::take_idle(std::array<int, kMaxBuffers>& out) {
  const std::lock_guard lock(mutex_);
  if (current_ == kNone) return 0;
  const Set& set = sets_[static_cast<std::size_t>(current_)];
  std::size_t count = 0;
  for (std::size_t i = 0; i < set.mapped.all().size(); ++i)
    if (!set.lent[i]) out[count++] = static_cast<int>(i);
  // The returned buffers are among the idle ones.
  returned_count_ = 0;
  return count;
}

std::size_t BufferPool::take_returned(std::array<int, kMaxBuffers>& out) {
  const std::lock_guard lock(mutex_);
  std::copy_n(returned_.begin(), returned_count_, out.begin());
  return std::exchange(returned_count_, 0);
}

int BufferPool::free_picture() const {
  const std::lock_guard lock(mutex_);
  return static_cast<int>(std::ranges::find(pictures_, false, &Picture::lent) - pictures_.begin());
}

std::span<std::byte> BufferPool::picture(int index) const {
  const std::lock_guard lock(mutex_);
  return {reinterpret_cast<std::byte*>(pictures_[static_cast<std::size_t>(index)].memory.get()), picture_bytes_};
}

Frame BufferPool::lend_picture(int index) {
  const std::lock_guard lock(mutex_);
  pictures_[static_cast<std::size_t>(index)].lent = true;
  ++lent_;
  return {*this, kFirstPicture + index};
}

std::optional<BufferPool::Export> BufferPool::dma_buffer(const std::byte* address) const {
  const std::lock_guard lock(mutex_);
  for (const Set& set : sets_)
    for (const MappedBuffers::Buffer& buffer : set.mapped.all()) {
      const std::byte* const begin = buffer.memory.data();
      if (address < begin || address >= begin + buffer.memory.size()) continue;
      if (buffer.dmabuf.get() < 0) return std::nullopt;
      return Export{buffer.dmabuf.get(), static_cast<std::size_t>(address - begin)};
    }
  return std::nullopt;
}

void BufferPool::release(int slot) {
  const std::lock_guard lock(mutex_);
  --lent_;
  if (slot >= kFirstPicture) {
    pictures_[static_cast<std::size_t>(slot - kFirstPicture)].lent = false;
    return;
  }
  const int number = slot / kMaxBuffers, index = slot % kMaxBuffers;
  Set& set = sets_[static_cast<std::size_t>(number)];
  set.lent[static_cast<std::size_t>(index)] = false;
  --set.lent_count;
  if (number == current_) {
    returned_[returned_count_++] = index;
  } else if (set.lent_count == 0) {
    set.mapped.clear();
  }
}

}  // namespace lightwell::v4l2
