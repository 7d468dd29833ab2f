// The memory of a camera's buffers, mapped into this process once and for as long as it is in use.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <lightwell/result.hpp>

#include "camera/backends/libcamera/compatibility.hpp"
#include "camera/backends/libcamera/lens.hpp"

namespace lightwell::libcam {

/// Mappings outlive the buffers, the camera and the manager: a lent frame stays valid when its camera is unplugged.
class BufferMemory final : public PictureMemory {
 public:
  BufferMemory() = default;
  BufferMemory(const BufferMemory&) = delete;
  BufferMemory& operator=(const BufferMemory&) = delete;
  ~BufferMemory() override;

  /// Maps the picture of one more buffer. failed_precondition if its planes are not contiguous in memory, as a View
  /// requires; resource_exhausted if it cannot be mapped.
  [[nodiscard]] Status add(const ::libcamera::FrameBuffer& buffer, const PictureLayout& layout);

  [[nodiscard]] std::span<const std::byte> picture(int buffer) const override {
    return buffers_[static_cast<std::size_t>(buffer)].picture;
  }
  /// Bracket each reading: synchronise caches on processors that are not coherent with the camera.
  void begin_reading(int buffer) const;
  void end_reading(int buffer) const override;

 private:
  struct Buffer {
    void* base = nullptr;
    std::size_t length = 0;
    int fd = -1;  ///< Duplicate, owned here.
    std::span<const std::byte> picture;
  };
  std::vector<Buffer> buffers_;
};

}  // namespace lightwell::libcam
