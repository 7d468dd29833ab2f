#include "app/small_picture.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <lightwell/quantile.hpp>

#include "calibration/model/response.hpp"

namespace lightwell {
namespace {

/// Along each side of a small pixel's area.
constexpr int kSamples = 3;
/// Share of the pixels of floats that are brighter than white.
constexpr double kAboveWhite = 0.01;

using Linear = std::array<float, 3>;

/// A row of a view, planes after one another.
const std::byte* row_of(const View& view, int y) {
  return view.data.data() + static_cast<std::size_t>(y) * view.stride;
}

unsigned sample_at(const View& view, int x, int y) {
  const PixelLayout& layout = pixel_layout(view.format);
  return std::min(code_at(view, x, y), static_cast<unsigned>(layout.full_scale()));
}

float finite_or_zero(float v) { return std::isfinite(v) && v > 0 ? v : 0; }

Linear linear_at(const View& view, int x, int y, const std::vector<float>& table) {
  const auto of_ycbcr = [&](int luma, const std::byte* chroma, std::ptrdiff_t to_cr) {
    const auto rgb = rgb8_of_ycbcr601(luma, std::to_integer<int>(chroma[0]), std::to_integer<int>(chroma[to_cr]));
    return Linear{table[rgb[0]], table[rgb[1]], table[rgb[2]]};
  };
  const auto luma = [&] { return static_cast<int>(code_at(view, x, y)); };
  switch (view.format) {
    case PixelFormat::rgb8: {
      const std::byte* at = row_of(view, y) + 3 * static_cast<std::ptrdiff_t>(x);
      return {table[std::to_integer<std::size_t>(at[0])], table[std::to_integer<std::size_t>(at[1])],
              table[std::to_integer<std::size_t>(at[2])]};
    }
    case PixelFormat::nv12:
      return of_ycbcr(luma(), row_of(view, view.height + y / 2) + (x & ~1), 1);
    case PixelFormat::yuyv:
      return of_ycbcr(luma(), row_of(view, y) + 2 * static_cast<std::ptrdiff_t>(x & ~1) + 1, 2);
    case PixelFormat::bayer_rggb8:
    case PixelFormat::bayer_rggb10:
    case PixelFormat::bayer_rggb12: {
      const int left = x & ~1, top = y & ~1;
      return {table[sample_at(view, left, top)],
              0.5F * (table[sample_at(view, left + 1, top)] + table[sample_at(view, left, top + 1)]),
              table[sample_at(view, left + 1, top + 1)]};
    }
    case PixelFormat::rgb_f32: {
      Linear out;
      std::memcpy(out.data(), row_of(view, y) + 12 * static_cast<std::ptrdiff_t>(x), sizeof out);
      for (float& v : out) v = finite_or_zero(v);
      return out;
    }
  }
  return {};
}

/// The pixels along a side of `size` that are read: up to kSamples, spread evenly, in each of `small` equal parts.
std::vector<int> sample_positions(int size, int small) {
  const long long n = static_cast<long long>(std::min(kSamples, std::max(1, size / small))) * small;
  std::vector<int> out;
  for (long long k = 0; k < n; ++k) out.push_back(static_cast<int>((2 * k + 1) * size / (2 * n)));
  return out;
}

/// Of linear values from 0 to 1; adjacent entries differ by less than a code above 0.001.
constexpr std::size_t kCurveSteps = 4096;
const std::array<std::uint8_t, kCurveSteps + 1>& srgb_codes() {
  static const auto kCodes = [] {
    std::array<std::uint8_t, kCurveSteps + 1> codes{};
    for (std::size_t i = 0; i <= kCurveSteps; ++i)
      codes[i] = static_cast<std::uint8_t>(255 * linear_to_srgb(static_cast<double>(i) / kCurveSteps) + 0.5);
    return codes;
  }();
  return kCodes;
}

/// White of a picture of floats; 1 for a black one.
float white_of(const std::vector<float>& rgb) {
  std::vector<float> lit;
  for (std::size_t i = 0; i + 2 < rgb.size(); i += 3)
    if (const float v = std::max({rgb[i], rgb[i + 1], rgb[i + 2]}); v > 0) lit.push_back(v);
  if (lit.empty()) return 1;
  const double rank = (1 - kAboveWhite) * static_cast<double>(lit.size() - 1);
  return static_cast<float>(order_statistic(lit, static_cast<std::size_t>(rank)));
}

}  // namespace

PictureReducer::PictureReducer(const RigParameters& rig) {
  int width = 1, height = 1;
  for (const LensParameters& lens : rig.lenses) {
    width = std::max(width, lens.width);
    height = std::max(height, lens.height);
  }
  const int lens_width = kSmallPictureWidth / std::max(1, static_cast<int>(rig.lenses.size()));
  const double factor =
      std::min({1.0, static_cast<double>(lens_width) / width, static_cast<double>(kSmallPictureHeight) / height});
  for (const LensParameters& from : rig.lenses) {
    Lens lens;
    lens.width = from.width;
    lens.height = from.height;
    lens.x = width_;
    lens.small_width = std::max(1, static_cast<int>(from.width * factor));
    lens.small_height = std::max(1, static_cast<int>(from.height * factor));
    lens.columns = sample_positions(from.width, lens.small_width);
    lens.rows = sample_positions(from.height, lens.small_height);
    for (std::size_t c = 0; c < 3; ++c) lens.white_balance[c] = static_cast<float>(from.photometry.white_balance[c]);
    for (const int bits : kCodeBits) lens.tables.push_back(linear_table(from.photometry, 1 << bits));
    width_ += lens.small_width;
    height_ = std::max(height_, lens.small_height);
    lenses_.push_back(std::move(lens));
  }
}

SmallPicture PictureReducer::blank() const {
  return {std::vector<float>(3 * static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_)), 1};
}

