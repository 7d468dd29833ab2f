// The memory of a camera's buffers as this process sees it: mapped once, for as long as somebody looks at it.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <lightwell/result.hpp>

#include "camera/backends/libcamera/compatibility.hpp"
#include "camera/backends/libcamera/lens.hpp"

namespace lightwell::libcam {

/// Mappings outlive the buffers, the camera and the manager: a frame that is lent survives that its camera is
/// unplugged.
class BufferMemory final : public PictureMemory {
 public:
  BufferMemory() = default;
  BufferMemory(const BufferMemory&) = delete;
  BufferMemory& operator=(const BufferMemory&) = delete;
  ~BufferMemory() override;

  /// Maps the picture of one more buffer. failed_precondition where its planes do not lie one after the other in one
  /// piece of memory, as a View must; resource_exhausted where it cannot be mapped.
  [[nodiscard]] Status add(const ::libcamera::FrameBuffer& buffer, const PictureLayout& layout);

  [[nodiscard]] std::span<const std::byte> picture(int buffer) const override {
    return buffers_[static_cast<std::size_t>(buffer)].picture;
  }
  /// Around reading, on processors whose caches the camera does not see.
  void begin_reading(int buffer) const;
  void end_reading(int buffer) const override;

 private:
  struct Buffer {
    void* base = nullptr;
    std::size_t length = 0;
    int fd = -1;  ///< Our own copy.
    std::span<const std::byte> picture;
  };
  std::vector<Buffer> buffers_;
};

}  // namespace lightwell::libcam
