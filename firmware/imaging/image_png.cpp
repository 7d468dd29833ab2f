// Reads and writes PNG with libpng, which here treats a wrong CRC of any chunk as an error (W3C PNG, third edition).
#include <array>
#include <csetjmp>
#include <cstring>
#include <exception>
#include <png.h>
#include <string_view>

#include <lightwell/files.hpp>

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
        png_(png_create_read_struct(PNG_LIBPNG_VER_STRING, &errors_, &Errors::fail, &Errors::discard_message)),
        info_(png_ != nullptr ? png_create_info_struct(png_) : nullptr) {}
  ~PngReader() { png_destroy_read_struct(&png_, &info_, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  bool read_header() {
    return info_ != nullptr && attempt(errors_, [this] {
             png_set_crc_action(png_, PNG_CRC_ERROR_QUIT, PNG_CRC_ERROR_QUIT);
             // check_image_size() limits the size.
             png_set_user_limits(png_, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
             png_set_read_fn(png_, this, &PngReader::give);
             png_read_info(png_, info_);
           });
  }
  std::uint32_t width() const { return png_get_image_width(png_, info_); }
  std::uint32_t height() const { return png_get_image_height(png_, info_); }
  bool is_deep() const { return png_get_bit_depth(png_, info_) == 16; }
  bool has_alpha() const {
    return (png_get_color_type(png_, info_) & PNG_COLOR_MASK_ALPHA) != 0 ||
           png_get_valid(png_, info_, PNG_INFO_tRNS) != 0;
  }

  /// No colour management: the values are those of the file; gamma and profile chunks are ignored.
  bool read_rows(Image& image) {
    return attempt(errors_, [&] {
      png_set_expand(png_);
      png_set_gray_to_rgb(png_);
      const int passes = png_set_interlace_handling(png_);
      png_read_update_info(png_, info_);
      if (png_get_rowbytes(png_, info_) != image.stride()) png_error(png_, "it does not decode to 8-bit colours");
      for (int pass = 0; pass < passes; ++pass)
        for (std::size_t y = 0; y < height(); ++y)
          png_read_row(png_, reinterpret_cast<png_bytep>(image.data.data() + image.stride() * y), nullptr);
      png_read_end(png_, nullptr);
    });
  }

  /// The failure of the last call.
  Status error(const std::string& name) const {
    const std::string where = std::string("libpng says: ") + errors_.message.data();
    return cut_off_ ? image_truncated(name, where) : image_damaged(name, where);
  }

 private:
  static void give(png_structp png, png_bytep to, std::size_t bytes) {
    auto& reader = *static_cast<PngReader*>(png_get_io_ptr(png));
    reader.cut_off_ = bytes > reader.left_.size();
    if (reader.cut_off_) png_error(png, "the file ends too early");
    std::memcpy(to, reader.left_.data(), bytes);
    reader.left_ = reader.left_.subspan(bytes);
  }

  std::span<const std::byte> left_;
  Errors errors_;
  bool cut_off_ = false;
  png_structp png_;
  png_infop info_;
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
  std::string file;

 private:
  static bool append(std::string& to, std::string_view more) {
    try {
      to.append(more);
      return true;
    } catch (const std::exception&) {
      return false;
    }
  }
  static void take(png_structp png, png_bytep from, std::size_t bytes) {
    auto& writer = *static_cast<Writer*>(png_get_io_ptr(png));
    if (!append(writer.file, {reinterpret_cast<const char*>(from), bytes})) png_error(png, "no memory");
  }

  png_structp png_;
  png_infop info_;
};

}  // namespace

Result<Image> read_png(const std::string& name, std::span<const std::byte> file) {
  PngReader reader(file);
  if (!reader.read_header()) return reader.error(name);
  if (Status s = check_image_size(name, reader.width(), reader.height()); !s.ok()) return s;
  if (reader.is_deep())
    return image_refused(name, "16 bits a channel; convert it to 8, or to OpenEXR where the values matter");
  if (reader.has_alpha())
    return image_refused(name, "an alpha channel: no camera sees a pixel in part; export it without alpha");
  Image image{static_cast<int>(reader.width()), static_cast<int>(reader.height()), PixelFormat::rgb8, {}};
  image.data.resize(image.stride() * static_cast<std::size_t>(image.height));
  if (!reader.read_rows(image)) return reader.error(name);
  return image;
}

Status write_png(const std::string& path, const Image& image) {
  if (image.format != PixelFormat::rgb8) return invalid_argument(path + ": only rgb8 pictures are written as PNG");
  if (image.width < 1 || image.height < 1 ||
      image.data.size() < picture_bytes(image.format, image.stride(), image.height))
    return invalid_argument(path + ": the picture's data do not fill its size");
  Writer writer;
  if (!writer.write(image))
    return {StatusCode::internal, path + ": libpng could not encode the picture: " + writer.errors.message.data()};
  return write_atomically(path, writer.file, FileMode::umask);
}

}  // namespace lightwell
