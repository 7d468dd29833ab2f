// Decodes and encodes PNG pixels with libpng; image_png.cpp first checks what libpng tolerates.
#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstring>
#include <exception>
#include <png.h>

#include "imaging/image_readers.hpp"

namespace lightwell {
namespace {

/// libpng reports errors by longjmp: no object with a destructor may live between a call of libpng and `attempt`.
struct Errors {
  std::jmp_buf jump{};
  std::array<char, 128> message{};

  [[noreturn]] static void fail(png_structp png, png_const_charp why) {
    auto& errors = *static_cast<Errors*>(png_get_error_ptr(png));
    std::strncpy(errors.message.data(), why, errors.message.size() - 1);
    std::longjmp(errors.jump, 1);
  }
  static void discard_message(png_structp, png_const_charp) {}
};

/// Runs `calls`. False if libpng failed; `errors.message` is its message.
template <class Calls>
bool attempt(Errors& errors, const Calls& calls) {
  if (setjmp(errors.jump) != 0) return false;
  calls();
  return true;
}

class PngReader {
 public:
  explicit PngReader(std::span<const std::byte> file)
      : left_(file),
        png_(png_create_read_struct(PNG_LIBPNG_VER_STRING, &errors, &Errors::fail, &Errors::discard_message)),
        info_(png_ != nullptr ? png_create_info_struct(png_) : nullptr) {}
  ~PngReader() { png_destroy_read_struct(&png_, &info_, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  /// No colour management: the values are those of the file; gamma and profile chunks are ignored.
  bool read_header() {
    if (info_ == nullptr) return false;
    return attempt(errors, [this] {
      png_set_read_fn(png_, this, &PngReader::give);
      png_read_info(png_, info_);
      png_set_expand(png_);
      png_set_gray_to_rgb(png_);
      passes_ = png_set_interlace_handling(png_);
      png_read_update_info(png_, info_);
    });
  }
  int width() const { return static_cast<int>(png_get_image_width(png_, info_)); }
  int height() const { return static_cast<int>(png_get_image_height(png_, info_)); }
  std::size_t row_bytes() const { return png_get_rowbytes(png_, info_); }

  bool read_rows(std::byte* to, std::size_t stride) {
    return attempt(errors, [&] {
      for (int pass = 0; pass < passes_; ++pass)
        for (int y = 0; y < height(); ++y)
          png_read_row(png_, reinterpret_cast<png_bytep>(to + stride * static_cast<std::size_t>(y)), nullptr);
      png_read_end(png_, nullptr);
    });
  }

  Errors errors;

 private:
  static void give(png_structp png, png_bytep to, std::size_t bytes) {
    auto& reader = *static_cast<PngReader*>(png_get_io_ptr(png));
    if (bytes > reader.left_.size()) png_error(png, "the file ends too early");
    std::memcpy(to, reader.left_.data(), bytes);
    reader.left_ = reader.left_.subspan(bytes);
  }

  std::span<const std::byte> left_;
  png_structp png_;
  png_infop info_;
  int passes_ = 1;
};

class Writer {
 public:
  Writer()
      : png_(png_create_write_struct(PNG_LIBPNG_VER_STRING, &errors, &Errors::fail, &Errors::discard_message)),
        info_(png_ != nullptr ? png_create_info_struct(png_) : nullptr) {}
  ~Writer() { png_destroy_write_struct(&png_, &info_); }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  bool write(const Image& image) {
    if (info_ == nullptr) return false;
    return attempt(errors, [&] {
      png_set_write_fn(png_, this, &Writer::take, nullptr);
      // Speed matters more than size: thousands of frames are written and each is read once.
      png_set_compression_level(png_, 1);
      png_set_filter(png_, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
      png_set_IHDR(png_, info_, static_cast<png_uint_32>(image.width), static_cast<png_uint_32>(image.height), 8,
                   PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
      png_write_info(png_, info_);
      for (int y = 0; y < image.height; ++y)
        png_write_row(
            png_, reinterpret_cast<png_const_bytep>(image.data.data() + image.stride() * static_cast<std::size_t>(y)));
      png_write_end(png_, info_);
    });
  }

  Errors errors;
  std::vector<std::byte> file;

 private:
  static bool append(std::vector<std::byte>& to, std::span<const std::byte> more) {
    try {
      to.insert(to.end(), more.begin(), more.end());
      return true;
    } catch (const std::exception&) {
      return false;
    }
  }
  static void take(png_structp png, png_bytep from, std::size_t bytes) {
    auto& writer = *static_cast<Writer*>(png_get_io_ptr(png));
    if (!append(writer.file, std::as_bytes(std::span(from, bytes)))) png_error(png, "no memory");
  }

  png_structp png_;
  png_infop info_;
};

}  // namespace

Result<Image> decode_png(const std::string& name, std::span<const std::byte> file) {
  PngReader reader(file);
  if (!reader.read_header()) return image_damaged(name, reader.errors.message.data());
  Image image{reader.width(), reader.height(), PixelFormat::rgb8, {}};
  if (reader.row_bytes() != image.stride()) return image_damaged(name, "it does not decode to 8-bit colours");
  image.data.resize(image.stride() * static_cast<std::size_t>(image.height));
  if (!reader.read_rows(image.data.data(), image.stride())) return image_damaged(name, reader.errors.message.data());
  return image;
}

Result<std::vector<std::byte>> encode_png(const Image& image) {
  if (image.format != PixelFormat::rgb8)
    return Status(StatusCode::invalid_argument, "only rgb8 pictures are written as PNG");
  if (image.width < 1 || image.height < 1 ||
      image.data.size() < picture_bytes(image.format, image.stride(), image.height))
    return Status(StatusCode::invalid_argument, "the picture's data do not fill its size");
  Writer writer;
  if (!writer.write(image))
    return Status(StatusCode::internal,
                  std::string("libpng could not encode the picture: ") + writer.errors.message.data());
  return std::move(writer.file);
}

}  // namespace lightwell
