// Reads Radiance pictures (Ward, "Radiance File Formats", and the Radiance reference): RGBE, run-length encoded in the
// new or the old way, or uncompressed. OpenCV's decoder fills in missing data without an error, hence this reader.
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>
#include <string_view>

#include "imaging/image_readers.hpp"

namespace lightwell {
namespace {

using Rgbe = std::array<std::uint8_t, 4>;

struct Header {
  int width = 0, height = 0;
  std::array<double, 3> scale{1, 1, 1};  ///< Factors that the pixels were multiplied by; divided out.
};

/// The bytes of the file that are still to be read.
using Input = std::span<const std::byte>;

std::optional<std::uint8_t> take_byte(Input& in) {
  if (in.empty()) return std::nullopt;
  const auto b = std::to_integer<std::uint8_t>(in[0]);
  in = in.subspan(1);
  return b;
}

std::optional<Rgbe> take_pixel(Input& in) {
  Rgbe p;
  if (in.size() < p.size()) return std::nullopt;
  std::memcpy(p.data(), in.data(), p.size());
  in = in.subspan(p.size());
  return p;
}

std::optional<std::string_view> take_line(Input& in) {
  const std::string_view all(reinterpret_cast<const char*>(in.data()), in.size());
  const std::size_t end = all.find('\n');
  if (end == std::string_view::npos) return std::nullopt;
  in = in.subspan(end + 1);
  return all.substr(0, end);
}

bool take_prefix(std::string_view& text, std::string_view prefix) {
  if (!text.starts_with(prefix)) return false;
  text.remove_prefix(prefix.size());
  while (text.starts_with(' ')) text.remove_prefix(1);
  return true;
}

template <class T>
bool take_number(std::string_view& text, T& out) {
  while (text.starts_with(' ')) text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return error == std::errc();
}

/// EXPOSURE and COLORCORR: factors already applied to the pixels; several lines multiply.
Status take_factor(const std::string& name, std::string_view line, Header& header) {
  std::string_view text = line;
  std::array<double, 3> factor{};
  bool good = false;
  if (take_prefix(text, "EXPOSURE=")) {
    good = take_number(text, factor[0]);
    factor[1] = factor[2] = factor[0];
  } else {
    take_prefix(text, "COLORCORR=");
    good = take_number(text, factor[0]) && take_number(text, factor[1]) && take_number(text, factor[2]);
  }
  for (std::size_t c = 0; c < 3; ++c) {
    if (!good || !(factor[c] > 0) || !std::isfinite(factor[c]))
      return image_damaged(name, "the header line '" + std::string(line) + "' is invalid");
    header.scale[c] *= factor[c];
  }
  return {};
}

Result<Header> read_header(const std::string& name, Input& in) {
  Header header;
  const auto truncated = [&] { return image_truncated(name, "inside the HDR's header"); };
  std::optional<std::string_view> line = take_line(in);  // The magic word.
  while (true) {
    line = take_line(in);
    if (!line) return truncated();
    if (line->empty()) break;
    std::string_view text = *line;
    if (take_prefix(text, "FORMAT=")) {
      if (text.starts_with("32-bit_rle_xyze"))
        return image_refused(name, "XYZE colours; convert it with: ra_xyze -r in.hdr out.hdr");
      if (!text.starts_with("32-bit_rle_rgbe"))
        return image_refused(name, "the format '" + std::string(text) + "', not 32-bit_rle_rgbe");
    } else if (text.starts_with("EXPOSURE=") || text.starts_with("COLORCORR=")) {
      if (Status s = take_factor(name, text, header); !s.ok()) return s;
    }
  }
  line = take_line(in);
  if (!line) return truncated();
  std::string_view text = *line;
  std::int64_t width = 0, height = 0;
  const bool upright = take_prefix(text, "-Y ") && take_number(text, height) && take_prefix(text, " +X ") &&
                       take_number(text, width) && text.empty();
  if (!upright)
    return image_refused(name, "the size line '" + std::string(line->substr(0, 60)) +
                                   "', not '-Y height +X width'; convert it with pflip or protate");
  if (Status s = check_image_size(name, width, height); !s.ok()) return s;
  header.width = static_cast<int>(width);
  header.height = static_cast<int>(height);
  return header;
}

enum class RowEnd { whole, cut_off, damaged };

/// New run-length encoding: each of the four components separately, as runs (128 + n, value) and literals (n, values).
RowEnd read_adaptive_rle(Input& in, std::span<Rgbe> row) {
  for (std::size_t c = 0; c < 4; ++c) {
    for (std::size_t i = 0; i < row.size();) {
      const auto code = take_byte(in);
      if (!code) return RowEnd::cut_off;
      const bool run = *code > 128;
      const std::size_t count = run ? *code - 128U : *code;
      if (count == 0 || count > row.size() - i) return RowEnd::damaged;
      std::optional<std::uint8_t> value;
      for (std::size_t k = 0; k < count; ++k, ++i) {
        if (k == 0 || !run) value = take_byte(in);
        if (!value) return RowEnd::cut_off;
        row[i][c] = *value;
      }
    }
  }
  return RowEnd::whole;
}

/// Old run-length encoding: a pixel (1, 1, 1, n) repeats the previous one n times; the next such pixels 256 n, ...
RowEnd read_old_rle(Input& in, std::span<Rgbe> row, Rgbe first) {
  unsigned shift = 0;
  std::optional<Rgbe> pixel = first;
  for (std::size_t i = 0; i < row.size();) {
    if (!pixel) pixel = take_pixel(in);
    if (!pixel) return RowEnd::cut_off;
    const Rgbe p = *pixel;
    pixel.reset();
    if (p[0] != 1 || p[1] != 1 || p[2] != 1) {
      row[i++] = p;
      shift = 0;
      continue;
    }
    const std::size_t count = shift < 32 ? std::size_t{p[3]} << shift : row.size() + 1;
    if (i == 0 || count > row.size() - i) return RowEnd::damaged;
    for (std::size_t k = 0; k < count; ++k, ++i) row[i] = row[i - 1];
    shift += 8;
  }
  return RowEnd::whole;
}

RowEnd read_row(Input& in, std::span<Rgbe> row) {
  const auto first = take_pixel(in);
  if (!first) return RowEnd::cut_off;
  const bool new_runs =
      row.size() >= 8 && row.size() <= 0x7FFF && (*first)[0] == 2 && (*first)[1] == 2 && (*first)[2] < 128;
  if (!new_runs) return read_old_rle(in, row, *first);
  if ((std::size_t{(*first)[2]} << 8 | (*first)[3]) != row.size()) return RowEnd::damaged;
  return read_adaptive_rle(in, row);
}

/// (mantissa + 1/2) / 256 * 2^(exponent - 128): writers truncate the mantissa; the middle of its interval is unbiased.
void store(std::span<const Rgbe> row, const Header& header, std::byte* out) {
  for (const Rgbe& p : row) {
    std::array<float, 3> rgb{};
    if (p[3] != 0)
      for (std::size_t c = 0; c < 3; ++c)
        rgb[c] = static_cast<float>(std::ldexp(p[c] + 0.5, p[3] - (128 + 8)) / header.scale[c]);
    std::memcpy(out, rgb.data(), sizeof rgb);
    out += sizeof rgb;
  }
}

}  // namespace

Result<Image> read_hdr(const std::string& name, std::span<const std::byte> file) {
  Input in = file;
  const Result<Header> header = read_header(name, in);
  if (!header) return header.status();
  // The smallest size of a row: one pixel, or four bytes for 2^24 pixels in the old encoding.
  if (in.size() < 4 * static_cast<std::size_t>(header->height))
    return image_truncated(name, "the HDR's rows are missing");
  Image image{header->width, header->height, PixelFormat::rgb_f32, {}};
  image.data.resize(image.stride() * static_cast<std::size_t>(image.height));
  std::vector<Rgbe> row(static_cast<std::size_t>(image.width));
  for (int y = 0; y < image.height; ++y) {
    const RowEnd end = read_row(in, row);
    const std::string where = "in row " + std::to_string(y) + " of the HDR";
    if (end == RowEnd::cut_off) return image_truncated(name, where);
    if (end == RowEnd::damaged) return image_damaged(name, where);
    store(row, *header, image.data.data() + image.stride() * static_cast<std::size_t>(y));
  }
  if (in.size() > 0) return image_damaged(name, std::to_string(in.size()) + " bytes follow the HDR's last row");
  return image;
}

}  // namespace lightwell
