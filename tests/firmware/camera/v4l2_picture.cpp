#include "firmware/camera/v4l2_picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <jpeglib.h>
#include <random>

#include <linux/videodev2.h>

namespace lightwell::test {
namespace {

struct Mosaic {
  std::uint32_t fourcc;
  int bits;
  bool packed;
  int red_column, red_row;
};

constexpr std::array kMosaics = {
    Mosaic{V4L2_PIX_FMT_SRGGB8, 8, false, 0, 0},   Mosaic{V4L2_PIX_FMT_SGRBG8, 8, false, 1, 0},
    Mosaic{V4L2_PIX_FMT_SGBRG8, 8, false, 0, 1},   Mosaic{V4L2_PIX_FMT_SBGGR8, 8, false, 1, 1},
    Mosaic{V4L2_PIX_FMT_SRGGB10, 10, false, 0, 0}, Mosaic{V4L2_PIX_FMT_SBGGR10, 10, false, 1, 1},
    Mosaic{V4L2_PIX_FMT_SGRBG12, 12, false, 1, 0}, Mosaic{V4L2_PIX_FMT_SRGGB10P, 10, true, 0, 0},
    Mosaic{V4L2_PIX_FMT_SGBRG10P, 10, true, 0, 1}, Mosaic{V4L2_PIX_FMT_SBGGR12P, 12, true, 1, 1},
};

const Mosaic* mosaic_of(std::uint32_t fourcc) {
  const auto found = std::ranges::find(kMosaics, fourcc, &Mosaic::fourcc);
  return found == kMosaics.end() ? nullptr : &*found;
}

int code(double level, int most) { return static_cast<int>(std::lround(std::clamp(level, 0.0, 1.0) * most)); }

std::byte as_byte(int v) { return static_cast<std::byte>(v); }

/// Level of a mosaic pixel behind its colour filter.
double filtered(const Mosaic& m, double level, int x, int y) {
  const bool red_column = x % 2 == m.red_column, red_row = y % 2 == m.red_row;
  if (red_column && red_row) return level;
  return red_column || red_row ? level / 2 : level / 4;
}

void draw_mosaic_row(const Mosaic& m, double level, int y, int width, std::byte* out) {
  const int most = (1 << m.bits) - 1;
  const auto at = [&](int x) { return code(filtered(m, level, x, y), most); };
  for (int x = 0; x < width; ++x) {
    const int v = at(x);
    if (m.bits == 8) {
      *out++ = as_byte(v);
    } else if (!m.packed) {
      *out++ = as_byte(v & 255);
      *out++ = as_byte(v >> 8);
    } else if (m.bits == 10) {
      *out++ = as_byte(v >> 2);
      if (x % 4 == 3) *out++ = as_byte((at(x - 3) & 3) | (at(x - 2) & 3) << 2 | (at(x - 1) & 3) << 4 | (v & 3) << 6);
    } else {
      *out++ = as_byte(v >> 4);
      if (x % 2 == 1) *out++ = as_byte((at(x - 1) & 15) | (v & 15) << 4);
    }
  }
}

void draw_row(std::uint32_t fourcc, double level, int width, std::byte* out) {
  const int luma = 16 + code(level, 219);
  for (int x = 0; x < width; ++x) {
    if (fourcc == V4L2_PIX_FMT_YUYV) {
      *out++ = as_byte(luma);
      *out++ = as_byte(128);
    } else if (fourcc == V4L2_PIX_FMT_RGB24) {
      *out++ = as_byte(code(level, 255));
      *out++ = as_byte(code(level / 2, 255));
      *out++ = as_byte(code(level / 4, 255));
    } else if (fourcc == V4L2_PIX_FMT_GREY) {
      *out++ = as_byte(code(level, 255));
    } else {
      *out++ = as_byte(luma);  // NV12
    }
  }
}

}  // namespace

std::size_t packed_row_bytes(std::uint32_t fourcc, int width) {
  const auto w = static_cast<std::size_t>(width);
  if (const Mosaic* const m = mosaic_of(fourcc)) {
    const auto bits = static_cast<std::size_t>(m->packed || m->bits == 8 ? m->bits : 16);
    return w * bits / 8;
  }
  switch (fourcc) {
    case V4L2_PIX_FMT_YUYV:
      return 2 * w;
    case V4L2_PIX_FMT_RGB24:
      return 3 * w;
    case V4L2_PIX_FMT_MJPEG:
      return 0;
    default:
      return w;
  }
}

std::size_t encoded_bytes(std::uint32_t fourcc, std::size_t row_bytes, int width, int height) {
  const auto h = static_cast<std::size_t>(height);
  if (fourcc == V4L2_PIX_FMT_MJPEG) return 2048 + 3 * static_cast<std::size_t>(width) * h;
  return fourcc == V4L2_PIX_FMT_NV12 ? row_bytes * h * 3 / 2 : row_bytes * h;
}

std::size_t draw_picture(std::uint32_t fourcc, int width, int height, std::size_t row_bytes, double level,
                         std::uint32_t number, std::span<std::byte> out) {
  if (fourcc == V4L2_PIX_FMT_MJPEG) {
    const std::vector<std::byte> jpeg = draw_jpeg(width, height, code(level, 255), number, false);
    if (jpeg.size() > out.size()) std::abort();
    std::memcpy(out.data(), jpeg.data(), jpeg.size());
    return jpeg.size();
  }
  const std::size_t bytes = encoded_bytes(fourcc, row_bytes, width, height);
  if (bytes > out.size()) std::abort();
  const Mosaic* const mosaic = mosaic_of(fourcc);
  for (int y = 0; y < height; ++y) {
    std::byte* const row = out.data() + static_cast<std::size_t>(y) * row_bytes;
    mosaic != nullptr ? draw_mosaic_row(*mosaic, level, y, width, row) : draw_row(fourcc, level, width, row);
  }
  const std::size_t luma_bytes = row_bytes * static_cast<std::size_t>(height);
  std::memset(out.data() + luma_bytes, 128, bytes - luma_bytes);
  // In the third last row: inside every view, and unlikely to be on a sampling grid.
  const std::size_t mark = row_bytes * static_cast<std::size_t>(height - 3) + packed_row_bytes(fourcc, width) - 12;
  std::memcpy(out.data() + mark, &number, sizeof number);
  return bytes;
}

namespace {

/// `draw` fills one row; `set` may change libjpeg's defaults.
std::vector<std::byte> compressed(int width, int height, bool with_tables,
                                  const std::function<void(jpeg_compress_struct&)>& set,
                                  const std::function<void(int, std::vector<JSAMPLE>&)>& draw) {
  jpeg_compress_struct state{};
  jpeg_error_mgr errors{};
  state.err = jpeg_std_error(&errors);
  jpeg_create_compress(&state);
  unsigned char* memory = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&state, &memory, &size);
  state.image_width = static_cast<JDIMENSION>(width);
  state.image_height = static_cast<JDIMENSION>(height);
  state.input_components = 3;
  state.in_color_space = JCS_RGB;
  jpeg_set_defaults(&state);
  set(state);
  jpeg_start_compress(&state, with_tables ? TRUE : FALSE);
  std::vector<JSAMPLE> row(3 * static_cast<std::size_t>(width));
  for (int y = 0; y < height; ++y) {
    draw(y, row);
    JSAMPROW pointer = row.data();
    jpeg_write_scanlines(&state, &pointer, 1);
  }
  jpeg_finish_compress(&state);
  const auto* const bytes = reinterpret_cast<const std::byte*>(memory);
  std::vector<std::byte> jpeg(bytes, bytes + size);
  jpeg_destroy_compress(&state);
  std::free(memory);
  return jpeg;
}

}  // namespace

