// JPEG's pixels, through libjpeg; what it lets pass, image_jpeg.cpp looks at first. Frames of
// cameras have a decoder of their own, which asks for no memory (backends/v4l2/jpeg_decoder.hpp).
#include <array>
#include <csetjmp>
#include <cstdio>

#include <jerror.h>
#include <jpeglib.h>

#include "camera/image_readers.hpp"

namespace lightwell {
namespace {

class Reader {
 public:
  Reader() {
    state_.err = jpeg_std_error(&errors_.manager);
    state_.err->error_exit = &Reader::fail;
    state_.err->emit_message = &Reader::on_message;
    state_.err->output_message = [](j_common_ptr) {};
    ready_ = attempt([this] { jpeg_create_decompress(&state_); });
  }
  ~Reader() { jpeg_destroy_decompress(&state_); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

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

  const char* said() const { return errors_.said.data(); }

 private:
  /// libjpeg calls back with its own structure, which is therefore the first member.
  struct Errors {
    jpeg_error_mgr manager{};
    std::jmp_buf give_up{};
    std::array<char, JMSG_LENGTH_MAX> said{};
  };

  [[noreturn]] static void fail(j_common_ptr common) {
    auto& errors = *reinterpret_cast<Errors*>(common->err);
    common->err->format_message(common, errors.said.data());
    std::longjmp(errors.give_up, 1);
  }

  /// What it mends by painting grey, or by guessing, is no picture; the rest is of no consequence
  /// for pixels.
  static void on_message(j_common_ptr common, int level) {
    if (level >= 0) return;
    switch (common->err->msg_code) {
      case JWRN_HIT_MARKER:
      case JWRN_HUFF_BAD_CODE:
      case JWRN_JPEG_EOF:
      case JWRN_MUST_RESYNC:
      case JWRN_NOT_SEQUENTIAL:
        fail(common);
      default:
        return;
    }
  }

  /// libjpeg leaves by longjmp: nothing with a destructor may live between a call of it and here.
  template <class Calls>
  bool attempt(const Calls& calls) {
    if (setjmp(errors_.give_up) != 0) return false;
    calls();
    return true;
  }

  Errors errors_;
  jpeg_decompress_struct state_{};
  bool ready_ = false;
};

}  // namespace

Result<Image> decode_jpeg(const std::string& name, std::span<const std::byte> file) {
  Reader reader;
  if (!reader.start(file)) return image_damaged(name, reader.said());
  Image image{reader.width(), reader.height(), PixelFormat::rgb8, {}};
  image.data.resize(image.stride() * static_cast<std::size_t>(image.height));
  if (!reader.read_rows(image.data.data(), image.stride())) return image_damaged(name, reader.said());
  return image;
}

}  // namespace lightwell
