#include "camera/backends/v4l2/jpeg_memory.hpp"

#include <new>

namespace lightwell::v4l2 {
namespace {

template <class Row>
Row* rows_in(std::byte* memory, std::size_t pointers_bytes, std::size_t row_bytes, JDIMENSION rows) {
  auto* const pointers = reinterpret_cast<Row*>(memory);
  for (JDIMENSION i = 0; i < rows; ++i) pointers[i] = reinterpret_cast<Row>(memory + pointers_bytes + i * row_bytes);
  return pointers;
}

}  // namespace

void JpegMemory::install(jpeg_decompress_struct& state) {
  state.client_data = this;
  libjpegs_ = *state.mem;
  state.mem->alloc_small = &JpegMemory::alloc_small;
  state.mem->alloc_large = &JpegMemory::alloc_large;
  state.mem->alloc_sarray = &JpegMemory::alloc_samples;
  state.mem->alloc_barray = &JpegMemory::alloc_blocks;
  state.mem->free_pool = &JpegMemory::free_pool;
}

std::byte* JpegMemory::take(int pool, std::size_t bytes) {
  if (pool != JPOOL_IMAGE) return nullptr;
  const std::size_t lines = bytes / sizeof(Line) + 1;
  wanted_ += lines;
  if (lines > capacity_ - used_) return nullptr;
  std::byte* const memory = lines_[used_].bytes;
  used_ += lines;
  return memory;
}

void JpegMemory::reset_pool() {
  if (wanted_ > capacity_) {
    lines_.reset(new (std::nothrow) Line[wanted_]);
    capacity_ = lines_ ? wanted_ : 0;
  }
  used_ = wanted_ = 0;
}

void* JpegMemory::alloc_small(j_common_ptr common, int pool, std::size_t bytes) {
  std::byte* const memory = of(common).take(pool, bytes);
  return memory != nullptr ? memory : of(common).libjpegs_.alloc_small(common, pool, bytes);
}

void* JpegMemory::alloc_large(j_common_ptr common, int pool, std::size_t bytes) {
  std::byte* const memory = of(common).take(pool, bytes);
  return memory != nullptr ? memory : of(common).libjpegs_.alloc_large(common, pool, bytes);
}

JSAMPARRAY JpegMemory::alloc_samples(j_common_ptr common, int pool, JDIMENSION samples, JDIMENSION rows) {
  const std::size_t pointers = (rows * sizeof(JSAMPROW) + sizeof(Line) - 1) / sizeof(Line) * sizeof(Line);
  const std::size_t row = (samples * sizeof(JSAMPLE) + sizeof(Line) - 1) / sizeof(Line) * sizeof(Line);
  std::byte* const memory = of(common).take(pool, pointers + row * rows);
  if (memory == nullptr) return of(common).libjpegs_.alloc_sarray(common, pool, samples, rows);
  return rows_in<JSAMPROW>(memory, pointers, row, rows);
}

JBLOCKARRAY JpegMemory::alloc_blocks(j_common_ptr common, int pool, JDIMENSION blocks, JDIMENSION rows) {
  const std::size_t pointers = (rows * sizeof(JBLOCKROW) + sizeof(Line) - 1) / sizeof(Line) * sizeof(Line);
  const std::size_t row = blocks * sizeof(JBLOCK);
  std::byte* const memory = of(common).take(pool, pointers + row * rows);
  if (memory == nullptr) return of(common).libjpegs_.alloc_barray(common, pool, blocks, rows);
  return rows_in<JBLOCKROW>(memory, pointers, row, rows);
}

void JpegMemory::free_pool(j_common_ptr common, int pool) {
  of(common).libjpegs_.free_pool(common, pool);
  if (pool == JPOOL_IMAGE) of(common).reset_pool();
}

}  // namespace lightwell::v4l2
