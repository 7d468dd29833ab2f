// A memory manager for libjpeg that keeps the working memory between pictures; libjpeg's own allocates it per picture.
#pragma once

#include <cstddef>
#include <cstdio>
#include <jpeglib.h>
#include <memory>

namespace lightwell::v4l2 {

/// Replaces libjpeg's per-picture pool (JPOOL_IMAGE). Its size is the largest need so far; requests beyond it, such as
/// all of the first picture, are passed to libjpeg's own manager.
class JpegMemory {
 public:
  JpegMemory() = default;
  JpegMemory(const JpegMemory&) = delete;
  JpegMemory& operator=(const JpegMemory&) = delete;

  /// Call after jpeg_create_decompress(). Occupies `state.client_data`. Must outlive the state.
  void install(jpeg_decompress_struct& state);

 private:
  static JpegMemory& of(j_common_ptr common) { return *static_cast<JpegMemory*>(common->client_data); }
  static void* alloc_small(j_common_ptr common, int pool, std::size_t bytes);
  static void* alloc_large(j_common_ptr common, int pool, std::size_t bytes);
  static JSAMPARRAY alloc_samples(j_common_ptr common, int pool, JDIMENSION samples, JDIMENSION rows);
  static JBLOCKARRAY alloc_blocks(j_common_ptr common, int pool, JDIMENSION blocks, JDIMENSION rows);
  static void free_pool(j_common_ptr common, int pool);
  /// Null if there is no space.
  [[nodiscard]] std::byte* take(int pool, std::size_t bytes);
  void reset_pool();

  struct alignas(64) Line {  // Alignment of the widest SIMD vectors; rows are padded to it.
    std::byte bytes[64];
  };
  jpeg_memory_mgr libjpegs_{};
  std::unique_ptr<Line[]> lines_;
  std::size_t capacity_ = 0, used_ = 0, wanted_ = 0;  ///< In lines.
};

}  // namespace lightwell::v4l2
