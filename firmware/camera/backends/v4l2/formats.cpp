#include "camera/backends/v4l2/formats.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <set>
#include <tuple>

#include <linux/videodev2.h>

#include <lightwell/text.hpp>

#include "imaging/pixel_layout.hpp"

namespace lightwell::v4l2 {
namespace {

using enum PixelFormat;
using enum Packing;

constexpr std::array kEncodings = {
    Encoding{V4L2_PIX_FMT_SRGGB12, bayer_rggb12, none, 0, 0, "bayer12"},
    Encoding{V4L2_PIX_FMT_SGRBG12, bayer_rggb12, none, 1, 0, "bayer12"},
    Encoding{V4L2_PIX_FMT_SGBRG12, bayer_rggb12, none, 0, 1, "bayer12"},
    Encoding{V4L2_PIX_FMT_SBGGR12, bayer_rggb12, none, 1, 1, "bayer12"},
    Encoding{V4L2_PIX_FMT_SRGGB12P, bayer_rggb12, packed12, 0, 0, "bayer12"},
    Encoding{V4L2_PIX_FMT_SGRBG12P, bayer_rggb12, packed12, 1, 0, "bayer12"},
    Encoding{V4L2_PIX_FMT_SGBRG12P, bayer_rggb12, packed12, 0, 1, "bayer12"},
    Encoding{V4L2_PIX_FMT_SBGGR12P, bayer_rggb12, packed12, 1, 1, "bayer12"},
    Encoding{V4L2_PIX_FMT_SRGGB10, bayer_rggb10, none, 0, 0, "bayer10"},
    Encoding{V4L2_PIX_FMT_SGRBG10, bayer_rggb10, none, 1, 0, "bayer10"},
    Encoding{V4L2_PIX_FMT_SGBRG10, bayer_rggb10, none, 0, 1, "bayer10"},
    Encoding{V4L2_PIX_FMT_SBGGR10, bayer_rggb10, none, 1, 1, "bayer10"},
    Encoding{V4L2_PIX_FMT_SRGGB10P, bayer_rggb10, packed10, 0, 0, "bayer10"},
    Encoding{V4L2_PIX_FMT_SGRBG10P, bayer_rggb10, packed10, 1, 0, "bayer10"},
    Encoding{V4L2_PIX_FMT_SGBRG10P, bayer_rggb10, packed10, 0, 1, "bayer10"},
    Encoding{V4L2_PIX_FMT_SBGGR10P, bayer_rggb10, packed10, 1, 1, "bayer10"},
    Encoding{V4L2_PIX_FMT_SRGGB8, bayer_rggb8, none, 0, 0, "bayer8"},
    Encoding{V4L2_PIX_FMT_SGRBG8, bayer_rggb8, none, 1, 0, "bayer8"},
    Encoding{V4L2_PIX_FMT_SGBRG8, bayer_rggb8, none, 0, 1, "bayer8"},
    Encoding{V4L2_PIX_FMT_SBGGR8, bayer_rggb8, none, 1, 1, "bayer8"},
    Encoding{V4L2_PIX_FMT_RGB24, rgb8, none, 0, 0, "rgb8"},
    Encoding{V4L2_PIX_FMT_YUYV, yuyv, none, 0, 0, "yuyv"},
    Encoding{V4L2_PIX_FMT_NV12, nv12, none, 0, 0, "nv12"},
    Encoding{V4L2_PIX_FMT_MJPEG, rgb8, jpeg, 0, 0, "mjpeg"},
    Encoding{V4L2_PIX_FMT_JPEG, rgb8, jpeg, 0, 0, "mjpeg"},
    Encoding{V4L2_PIX_FMT_GREY, rgb8, grey, 0, 0, "grey"},
};

/// Bytes per row of the driver's picture without padding; 0 if rows have no fixed size or do not fill whole bytes.
std::size_t packed_driver_stride(const Encoding& encoding, int width) {
  const auto w = static_cast<std::size_t>(width);
  switch (encoding.packing) {
    case none:
      return packed_stride(encoding.format, width);
    case packed10:
      return w % 4 == 0 ? w / 4 * 5 : 0;
    case packed12:
      return w % 2 == 0 ? w / 2 * 3 : 0;
    case grey:
      return w;
    case jpeg:
      return 0;
  }
  return 0;
}

Status refused(const Encoding& encoding, int width, int height, const std::string& why) {
  return invalid_argument(formatted("v4l2: the driver gives %dx%d ", width, height) + fourcc_text(encoding.fourcc) +
                          " " + why + ": ask for another size or format");
}

constexpr double kMinRateFraction = 0.95;

/// Rank of a size: 0 for the wanted one, then larger ones by their excess, then the others by their deficit.
std::tuple<int, long> size_rank(const Mode& mode, const RequestedFormat& wanted) {
  if (mode.width == wanted.width && mode.height == wanted.height) return {0, 0};
  const long area = static_cast<long>(mode.width) * mode.height;
  if (mode.width >= wanted.width && mode.height >= wanted.height) return {1, area};
  return {2, -area};
}

Fraction interval_of(double rate) {
  constexpr double kFine = 1000;
  const auto denominator = static_cast<std::uint32_t>(std::lround(std::clamp(rate, 0.001, 100000.0) * kFine));
  return {static_cast<std::uint32_t>(kFine), std::max<std::uint32_t>(denominator, 1)};
}

Fraction nearest_interval(const Mode& mode, double rate) {
  if (mode.intervals.empty()) return {};
  const auto by_rate = [](const Fraction& a, const Fraction& b) { return a.rate() < b.rate(); };
  if (mode.any_between) {
    const auto [slowest, fastest] = std::ranges::minmax(mode.intervals, by_rate);
    if (rate <= slowest.rate()) return slowest;
    return rate >= fastest.rate() ? fastest : interval_of(rate);
  }
  // Ties: prefer the higher rate.
  return *std::ranges::min_element(mode.intervals, [rate](const Fraction& a, const Fraction& b) {
    const double off_a = std::abs(a.rate() - rate), off_b = std::abs(b.rate() - rate);
    return off_a != off_b ? off_a < off_b : a.rate() > b.rate();
  });
}

struct Rank {
  std::tuple<int, long> size;
  int too_slow = 0;
  std::ptrdiff_t preference = 0;
  double rate_off = 0;

