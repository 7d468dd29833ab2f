// Which memory is out: the driver's buffers, or pictures of our own that were converted.
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
#include "camera/frame.hpp"

namespace lightwell::v4l2 {

/// Any method from any thread, but for what belongs to one set of buffers: adopt(), retire(), lend_buffer(),
/// take_idle() and take_returned() are of the thread that streams.
class BufferPool final : public FrameOwner {
 public:
  /// What V4L2 allows one queue.
  static constexpr int kMaxBuffers = 32;

  /// At most `limit` frames are lent at once, whatever became of the devices that they are from.
  explicit BufferPool(int limit);

  /// The buffers of a device that was opened. The ones before were retired.
  void adopt(MappedBuffers buffers);
  /// Their device is gone; they are unmapped when the last frame comes back.
  void retire();
  [[nodiscard]] std::span<const MappedBuffers::Buffer> buffers() const;

  /// Memory for `limit` pictures of our own, aligned for any format.
  void allocate(std::size_t bytes_each);

  [[nodiscard]] bool may_lend() const;
  /// Only where may_lend(), and the buffer is not lent.
  [[nodiscard]] Frame lend_buffer(int index);
  /// Before streaming: all buffers of the present device that are not lent. Returns how many stand in `out`.
  [[nodiscard]] std::size_t take_idle(std::array<int, kMaxBuffers>& out);
  /// While streaming: those that came back since the last call.
  [[nodiscard]] std::size_t take_returned(std::array<int, kMaxBuffers>& out);

  /// Only where may_lend().
  [[nodiscard]] int free_picture() const;
  [[nodiscard]] std::span<std::byte> picture(int index) const;
  [[nodiscard]] Frame lend_picture(int index);

  struct Export {
    int fd = -1;
    std::size_t offset = 0;
  };
  /// The DMABUF that a lent address lies in; nothing where it lies in none.
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
  static constexpr int kNoSet = -1;
  static constexpr int kFirstPicture = 1 << 20;

  const int limit_;
  mutable std::mutex mutex_;
  /// One more than there can be loans: each retired set has a frame out, and the present one has a place.
  std::vector<Set> sets_;
  int current_ = kNoSet;
  std::array<int, kMaxBuffers> returned_{};
  std::size_t returned_count_ = 0;
  std::vector<Picture> pictures_;
  std::size_t picture_bytes_ = 0;
  int lent_ = 0;
};

}  // namespace lightwell::v4l2