std::vector<std::byte> draw_jpeg(int width, int height, int value, std::uint32_t number, bool with_tables) {
  const auto set = [with_tables](jpeg_compress_struct& state) {
    if (with_tables) return;
    // Quantisation tables differ between cameras, and are always present.
    jpeg_suppress_tables(&state, TRUE);
    for (int i = 0; i < 2; ++i) state.quant_tbl_ptrs[i]->sent_table = FALSE;
  };
  return compressed(width, height, with_tables, set, [&](int y, std::vector<JSAMPLE>& row) {
    std::ranges::fill(row, static_cast<JSAMPLE>(value));
    if (y >= height - 8) std::fill(row.end() - 24, row.end(), static_cast<JSAMPLE>(number * 37));
  });
}

std::vector<std::byte> draw_noise_jpeg(int width, int height, unsigned seed, int columns, int rows) {
  std::mt19937 random(seed);
  const auto set = [columns, rows](jpeg_compress_struct& state) {
    state.comp_info[0].h_samp_factor = columns;
    state.comp_info[0].v_samp_factor = rows;
  };
  std::vector<int> before(3 * static_cast<std::size_t>(width), 128);
  return compressed(width, height, true, set, [&](int, std::vector<JSAMPLE>& row) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      before[i] = std::clamp(before[i] + static_cast<int>(random() % 61) - 30, 0, 255);
      row[i] = static_cast<JSAMPLE>(before[i]);
    }
  });
}

}  // namespace lightwell::test
