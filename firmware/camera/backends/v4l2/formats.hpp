// What V4L2 calls pictures and what they are here: encodings in order of preference, and where in a buffer a frame's
// view lies.
//   Encoding, encodings(), encoding_of(), format_names()
//   Layout, layout_of(), view_of()
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include <lightwell/pixel.hpp>
#include <lightwell/result.hpp>

#include "camera/frame.hpp"

namespace lightwell::v4l2 {

/// What must be done to a buffer's bytes before they are one of our formats.
enum class Packing : std::uint8_t {
  none,      ///< Nothing: the driver's memory is lent.
  packed10,  ///< MIPI: four pixels in five bytes.
  packed12,  ///< MIPI: two pixels in three bytes.
  grey,      ///< Luma alone, expanded to three equal channels.
  jpeg,      ///< Motion JPEG.
};

struct Encoding {
  std::uint32_t fourcc = 0;
  PixelFormat format = PixelFormat::rgb8;  ///< Of frames.
  Packing packing = Packing::none;
  int skip_columns = 0, skip_rows = 0;  ///< To the first red pixel of another Bayer order.
  std::string_view name;                ///< As `format=` says it.
};

/// All that can be read, the preferred first: raw before developed, more bits before fewer, no work before work,
/// colour before grey.
[[nodiscard]] std::span<const Encoding> encodings();
/// Null where it cannot be read.
[[nodiscard]] const Encoding* encoding_of(std::uint32_t fourcc);
/// What `format=` may say, in order of preference.
[[nodiscard]] std::string format_names();
/// "YUYV"; bytes that do not print are shown as dots.
[[nodiscard]] std::string fourcc_text(std::uint32_t fourcc);

/// Sizes in pixels, the rest in bytes.
struct Layout {
  int width = 0, height = 0;            ///< Of the driver's picture.
  std::size_t stride = 0;               ///< Of the driver's picture; 0 for JPEG.
  std::size_t bytes = 0;                ///< Below this a buffer holds no whole picture; 0 for JPEG.
  int view_width = 0, view_height = 0;  ///< Of what frames show.
  std::size_t view_stride = 0, view_offset = 0;
  std::size_t picture_bytes = 0;  ///< Of the memory that view_offset counts in.

  friend bool operator==(const Layout&, const Layout&) = default;
};

/// Where the driver's own memory is to be lent, and where it is converted or `copied` into rows without padding.
/// invalid_argument for a picture that no frame can show: an odd size, rows that overlap, more bytes than the driver's
/// image has.
[[nodiscard]] Result<Layout> layout_of(const Encoding& encoding, int width, int height, std::size_t bytes_per_line,
                                       std::size_t size_image, bool copied);

/// Of a picture in memory of at least layout.picture_bytes.
[[nodiscard]] View view_of(const Encoding& encoding, const Layout& layout, std::span<const std::byte> picture);

}  // namespace lightwell::v4l2
