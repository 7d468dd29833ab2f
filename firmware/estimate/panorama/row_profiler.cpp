#include "estimate/panorama/row_profiler.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include <lightwell/pixel.hpp>

#include "calibration/model/response.hpp"

namespace lightwell::estimate {
namespace {

/// One row of this many is evaluated. Bands of 120 Hz are hundreds of rows long.
constexpr int kGroupRows = 16;

std::vector<float> linear_or_nan(const PhotometricCalibration& photometry, int levels) {
  std::vector<float> out = linear_table(photometry, levels);
  for (std::size_t code = saturated_from(photometry, levels); code < out.size(); ++code)
    out[code] = std::numeric_limits<float>::quiet_NaN();
  return out;
}

/// Mean over the odd columns of a row; in even rows of a Bayer mosaic these are green.
template <class Value>
float mean_of_row(RowSpan span, Value&& value) {
  float sum = 0;
  int n = 0;
  for (int x = span.first | 1; x < span.end; x += 2, ++n) sum += value(static_cast<std::size_t>(x));
  return n > 0 ? sum / static_cast<float>(n) : std::numeric_limits<float>::quiet_NaN();
}

}  // namespace

RowProfiler::RowProfiler(const RigParameters& rig, const RigTable& table) : table_(table) {
  for (std::size_t lens = 0; lens < table.lenses.size(); ++lens) {
    const PhotometricCalibration& photometry = rig.lenses[lens].photometry;
    Lens plan;
    plan.code8 = linear_or_nan(photometry, 256);
    plan.code10 = linear_or_nan(photometry, 1024);
    plan.code12 = linear_or_nan(photometry, 4096);
    for (int luma = 0; luma < 256; ++luma) plan.luma.push_back(plan.code8[rgb8_of_ycbcr601(luma, 128, 128)[1]]);
    const int height = table.lenses[lens].height;
    plan.group_rows = kGroupRows;
    while (height > plan.group_rows * static_cast<int>(kMaxRowGroups)) plan.group_rows *= 2;
    plan.radiance.reserve(kMaxRowGroups);
    lenses_.push_back(std::move(plan));
  }
}

std::span<const RowProfile> RowProfiler::profile(const Frame& frame) {
  if (frame.views().size() != lenses_.size()) return {};
  const auto per_linear = static_cast<float>(1 / (frame.info.exposure_s * frame.info.gain));
  for (const View& view : frame.views()) {
    if (view.format == PixelFormat::rgb_f32) return {};
    const auto number = static_cast<std::size_t>(view.lens);
    Lens& lens = lenses_[number];
    lens.radiance.clear();
    const bool words = view.format == PixelFormat::bayer_rggb10 || view.format == PixelFormat::bayer_rggb12;
    const std::vector<float>& word = view.format == PixelFormat::bayer_rggb10 ? lens.code10 : lens.code12;
    const bool is_luma = view.format == PixelFormat::nv12 || view.format == PixelFormat::yuyv;
    const std::vector<float>& byte = is_luma ? lens.luma : lens.code8;
    // Bytes from one pixel to the next, and within a pixel to green or luma.
    const std::size_t step = view.format == PixelFormat::rgb8 ? 3 : words || view.format == PixelFormat::yuyv ? 2 : 1;
    const std::size_t within = view.format == PixelFormat::rgb8 ? 1 : 0;
    for (int top = 0; top < view.height; top += lens.group_rows) {
      const int y = (top + std::min(lens.group_rows, view.height - top) / 2) & ~1;
      const auto* row =
          reinterpret_cast<const std::uint8_t*>(view.data.data()) + static_cast<std::size_t>(y) * view.stride;
      const RowSpan span = table_.lenses[number].rows[static_cast<std::size_t>(y)];
      const float mean = words ? mean_of_row(span,
                                             [&](std::size_t x) {
                                               std::uint16_t code = 0;
                                               std::memcpy(&code, row + 2 * x, sizeof code);
                                               return word[code & (word.size() - 1)];
                                             })
                               : mean_of_row(span, [&](std::size_t x) { return byte[row[x * step + within]]; });
      lens.radiance.push_back(mean * per_linear);
    }
    profiles_[number] = {lens.radiance, view.height, lens.group_rows};
  }
  return {profiles_.data(), lenses_.size()};
}

}  // namespace lightwell::estimate
