#include "imaging/jpeg_encoder.hpp"

#include "imaging/jpeg_errors.hpp"

namespace lightwell {
namespace {

/// Members that a longjmp out of libjpeg leaves defined.
struct Encoder {
  JpegErrors errors;
  jpeg_compress_struct state{};
  unsigned char* bytes;
  unsigned long size;

  explicit Encoder(std::vector<std::byte>& out)
      : bytes(reinterpret_cast<unsigned char*>(out.data())), size(static_cast<unsigned long>(out.size())) {
    state.err = errors.install();
  }
  Encoder(const Encoder&) = delete;
  Encoder& operator=(const Encoder&) = delete;
  ~Encoder() { jpeg_destroy_compress(&state); }

  /// No object with a destructor lives between setjmp() and the calls.
  bool encode(std::span<const std::byte> rgb, int width, int height, const JpegOptions& options) {
    if (setjmp(errors.jump) != 0) return false;
    jpeg_create_compress(&state);
    jpeg_mem_dest(&state, &bytes, &size);
    state.image_width = static_cast<JDIMENSION>(width);
    state.image_height = static_cast<JDIMENSION>(height);
    state.input_components = 3;
    state.in_color_space = JCS_RGB;
    jpeg_set_defaults(&state);
    jpeg_set_quality(&state, options.quality, TRUE);
    state.comp_info[0].h_samp_factor = 2;
    state.comp_info[0].v_samp_factor = options.chroma == ChromaSampling::yuv420 ? 2 : 1;
    // The integer DCT gives identical bits on all machines.
    state.dct_method = JDCT_ISLOW;
    jpeg_start_compress(&state, TRUE);
    while (state.next_scanline < state.image_height) {
      // libjpeg does not write to its input, although the parameter is not const.
      auto* row = reinterpret_cast<JSAMPROW>(const_cast<std::byte*>(rgb.data())) +
                  3 * static_cast<std::size_t>(width) * state.next_scanline;
      jpeg_write_scanlines(&state, &row, 1);
    }
    jpeg_finish_compress(&state);
    return true;
  }
};

}  // namespace

Result<std::vector<std::byte>> encode_jpeg(std::span<const std::byte> rgb, int width, int height,
                                           const JpegOptions& options) {
  if (width < 1 || height < 1 || width > JPEG_MAX_DIMENSION || height > JPEG_MAX_DIMENSION ||
      rgb.size() != 3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
    return invalid_argument("a JPEG needs a picture of three bytes a pixel with sides of 1 to 65500 pixels");
  // A larger buffer than any JPEG of this size needs, also of noise at quality 100: libjpeg then allocates none.
  std::vector<std::byte> out(8192 + 8 * static_cast<std::size_t>(width + 16) * static_cast<std::size_t>(height + 16));
  Encoder encoder(out);
  if (!encoder.encode(rgb, width, height, options)) return Status(StatusCode::internal, encoder.errors.message.data());
  out.resize(encoder.size);
  out.shrink_to_fit();
  return out;
}

}  // namespace lightwell
