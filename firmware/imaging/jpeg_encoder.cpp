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
  bool encode(const Image& image, int quality) {
    if (setjmp(errors.jump) != 0) return false;
    jpeg_create_compress(&state);
    jpeg_mem_dest(&state, &bytes, &size);
    state.image_width = static_cast<JDIMENSION>(image.width);
    state.image_height = static_cast<JDIMENSION>(image.height);
    state.input_components = 3;
    state.in_color_space = JCS_RGB;
    jpeg_set_defaults(&state);
    jpeg_set_quality(&state, quality, TRUE);
    jpeg_start_compress(&state, TRUE);
    while (state.next_scanline < state.image_height) {
      auto* row = const_cast<JSAMPLE*>(reinterpret_cast<const JSAMPLE*>(image.data.data())) +
                  image.stride() * state.next_scanline;
      jpeg_write_scanlines(&state, &row, 1);
    }
    jpeg_finish_compress(&state);
    return true;
  }
};

}  // namespace

Result<std::vector<std::byte>> encode_jpeg(const Image& image, int quality) {
  if (image.format != PixelFormat::rgb8 || image.width < 1 || image.height < 1 || image.width > JPEG_MAX_DIMENSION ||
      image.height > JPEG_MAX_DIMENSION || image.data.size() < image.stride() * static_cast<std::size_t>(image.height))
    return invalid_argument("a JPEG needs an rgb8 picture with sides of 1 to 65500 pixels");
  // A larger buffer than any JPEG of this size needs, also of noise at quality 100: libjpeg then allocates none.
  std::vector<std::byte> out(8192 + 8 * static_cast<std::size_t>(image.width + 16) *
                                        static_cast<std::size_t>(image.height + 16));
  Encoder encoder(out);
  if (!encoder.encode(image, quality)) return Status(StatusCode::internal, encoder.errors.message.data());
  out.resize(encoder.size);
  out.shrink_to_fit();
  return out;
}

}  // namespace lightwell
