// Decodes JPEG pixels with libjpeg; image_jpeg.cpp first checks what libjpeg tolerates. Camera frames have another
// decoder, which allocates no memory per frame (backends/v4l2/jpeg_decoder.hpp).
#include "imaging/image_readers.hpp"
#include "imaging/jpeg_errors.hpp"

namespace lightwell {
namespace {

class JpegReader {
 public:
  JpegReader() {
    state_.err = errors_.install();
    ready_ = attempt([this] { jpeg_create_decompress(&state_); });
  }
  ~JpegReader() { jpeg_destroy_decompress(&state_); }
  JpegReader(const JpegReader&) = delete;
  JpegReader& operator=(const JpegReader&) = delete;

  bool start(std::span<const std::byte> file) {
    return ready_ && attempt([&] {
             jpeg_mem_src(&state_, reinterpret_cast<const unsigned char*>(file.data()),
                          static_cast<unsigned long>(file.size()));
             jpeg_read_header(&state_, TRUE);
             state_.out_color_space = JCS_RGB;
             jpeg_start_decompress(&state_);
           });
  }
  int width() const { return static_cast<int>(state_.output_width); }
  int height() const { return static_cast<int>(state_.output_height); }

  bool read_rows(std::byte* to, std::size_t stride) {
    return attempt([&] {
      while (state_.output_scanline < state_.output_height) {
        auto row = reinterpret_cast<JSAMPROW>(to + stride * state_.output_scanline);
        jpeg_read_scanlines(&state_, &row, 1);
      }
      jpeg_finish_decompress(&state_);
    });
  }

  const char* message() const { return errors_.message.data(); }

 private:
  template <class Calls>
  bool attempt(const Calls& calls) {
    if (setjmp(errors_.jump) != 0) return false;
    calls();
    return true;
  }

  JpegErrors errors_;
  jpeg_decompress_struct state_{};
  bool ready_ = false;
};

}  // namespace

Result<Image> decode_jpeg(const std::string& name, std::span<const std::byte> file) {
  JpegReader reader;
  if (!reader.start(file)) return image_damaged(name, reader.message());
  Image image{reader.width(), reader.height(), PixelFormat::rgb8, {}};
  image.data.resize(image.stride() * static_cast<std::size_t>(image.height));
  if (!reader.read_rows(image.data.data(), image.stride())) return image_damaged(name, reader.message());
  return image;
}

}  // namespace lightwell
