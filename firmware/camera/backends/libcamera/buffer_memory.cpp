#include "camera/backends/libcamera/buffer_memory.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <string>
#include <unistd.h>

#include <linux/dma-buf.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include "imaging/pixel_layout.hpp"

namespace lightwell::libcam {
namespace {

/// Whether two descriptors, which may be duplicates, refer to the same file.
bool same_file(int a, int b) {
  struct stat sa {
  }, sb{};
  return a == b || (::fstat(a, &sa) == 0 && ::fstat(b, &sb) == 0 && sa.st_dev == sb.st_dev && sa.st_ino == sb.st_ino);
}

void synchronize(int fd, std::uint64_t flags) {
  dma_buf_sync sync{};
  sync.flags = flags;
  // Memory that needs no synchronisation refuses the call, so errors are ignored.
  (void)::ioctl(fd, DMA_BUF_IOCTL_SYNC, &sync);
}

}  // namespace

BufferMemory::~BufferMemory() {
  for (const Buffer& b : buffers_) {
    ::munmap(b.base, b.length);
    ::close(b.fd);
  }
}

Status BufferMemory::add(const ::libcamera::FrameBuffer& buffer, const PictureLayout& layout) {
  const std::vector<BufferPlane> planes = planes_of(buffer);
  const std::size_t rows_end = layout.stride * static_cast<std::size_t>(layout.height);
  const std::size_t bytes = picture_bytes(layout.format, layout.stride, layout.height);
  if (planes.size() != pixel_layout(layout.format).planes)
    return {StatusCode::failed_precondition, "a picture of " + std::string(to_string(layout.format)) + " has " +
                                                 std::to_string(planes.size()) + " planes: ask for another format="};
  if (planes.size() == 2 && (!same_file(planes[0].fd, planes[1].fd) || planes[1].offset != planes[0].offset + rows_end))
    return {StatusCode::failed_precondition,
            "the two planes of " + std::string(to_string(layout.format)) +
                " lie apart in memory, which would need a copy: ask for another format= or size"};
  const std::size_t end = planes.back().offset + planes.back().length;
  if (end < planes[0].offset + bytes)
    return {StatusCode::failed_precondition, "buffers of " + std::to_string(end - planes[0].offset) +
                                                 " bytes are too small for a picture of " + std::to_string(bytes)};
  Buffer b;
  b.length = end;
  b.fd = ::fcntl(planes[0].fd, F_DUPFD_CLOEXEC, 0);
  b.base = b.fd < 0 ? MAP_FAILED : ::mmap(nullptr, b.length, PROT_READ, MAP_SHARED, b.fd, 0);
  if (b.base == MAP_FAILED) {
    const int error = errno;
    if (b.fd >= 0) ::close(b.fd);
    return {StatusCode::resource_exhausted, std::string("a buffer cannot be mapped: ") + std::strerror(error)};
  }
  b.picture = {static_cast<const std::byte*>(b.base) + planes[0].offset, bytes};
  buffers_.push_back(b);
  return {};
}

void BufferMemory::begin_reading(int buffer) const {
  synchronize(buffers_[static_cast<std::size_t>(buffer)].fd, DMA_BUF_SYNC_START | DMA_BUF_SYNC_READ);
}

void BufferMemory::end_reading(int buffer) const {
  synchronize(buffers_[static_cast<std::size_t>(buffer)].fd, DMA_BUF_SYNC_END | DMA_BUF_SYNC_READ);
}

}  // namespace lightwell::libcam
