#include "imaging/jpeg_decoder.hpp"

#include <new>

#include "imaging/jpeg_errors.hpp"

namespace lightwell {
namespace {

/// Keeps the working memory between pictures, which libjpeg's own manager allocates for each (JPOOL_IMAGE). Its size is
/// the largest need so far; requests beyond it, such as all of the first picture, are passed to libjpeg's manager.
class JpegMemory {
 public:
  /// Call after jpeg_create_decompress(). Occupies `state.client_data`. Must outlive the state.
  void install(jpeg_decompress_struct& state) {
    state.client_data = this;
    libjpegs_ = *state.mem;
    state.mem->alloc_small = [](j_common_ptr common, int pool, std::size_t bytes) {
      void* const memory = of(common).take(pool, bytes);
      return memory != nullptr ? memory : of(common).libjpegs_.alloc_small(common, pool, bytes);
    };
    state.mem->alloc_large = [](j_common_ptr common, int pool, std::size_t bytes) {
      void* const memory = of(common).take(pool, bytes);
      return memory != nullptr ? memory : of(common).libjpegs_.alloc_large(common, pool, bytes);
    };
    state.mem->alloc_sarray = [](j_common_ptr common, int pool, JDIMENSION samples, JDIMENSION rows) {
      const JSAMPARRAY array = of(common).take_rows<JSAMPLE>(pool, samples, rows);
      return array != nullptr ? array : of(common).libjpegs_.alloc_sarray(common, pool, samples, rows);
    };
    state.mem->alloc_barray = [](j_common_ptr common, int pool, JDIMENSION blocks, JDIMENSION rows) {
      const JBLOCKARRAY array = of(common).take_rows<JBLOCK>(pool, blocks, rows);
      return array != nullptr ? array : of(common).libjpegs_.alloc_barray(common, pool, blocks, rows);
    };
    state.mem->free_pool = [](j_common_ptr common, int pool) {
      of(common).libjpegs_.free_pool(common, pool);
      if (pool == JPOOL_IMAGE) of(common).reset_pool();
    };
  }

 private:
  struct alignas(64) Line {  // Alignment of the widest SIMD vectors; rows are padded to it.
    std::byte bytes[64];
  };
  static JpegMemory& of(j_common_ptr common) { return *static_cast<JpegMemory*>(common->client_data); }
  static std::size_t lines_of(std::size_t bytes) { return (bytes + sizeof(Line) - 1) / sizeof(Line); }

  /// Null if there is no space.
  Line* take(int pool, std::size_t bytes) {
    if (pool != JPOOL_IMAGE) return nullptr;
    const std::size_t lines = bytes / sizeof(Line) + 1;
    wanted_ += lines;
    if (lines > capacity_ - used_) return nullptr;
    Line* const memory = lines_.get() + used_;
    used_ += lines;
    return memory;
  }

  /// Pointers to rows, and the rows behind them.
  template <class Element>
  Element** take_rows(int pool, JDIMENSION elements, JDIMENSION rows) {
    const std::size_t pointers = lines_of(rows * sizeof(Element*)), row = lines_of(elements * sizeof(Element));
    Line* const memory = take(pool, (pointers + row * rows) * sizeof(Line));
    auto** const array = reinterpret_cast<Element**>(memory);
    for (JDIMENSION i = 0; memory != nullptr && i < rows; ++i)
      array[i] = reinterpret_cast<Element*>(memory + pointers + i * row);
    return array;
  }

  void reset_pool() {
    if (wanted_ > capacity_) {
      lines_.reset(new (std::nothrow) Line[wanted_]);
      capacity_ = lines_ ? wanted_ : 0;
    }
    used_ = wanted_ = 0;
  }

  jpeg_memory_mgr libjpegs_{};
  std::unique_ptr<Line[]> lines_;
  std::size_t capacity_ = 0, used_ = 0, wanted_ = 0;  ///< In lines.
};

}  // namespace

struct JpegDecoder::Library {
  JpegMemory memory;
  JpegErrors errors;
  jpeg_decompress_struct state{};

  /// libjpeg reports errors by longjmp: no object with a destructor may live between a call of libjpeg and this.
  template <class Calls>
  bool attempt(const Calls& calls) {
    if (setjmp(errors.jump) != 0) return false;
    calls();
    return true;
  }
};

JpegDecoder::JpegDecoder() : library_(std::make_unique<Library>()) {
  Library& l = *library_;
  l.state.err = l.errors.install();
  // Fails only if memory is exhausted; then read_header() returns false for every picture.
  if (l.attempt([&l] { jpeg_create_decompress(&l.state); })) l.memory.install(l.state);
}

JpegDecoder::~JpegDecoder() { jpeg_destroy_decompress(&library_->state); }

bool JpegDecoder::read_header(std::span<const std::byte> jpeg, Header& header) {
  jpeg_decompress_struct& state = library_->state;
  return state.mem != nullptr && library_->attempt([&] {
    jpeg_abort_decompress(&state);
    jpeg_mem_src(&state, reinterpret_cast<const unsigned char*>(jpeg.data()), static_cast<unsigned long>(jpeg.size()));
    jpeg_read_header(&state, TRUE);
    header = {static_cast<int>(state.image_width), static_cast<int>(state.image_height), state.num_components,
              state.arith_code != FALSE, jpeg_has_multiple_scans(&state) != FALSE};
  });
}

bool JpegDecoder::decode(std::span<std::byte> rgb) {
  jpeg_decompress_struct& state = library_->state;
  return library_->attempt([&] {
    state.out_color_space = JCS_RGB;
    jpeg_start_decompress(&state);
    while (state.output_scanline < state.output_height) {
      auto row = reinterpret_cast<JSAMPROW>(rgb.data() + std::size_t{3} * state.output_width * state.output_scanline);
      jpeg_read_scanlines(&state, &row, 1);
    }
    // Reads to the end marker.
    jpeg_finish_decompress(&state);
  });
}

bool JpegDecoder::decode_frame(std::span<const std::byte> jpeg, int width, int height, std::span<std::byte> rgb) {
  Header header;
  if (jpeg.empty() || rgb.size() < std::size_t{3} * static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
    return false;
  return read_header(jpeg, header) && header.width == width && header.height == height && !header.multiple_scans &&
         (header.components == 1 || header.components == 3) && decode(rgb);
}

std::span<const std::byte> JpegDecoder::rest() const {
  const jpeg_source_mgr& source = *library_->state.src;
  return std::as_bytes(std::span(source.next_input_byte, source.bytes_in_buffer));
}

JpegDecoder::Fault JpegDecoder::fault() const {
  switch (library_->errors.manager.msg_code) {
    case JWRN_JPEG_EOF:
      return Fault::cut_off;
    case JERR_BAD_PRECISION:
    case JERR_EMPTY_IMAGE:
    case JERR_IMAGE_TOO_BIG:
    case JERR_SOF_UNSUPPORTED:
      return Fault::unsupported;
    default:
      return Fault::damaged;
  }
}

const char* JpegDecoder::message() const { return library_->errors.message.data(); }

}  // namespace lightwell
