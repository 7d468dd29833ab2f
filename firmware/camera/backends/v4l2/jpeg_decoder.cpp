#include "camera/backends/v4l2/jpeg_decoder.hpp"

#include "camera/backends/v4l2/jpeg_memory.hpp"
#include "imaging/jpeg_errors.hpp"

namespace lightwell::v4l2 {

struct JpegDecoder::Library {
  JpegMemory memory;
  jpeg_decompress_struct state{};
  JpegErrors errors;
};

JpegDecoder::JpegDecoder(int width, int height)
    : library_(std::make_unique<Library>()), width_(width), height_(height) {
  jpeg_decompress_struct& state = library_->state;
  state.err = library_->errors.install();
  // Fails only if memory is exhausted; then decode() returns false for every picture.
  if (setjmp(library_->errors.jump) != 0) return;
  jpeg_create_decompress(&state);
  library_->memory.install(state);
}

JpegDecoder::~JpegDecoder() { jpeg_destroy_decompress(&library_->state); }

bool JpegDecoder::decode(std::span<const std::byte> jpeg, std::span<std::byte> rgb) {
  jpeg_decompress_struct& state = library_->state;
  const std::size_t stride = 3 * static_cast<std::size_t>(width_);
  if (state.mem == nullptr || jpeg.empty() || rgb.size() < stride * static_cast<std::size_t>(height_)) return false;
  // No object with a destructor may live between here and the calls that may longjmp back.
  if (setjmp(library_->errors.jump) != 0) {
    jpeg_abort_decompress(&state);
    return false;
  }
  jpeg_mem_src(&state, reinterpret_cast<const unsigned char*>(jpeg.data()), static_cast<unsigned long>(jpeg.size()));
  if (jpeg_read_header(&state, TRUE) != JPEG_HEADER_OK) {
    jpeg_abort_decompress(&state);
    return false;
  }
  // Progressive JPEGs are refused: they need memory for the coefficients of the whole picture, and no camera sends
  // them.
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
  // Reads to the end marker; if that is missing, libjpeg warns, which JpegErrors treats as an error.
  jpeg_finish_decompress(&state);
  return true;
}

}  // namespace lightwell::v4l2