  friend auto operator<=>(const Rank&, const Rank&) = default;
};

Status nothing_fits(std::span<const Mode> modes, const RequestedFormat& wanted) {
  std::set<std::string> offered;
  for (const Mode& mode : modes) offered.insert(fourcc_text(mode.fourcc));
  const std::string list = offered.empty() ? "nothing" : joined(offered);
  if (!wanted.format.empty())
    return {StatusCode::invalid_argument,
            "v4l2: format=" + wanted.format + " is not among what the camera offers: " + list};
  return {StatusCode::invalid_argument,
          "v4l2: the camera offers " + list + ", of which nothing can be read here (" + format_names() + " can)"};
}

}  // namespace

std::span<const Encoding> encodings() { return kEncodings; }

const Encoding* encoding_of(std::uint32_t fourcc) {
  const auto found = std::ranges::find(kEncodings, fourcc, &Encoding::fourcc);
  return found == kEncodings.end() ? nullptr : &*found;
}

std::string format_names() {
  std::string all;
  std::string_view last;
  // Encodings of the same name are adjacent.
  for (const Encoding& encoding : kEncodings) {
    if (encoding.name == last) continue;
    last = encoding.name;
    all += (all.empty() ? "" : ", ") + std::string(last);
  }
  return all;
}

std::string fourcc_text(std::uint32_t fourcc) {
  std::string text;
  for (int i = 0; i < 4; ++i) {
    const auto c = static_cast<unsigned char>(fourcc >> (8 * i));
    text += c > 0x20 && c < 0x7F ? static_cast<char>(c) : '.';
  }
  return text;
}

Result<Layout> layout_of(const Encoding& encoding, int width, int height, std::size_t bytes_per_line,
                         std::size_t size_image, bool copied) {
  const PixelFormat format = encoding.format;
  // Columns and rows are skipped for other Bayer orders; a picture must remain.
  const int least = is_bayer(format) ? 4 : 2;
  if (width < least || height < least || width > 16384 || height > 16384)
    return refused(encoding, width, height, "pictures, which is no size");
  if (!size_fits(format, width, height))
    return refused(encoding, width, height, "pictures, and this format needs even sizes");

  Layout layout;
  layout.width = layout.view_width = width;
  layout.height = layout.view_height = height;
  if (encoding.packing != jpeg) {
    const std::size_t packed = packed_driver_stride(encoding, width);
    if (packed == 0) return refused(encoding, width, height, "pictures, whose pixels do not fill whole bytes");
    // Some drivers leave bytes_per_line 0 if there is no padding.
    layout.stride = bytes_per_line == 0 ? packed : bytes_per_line;
    if (layout.stride < packed) return refused(encoding, width, height, "pictures with rows that overlap");
    const bool ours = encoding.packing == none;
    if (ours && layout.stride % pixel_layout(format).sample_bytes != 0)
      return refused(encoding, width, height, "pictures with rows that are not aligned to their numbers");
    layout.bytes = ours ? picture_bytes(format, layout.stride, height)
                        : layout.stride * static_cast<std::size_t>(height - 1) + packed;
    if (size_image < layout.bytes)
      return refused(
          encoding, width, height,
          "pictures of " + std::to_string(size_image) + " bytes, and they need " + std::to_string(layout.bytes));
  }
  layout.view_stride = copied || encoding.packing != none ? packed_stride(format, width) : layout.stride;
  layout.picture_bytes = picture_bytes(format, layout.view_stride, height);
  if (encoding.skip_columns > 0 || encoding.skip_rows > 0) {
    layout.view_offset = static_cast<std::size_t>(encoding.skip_rows) * layout.view_stride +
                         static_cast<std::size_t>(encoding.skip_columns) * pixel_layout(format).pixel_bytes;
    // A view spans whole strides, so one that begins inside a row must end a row earlier, and Bayer rows come in pairs.
    layout.view_width -= 2 * encoding.skip_columns;
    layout.view_height -= 2;
  }
  return layout;
}

View view_of(const Encoding& encoding, const Layout& layout, std::span<const std::byte> picture) {
  const std::size_t bytes = picture_bytes(encoding.format, layout.view_stride, layout.view_height);
  return {0,
          encoding.format,
          layout.view_width,
          layout.view_height,
          layout.view_stride,
          picture.subspan(layout.view_offset, bytes)};
}

bool Converter::convert(std::span<const std::byte> driver, std::span<std::byte> picture) {
  if (picture.size() < layout_.picture_bytes) return false;
  if (encoding_.packing == Packing::jpeg) return jpeg_.decode_frame(driver, layout_.width, layout_.height, picture);
  if (driver.size() < layout_.bytes) return false;
  // NV12's chroma rows follow its luma rows, with the same stride.
  const std::size_t rows = layout_.picture_bytes / layout_.view_stride;
  for (std::size_t row = 0; row < rows; ++row)
    convert_row(driver.subspan(row * layout_.stride), picture.subspan(row * layout_.view_stride, layout_.view_stride));
  return true;
}

void Converter::convert_row(std::span<const std::byte> in, std::span<std::byte> out) const {
  // BufferPool::allocate() aligns this memory for any type, so rows can be accessed as 16-bit words.
  const std::span<std::uint16_t> words(reinterpret_cast<std::uint16_t*>(out.data()), out.size() / 2);
  const auto width = static_cast<std::size_t>(layout_.width);
  switch (encoding_.packing) {
    case Packing::packed10:
      return unpack10(in, words);
    case Packing::packed12:
      return unpack12(in, words);
    case Packing::grey:
      for (std::size_t i = 0; i < width; ++i) out[3 * i] = out[3 * i + 1] = out[3 * i + 2] = in[i];
      return;
    case Packing::none:
    case Packing::jpeg:
      std::memcpy(out.data(), in.data(), out.size());
  }
}

int nearest_in(const StepRange& range, int wanted) {
  if (range.max <= range.min || wanted <= range.min) return range.min;
  const int step = std::max(range.step, 1);
  const long above = std::min<long>(wanted, range.max) - static_cast<long>(range.min);
  long value = range.min + (above + step / 2) / step * step;
  if (value > range.max) value -= step;
  return static_cast<int>(value);
}

Result<SelectedMode> choose_mode(std::span<const Mode> modes, const RequestedFormat& wanted) {
  const Mode* best = nullptr;
  Rank best_rank;
  Fraction best_interval;
  for (const Mode& mode : modes) {
    const Encoding* const encoding = encoding_of(mode.fourcc);
    if (encoding == nullptr || (!wanted.format.empty() && encoding->name != wanted.format)) continue;
    const Fraction interval = nearest_interval(mode, wanted.rate);
    const double rate = interval.rate();
    // An unknown rate is assumed to be sufficient.
    const bool too_slow = rate > 0 && rate < kMinRateFraction * wanted.rate;
    const Rank rank{size_rank(mode, wanted), too_slow ? 1 : 0, encoding - encodings().data(),
                    rate > 0 ? std::abs(rate - wanted.rate) : 0};
    if (best != nullptr && !(rank < best_rank)) continue;
    best = &mode;
    best_rank = rank;
    best_interval = interval;
  }
  if (best == nullptr) return nothing_fits(modes, wanted);
  return SelectedMode{*best, best_interval};
}

}  // namespace lightwell::v4l2