void PictureReducer::reduce(const Frame& frame, SmallPicture& out) const {
  std::fill(out.rgb.begin(), out.rgb.end(), 0.0F);
  out.white = 1;
  for (const View& view : frame.views()) {
    if (view.lens < 0 || static_cast<std::size_t>(view.lens) >= lenses_.size()) continue;
    const Lens& lens = lenses_[static_cast<std::size_t>(view.lens)];
    if (view.width == lens.width && view.height == lens.height && check_view(view).ok()) reduce_lens(view, lens, out);
  }
}

void PictureReducer::reduce_lens(const View& view, const Lens& lens, SmallPicture& out) const {
  const PixelLayout& layout = pixel_layout(view.format);
  if (layout.is_float()) out.white = 0;
  const std::vector<float>& table = lens.tables[layout.depth_index()];
  const std::size_t nx = lens.columns.size() / static_cast<std::size_t>(lens.small_width);
  const std::size_t ny = lens.rows.size() / static_cast<std::size_t>(lens.small_height);
  for (std::size_t j = 0; j < static_cast<std::size_t>(lens.small_height); ++j) {
    float* to = out.rgb.data() + 3 * (j * static_cast<std::size_t>(width_) + static_cast<std::size_t>(lens.x));
    for (std::size_t i = 0; i < static_cast<std::size_t>(lens.small_width); ++i, to += 3) {
      Linear sum{};
      for (std::size_t row = j * ny; row < (j + 1) * ny; ++row)
        for (std::size_t column = i * nx; column < (i + 1) * nx; ++column) {
          const Linear v = linear_at(view, lens.columns[column], lens.rows[row], table);
          for (std::size_t c = 0; c < 3; ++c) sum[c] += v[c];
        }
      for (std::size_t c = 0; c < 3; ++c) to[c] = sum[c] * lens.white_balance[c] / static_cast<float>(nx * ny);
    }
  }
}

Image encode_srgb(const SmallPicture& picture, int width, int height) {
  const float white = picture.white > 0 ? picture.white : white_of(picture.rgb);
  Image out{width, height, PixelFormat::rgb8, std::vector<std::byte>(picture.rgb.size())};
  for (std::size_t i = 0; i < out.data.size(); ++i) {
    const float linear = std::clamp(picture.rgb[i] / white, 0.0F, 1.0F);
    out.data[i] = std::byte{srgb_codes()[static_cast<std::size_t>(linear * kCurveSteps + 0.5F)]};
  }
  return out;
}

}  // namespace lightwell
