#include "camera/backends/v4l2/jpeg_decoder.hpp"

#include <csetjmp>
#include <cstdio>
#include <jerror.h>
#include <jpeglib.h>

#include "camera/backends/v4l2/jpeg_memory.hpp"

namespace lightwell::v4l2 {

struct JpegDecoder::Library {
  /// libjpeg calls back with its own structure, which is therefore the first member.
  struct Errors {
    jpeg_error_mgr manager{};
    std::jmp_buf give_up{};
  };
  JpegMemory memory;
  jpeg_decompress_struct state{};
  Errors errors;

  [[noreturn]] static void fail(j_common_ptr common) {
    std::longjmp(reinterpret_cast<Errors*>(common->err)->give_up, 1);
  }
  /// libjpeg mends what is broken, with grey, and warns: half a picture.
  static void on_message(j_common_ptr common, int level) {
    // Webcams are known for a byte or two of padding before the end marker; more is a scan that came to its end early.
    constexpr int kPadding = 4;
    if (level >= 0) return;
    const jpeg_error_mgr& e = *common->err;
    if (e.msg_code == JWRN_EXTRANEOUS_DATA && e.msg_parm.i[0] <= kPadding) return;
    fail(common);
  }
  static void say_nothing(j_common_ptr) {}
};

JpegDecoder::JpegDecoder(int width, int height)
    : library_(std::make_unique<Library>()), width_(width), height_(height) {
  jpeg_decompress_struct& state = library_->state;
  state.err = jpeg_std_error(&library_->errors.manager);
  state.err->error_exit = &Library::fail;
  state.err->emit_message = &Library::on_message;
  state.err->output_message = &Library::say_nothing;
  // Fails for want of memory alone, and then decode() says so of every picture.
  if (setjmp(library_->errors.give_up) != 0) return;
  jpeg_create_decompress(&state);
  library_->memory.install(state);
}

JpegDecoder::~JpegDecoder() { jpeg_destroy_decompress(&library_->state); }

bool JpegDecoder::decode(std::span<const std::byte> jpeg, std::span<std::byte> rgb) {
  jpeg_decompress_struct& state = library_->state;
  const std::size_t stride = 3 * static_cast<std::size_t>(width_);
  if (state.mem == nullptr || jpeg.empty() || rgb.size() < stride * static_cast<std::size_t>(height_)) return false;
  // Nothing with a destructor lives between here and the calls that may jump back.
  if (setjmp(library_->errors.give_up) != 0) {
    jpeg_abort_decompress(&state);
    return false;
  }
  jpeg_mem_src(&state, reinterpret_cast<const unsigned char*>(jpeg.data()), static_cast<unsigned long>(jpeg.size()));
  if (jpeg_read_header(&state, TRUE) != JPEG_HEADER_OK) {
    jpeg_abort_decompress(&state);
    return false;
  }
  // Several scans (progressive) would take memory for the whole picture's coefficients; no camera sends them.
  const bool ours =
      state.image_width == static_cast<JDIMENSION>(width_) && state.image_height == static_cast<JDIMENSION>(height_) &&
      (state.num_components == 1 || state.num_components == 3) && jpeg_has_multiple_scans(&state) == FALSE;
  if (!ours) {
    jpeg_abort_decompress(&state);
    return false;
  }
  state.out_color_space = JCS_RGB;
  jpeg_start_decompress(&state);
  while (state.output_scanline < state.output_height) {
    JSAMPROW row = reinterpret_cast<JSAMPROW>(rgb.data() + stride * state.output_scanline);
    jpeg_read_scanlines(&state, &row, 1);
  }
  // Reads on to the end marker: its absence is a warning, and a warning is a failure.
  jpeg_finish_decompress(&state);
  return true;
}

}  // namespace lightwell::v4l2
