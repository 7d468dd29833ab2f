// libjpeg takes working memory for each picture and gives it back; here it is kept from picture to picture.
#pragma once

#include <cstddef>
#include <cstdio>
#include <jpeglib.h>
#include <memory>

namespace lightwell::v4l2 {

/// Stands in for libjpeg's pool of one picture (JPOOL_IMAGE). As large as the largest picture so far needed: the first
/// one's comes from libjpeg itself.
class JpegMemory {
 public:
  JpegMemory() = default;
  JpegMemory(const JpegMemory&) = delete;
  JpegMemory& operator=(const JpegMemory&) = delete;

  /// After jpeg_create_decompress(); takes `state.client_data`. Outlives the state.
  void install(jpeg_decompress_struct& state);

 private:
  static JpegMemory& of(j_common_ptr common) { return *static_cast<JpegMemory*>(common->client_data); }
  static void* alloc_small(j_common_ptr common, int pool, std::size_t bytes);
  static void* alloc_large(j_common_ptr common, int pool, std::size_t bytes);
  static JSAMPARRAY alloc_samples(j_common_ptr common, int pool, JDIMENSION samples, JDIMENSION rows);
  static JBLOCKARRAY alloc_blocks(j_common_ptr common, int pool, JDIMENSION blocks, JDIMENSION rows);
  static void free_pool(j_common_ptr common, int pool);
  /// Null where there is no room.
  [[nodiscard]] std::byte* take(int pool, std::size_t bytes);
  void reset_pool();

  struct alignas(64) Line {  // What the widest vectors want, and what rows are padded to.
    std::byte bytes[64];
  };
  jpeg_memory_mgr libjpegs_{};
  std::unique_ptr<Line[]> lines_;
  std::size_t capacity_ = 0, used_ = 0, wanted_ = 0;  ///< In lines.
};

}  // namespace lightwell::v4l2
