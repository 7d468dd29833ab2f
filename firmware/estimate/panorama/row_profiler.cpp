#include "estimate/panorama/row_profiler.hpp"

#include <algorithm>
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

RowProfiler::RowProfiler(const RigParameters& rig, const RigTable& table, const BlockLayout& layout,
                         const CellGrid& grid)
    : table_(table), layout_(layout), grid_(grid) {
  for (std::size_t lens = 0; lens < table.lenses.size(); ++lens) {
    const PhotometricCalibration& photometry = rig.lenses[lens].photometry;
    Lens plan;
    for (std::size_t i = 0; i < kCodeBits.size(); ++i) plan.codes[i] = linear_or_nan(photometry, 1 << kCodeBits[i]);
    for (int luma = 0; luma < 256; ++luma) plan.luma.push_back(plan.codes[0][rgb8_of_ycbcr601(luma, 128, 128)[1]]);
    const int height = table.lenses[lens].height;
    plan.group_rows = kGroupRows;
    while (height > plan.group_rows * static_cast<int>(kMaxRowGroups)) plan.group_rows *= 2;
    plan.radiance.reserve(std::max(kMaxRowGroups, static_cast<std::size_t>(height)));
    lenses_.push_back(std::move(plan));
  }
}

std::span<const RowProfile> RowProfiler::profile(const Frame& frame, const BlockSums& blocks) {
  if (frame.views().size() != lenses_.size()) return {};
  for (std::size_t number = 0; number < lenses_.size(); ++number) {
    const int lens = static_cast<int>(number), height = table_.lenses[number].height;
    std::vector<float>& radiance = lenses_[number].radiance;
    radiance.clear();
    for (int top = 0; top < height; top += layout_.edge()) {
      const std::size_t first = layout_.block_of(lens, 0, top);
      const std::size_t end = first + static_cast<std::size_t>(layout_.columns(lens));
      float luminance = 0, solid_angle = 0, clipped = 0;
      for (std::size_t block = first; block < end; ++block) {
        luminance += blocks.sum[block].luminance();
        solid_angle += grid_.solid_angle(block);
        clipped += blocks.clipped[block];
      }
      const bool usable = solid_angle > 0 && clipped == 0;
      radiance.push_back(usable ? luminance / solid_angle : std::numeric_limits<float>::quiet_NaN());
    }
    profiles_[number] = {radiance, height, layout_.edge()};
  }
  return {profiles_.data(), lenses_.size()};
}

std::span<const RowProfile> RowProfiler::profile(const Frame& exposure) {
  if (exposure.views().size() != lenses_.size()) return {};
  const auto per_linear = static_cast<float>(1 / (exposure.info.exposure_s * exposure.info.gain));
  for (const View& view : exposure.views()) {
    const PixelLayout& layout = pixel_layout(view.format);
    if (layout.is_float()) return {};
    const auto number = static_cast<std::size_t>(view.lens);
    Lens& lens = lenses_[number];
    lens.radiance.clear();
    const std::vector<float>& linear =
        layout.sampling == ColorSampling::ycbcr ? lens.luma : lens.codes[layout.depth_index()];
    const std::size_t step = layout.pixel_bytes, within = layout.luma_offset;
    for (int top = 0; top < view.height; top += lens.group_rows) {
      const int y = (top + std::min(lens.group_rows, view.height - top) / 2) & ~1;
      const std::uint8_t* row = row_of(view, y);
      const RowSpan span = table_.lenses[number].rows[static_cast<std::size_t>(y)];
      const float mean = layout.sample_bytes == 2
                             ? mean_of_row(span,
                                           [&](std::size_t x) {
                                             std::uint16_t code = 0;
                                             std::memcpy(&code, row + 2 * x, sizeof code);
                                             return linear[code & (linear.size() - 1)];
                                           })
                             : mean_of_row(span, [&](std::size_t x) { return linear[row[x * step + within]]; });
      lens.radiance.push_back(mean * per_linear);
    }
    profiles_[number] = {lens.radiance, view.height, lens.group_rows};
  }
  return {profiles_.data(), lenses_.size()};
}

}  // namespace lightwell::estimate
