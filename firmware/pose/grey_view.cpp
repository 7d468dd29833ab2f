#include "pose/grey_view.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string>

#include <lightwell/quantile.hpp>

#include "calibration/model/response.hpp"

namespace lightwell {
namespace {

constexpr int kMaxSide_px = 16384;

float float_at(const std::byte* at) {
  float v;
  std::memcpy(&v, at, sizeof v);
  return v;
}

/// The share of pixels of a float picture that are brighter than white and clipped.
constexpr double kAboveWhite = 0.01;
/// Every 37th pixel is sampled to estimate white.
constexpr std::size_t kSampleStride = 37;

void grey_of_mosaic(const View& view, std::uint8_t* out) {
  const PixelLayout& layout = pixel_layout(view.format);
  const bool words = layout.sample_bytes == 2;
  const int shift = layout.bits - 8;
  const auto site = [&](int x, int y) -> unsigned {
    const std::byte* at =
        view.data.data() + static_cast<std::size_t>(y) * view.stride + static_cast<std::size_t>(x) * (words ? 2 : 1);
    const unsigned v = words ? std::to_integer<unsigned>(at[0]) | std::to_integer<unsigned>(at[1]) << 8
                             : std::to_integer<unsigned>(at[0]);
    return std::min(v >> shift, 255U);
  };
  for (int y = 0; y < view.height; ++y)
    for (int x = 0; x < view.width; ++x) {
      // In an RGGB mosaic green is where x + y is odd.
      if (((x + y) & 1) != 0) {
        *out++ = static_cast<std::uint8_t>(site(x, y));
        continue;
      }
      const unsigned sum = site(x > 0 ? x - 1 : x + 1, y) + site(x + 1 < view.width ? x + 1 : x - 1, y) +
                           site(x, y > 0 ? y - 1 : y + 1) + site(x, y + 1 < view.height ? y + 1 : y - 1);
      *out++ = static_cast<std::uint8_t>((sum + 2) / 4);
    }
}

}  // namespace

Status GreyPicture::validate() const {
  const auto wrong = [](const std::string& what) { return invalid_argument("picture: " + what); };
  if (width < 1 || height < 1 || width > kMaxSide_px || height > kMaxSide_px)
    return wrong("it has " + std::to_string(width) + "x" + std::to_string(height) + " pixels; a side must be 1 to " +
                 std::to_string(kMaxSide_px));
  const auto row = static_cast<std::size_t>(width);
  if (stride < row || stride > static_cast<std::size_t>(1) << 20)
    return wrong("stride is " + std::to_string(stride) + " bytes for rows of " + std::to_string(width));
  const std::size_t needed = stride * static_cast<std::size_t>(height - 1) + row;
  if (data.size() < needed)
    return wrong("it has " + std::to_string(data.size()) + " bytes and needs " + std::to_string(needed));
  return {};
}

int contrast_above_noise(const GreyPicture& picture) {
  // AprilTag's contrast test covers 3 x 3 tiles of 4 x 4 pixels.
  constexpr int kWindow = 12, kColumns = 16, kRows = 12;
  constexpr int kMinContrast = 5, kMaxContrast = 15;
  // The share of flat windows in most pictures; where fewer are flat, kMaxContrast limits the result.
  constexpr double kFlat = 0.4;
  if (picture.width < kWindow || picture.height < kWindow) return kMinContrast;
  std::array<int, static_cast<std::size_t>(kColumns) * kRows> ranges;
  std::size_t n = 0;
  for (int row = 0; row < kRows; ++row)
    for (int column = 0; column < kColumns; ++column) {
      const int x0 = (picture.width - kWindow) * column / (kColumns - 1);
      const int y0 = (picture.height - kWindow) * row / (kRows - 1);
      int least = 255, most = 0;
      for (int y = y0; y < y0 + kWindow; ++y)
        for (int x = x0; x < x0 + kWindow; ++x) {
          const int v = picture.at(x, y);
          least = std::min(least, v);
          most = std::max(most, v);
        }
      ranges[n++] = most - least;
    }
  const auto flat = static_cast<int>(upper_quantile(ranges, kFlat));
  // A margin for windows with more noise than the typical one.
  return std::clamp(flat + flat / 4 + 1, kMinContrast, kMaxContrast);
}

GreyPicture GreyView::of(const View& view) {
  if (view.width < 2 || view.height < 2 || !check_view(view).ok()) return {};
  const auto width = static_cast<std::size_t>(view.width), height = static_cast<std::size_t>(view.height);
  if (view.format == PixelFormat::nv12)
    return {{reinterpret_cast<const std::uint8_t*>(view.data.data()), view.stride * height},
            view.width,
            view.height,
            view.stride};
  bytes_.resize(width * height);
  const auto row = [&view](std::size_t y) { return view.data.data() + y * view.stride; };
  switch (view.format) {
    case PixelFormat::nv12:
      break;
    case PixelFormat::rgb8:
      for (std::size_t y = 0; y < height; ++y) {
        const auto* in = reinterpret_cast<const std::uint8_t*>(row(y));
        std::uint8_t* out = bytes_.data() + y * width;
        for (std::size_t x = 0; x < width; ++x)
          out[x] = static_cast<std::uint8_t>((in[3 * x] + 2U * in[3 * x + 1] + in[3 * x + 2] + 2U) >> 2);
      }
      break;
    case PixelFormat::yuyv:
      for (std::size_t y = 0; y < height; ++y) {
        const auto* in = reinterpret_cast<const std::uint8_t*>(row(y));
        std::uint8_t* out = bytes_.data() + y * width;
        for (std::size_t x = 0; x < width; ++x) out[x] = in[2 * x];
      }
      break;
    case PixelFormat::bayer_rggb8:
    case PixelFormat::bayer_rggb10:
    case PixelFormat::bayer_rggb12:
      grey_of_mosaic(view, bytes_.data());
      break;
    case PixelFormat::rgb_f32: {
      sample_.clear();
      for (std::size_t i = 0; i < width * height; i += kSampleStride) {
        const float g = float_at(row(i / width) + 12 * (i % width) + 4);
        if (std::isfinite(g) && g > 0) sample_.push_back(g);
      }
      float white = 1;
      if (!sample_.empty()) {
        const double rank = (1 - kAboveWhite) * static_cast<double>(sample_.size() - 1);
        white = static_cast<float>(order_statistic(sample_, static_cast<std::size_t>(rank)));
      }
      for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x) {
          const float g = float_at(row(y) + 12 * x + 4) / white;
          bytes_[y * width + x] =
              g > 0 ? static_cast<std::uint8_t>(255 * std::sqrt(std::min(g, 1.0F)) + 0.5F) : std::uint8_t{0};
        }
      break;
    }
  }
  return {bytes_, view.width, view.height, width};
}

std::vector<float> linear_of_grey(PixelFormat format, const PhotometricCalibration& photometry) {
  if (!pixel_layout(format).is_float()) return linear_table(photometry, 256);
  std::vector<float> out(256);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<float>(i * i) / (255.0F * 255.0F);
  return out;
}

}  // namespace lightwell
