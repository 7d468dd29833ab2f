// Tracks which memory is lent: the driver's buffers, or own buffers with converted pictures.
//   free -> (lent as a frame) -> returned -> free
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "camera/backends/v4l2/device.hpp"
#include "imaging/frame.hpp"

namespace lightwell::v4l2 {

/// Thread-safe, except adopt(), retire(), lend_buffer(), take_idle() and take_returned(), which concern the current set
/// of buffers and are called by the streaming thread.
class BufferPool final : public FrameOwner {
 public:
  /// V4L2's limit per queue.
  static constexpr int kMaxBuffers = 32;

  /// At most `limit` frames are lent at the same time, including those of devices that are gone.
  explicit BufferPool(int limit);

  /// Takes over the buffers of a newly opened device. The previous set must have been retired.
  void adopt(MappedBuffers buffers);
  /// The device is gone; its buffers are unmapped when their last frame is released.
  void retire();
  [[nodiscard]] std::span<const MappedBuffers::Buffer> buffers() const;

  /// Allocates memory for `limit` converted pictures, aligned for any format.
  void allocate(std::size_t bytes_each);

  [[nodiscard]] bool may_lend() const;
  /// Requires may_lend(), and that the buffer is not lent.
  [[nodiscard]] Frame lend_buffer(int index);
  /// Before streaming: all buffers of the current device that are not lent. Returns their number.
  [[nodiscard]] std::size_t take_idle(std::array<int, kMaxBuffers>& out);
  /// While streaming: the buffers released since the last call. Returns their number.
  [[nodiscard]] std::size_t take_returned(std::array<int, kMaxBuffers>& out);

  /// Requires may_lend().
  [[nodiscard]] int free_picture() const;
  [[nodiscard]] std::span<std::byte> picture(int index) const;
  [[nodiscard]] Frame lend_picture(int index);

  struct Export {
    int fd = -1;
    std::size_t offset = 0;
  };
  /// The DMABUF that contains a lent address; empty if none does.
  [[nodiscard]] std::optional<Export> dma_buffer(const std::byte* address) const;

  void release(int slot) override;

 private:
  struct Set {
    MappedBuffers mapped;
    std::array<bool, kMaxBuffers> lent{};
    int lent_count = 0;
  };
  struct Picture {
    std::unique_ptr<std::max_align_t[]> memory;
    bool lent = false;
  };
  static constexpr int kNone = -1;
  static constexpr int kFirstPicture = 1 << 20;

  const int limit_;
  mutable std::mutex mutex_;
  /// Size: limit + 1, because each retired set has at least one lent frame, and the current set needs an entry.
  std::vector<Set> sets_;
  int current_ = kNone;
  std::array<int, kMaxBuffers> returned_{};
  std::size_t returned_count_ = 0;
  std::vector<Picture> pictures_;
  std::size_t picture_bytes_ = 0;
  int lent_ = 0;
};

}  // namespace lightwell::v4l2
