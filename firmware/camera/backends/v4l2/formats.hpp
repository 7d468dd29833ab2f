// Maps V4L2 pixel formats to PixelFormat, in order of preference, and locates a frame's view in a buffer.
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

#include "imaging/frame.hpp"

namespace lightwell::v4l2 {

/// Conversion from a buffer's bytes to a PixelFormat.
enum class Packing : std::uint8_t {
  none,      ///< No conversion: the driver's memory is lent.
  packed10,  ///< MIPI: four pixels in five bytes.
  packed12,  ///< MIPI: two pixels in three bytes.
  grey,      ///< Luma only, expanded to three equal channels.
  jpeg,      ///< Motion JPEG.
};

struct Encoding {
  std::uint32_t fourcc = 0;
  PixelFormat format = PixelFormat::rgb8;  ///< Of frames.
  Packing packing = Packing::none;
  int skip_columns = 0, skip_rows = 0;  ///< To the first red pixel, for Bayer orders other than RGGB.
  std::string_view name;                ///< Value of the parameter `format`.
};

/// All supported encodings in order of preference: raw before processed, more bits before fewer, without conversion
/// before with, colour before grey.
[[nodiscard]] std::span<const Encoding> encodings();
/// Null if it is not supported.
[[nodiscard]] const Encoding* encoding_of(std::uint32_t fourcc);
/// Accepted values of the parameter `format`, in order of preference.
[[nodiscard]] std::string format_names();
/// "YUYV"; bytes that are not printable become dots.
[[nodiscard]] std::string fourcc_text(std::uint32_t fourcc);

/// Sizes in pixels, the rest in bytes.
struct Layout {
  int width = 0, height = 0;            ///< Of the driver's picture.
  std::size_t stride = 0;               ///< Of the driver's picture; 0 for JPEG.
  std::size_t bytes = 0;                ///< Smallest size of a buffer with a complete picture; 0 for JPEG.
  int view_width = 0, view_height = 0;  ///< Of the frame's view.
  std::size_t view_stride = 0, view_offset = 0;
  std::size_t picture_bytes = 0;  ///< Of the memory that contains the view, at view_offset.

  friend bool operator==(const Layout&, const Layout&) = default;
};

/// Layout of the driver's memory, or, if the encoding needs a conversion or the picture is `copied`, of rows without
/// padding. invalid_argument for a picture that a frame cannot represent: an odd size, rows that overlap, more bytes
/// than the driver's image has.
[[nodiscard]] Result<Layout> layout_of(const Encoding& encoding, int width, int height, std::size_t bytes_per_line,
                                       std::size_t size_image, bool copied);

/// View of a picture in memory of at least layout.picture_bytes.
[[nodiscard]] View view_of(const Encoding& encoding, const Layout& layout, std::span<const std::byte> picture);

}  // namespace lightwell::v4l2
