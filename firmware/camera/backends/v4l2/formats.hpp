// Maps V4L2 pixel formats to PixelFormat, in order of preference, locates a frame's view in a buffer, converts buffers,
// and chooses a device's mode (format, size, rate) for a request.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/pixel.hpp>
#include <lightwell/result.hpp>

#include "imaging/frame.hpp"
#include "imaging/jpeg_decoder.hpp"

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

/// Converts a driver's buffer to a picture in a PixelFormat. Not thread-safe.
class Converter {
 public:
  Converter(const Encoding& encoding, const Layout& layout) : encoding_(encoding), layout_(layout) {}

  /// `picture` has layout.picture_bytes. False if `driver` does not contain a complete picture; `picture` may then be
  /// partly written.
  [[nodiscard]] bool convert(std::span<const std::byte> driver, std::span<std::byte> picture);

 private:
  void convert_row(std::span<const std::byte> in, std::span<std::byte> out) const;

  Encoding encoding_;
  Layout layout_;
  JpegDecoder jpeg_;
};

/// Frame interval in seconds, as a fraction (v4l2_fract).
struct Fraction {
  std::uint32_t numerator = 0, denominator = 1;

  /// Frames per second; 0 if the interval is 0.
  [[nodiscard]] double rate() const {
    return numerator == 0 ? 0 : static_cast<double>(denominator) / static_cast<double>(numerator);
  }
};

/// Values from min to max in steps.
struct StepRange {
  int min = 0, max = 0, step = 1;
};
/// The nearest value in the range; of two, the larger one.
[[nodiscard]] int nearest_in(const StepRange& range, int wanted);

/// One size of one format, with its frame intervals.
struct Mode {
  std::uint32_t fourcc = 0;
  int width = 0, height = 0;
  /// The available intervals; if `any_between`, the longest and the shortest. Empty: not reported.
  std::vector<Fraction> intervals;
  bool any_between = false;
};

struct RequestedFormat {
  int width = 640, height = 480;
  double rate = 30;
  std::string format;  ///< Name of an Encoding; empty: any supported one.
};

struct SelectedMode {
  Mode mode;
  Fraction interval;  ///< {0, 1} if the device does not report intervals.
};

/// Criteria, in this order: the requested size, else the smallest that contains it, else the largest; a rate of at
/// least 95 % of the requested one; the order of encodings(); the nearest rate. invalid_argument, with a list of the
/// offered formats, if none is supported or none is the requested one.
[[nodiscard]] Result<SelectedMode> choose_mode(std::span<const Mode> modes, const RequestedFormat& wanted);

}  // namespace lightwell::v4l2
