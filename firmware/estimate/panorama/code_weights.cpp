#include "estimate/panorama/code_weights.hpp"

#include <algorithm>
#include <cmath>

#include "imaging/pixel_layout.hpp"

namespace lightwell::estimate {

/// Largest RMS residual of a block's weights about the plane, relative to their mean. It averages out over pixels.
constexpr double kMaxPlaneResidual = 5e-4;

Lanes lanes_of(PixelFormat format) {
  if (pixel_layout(format).sampling == ColorSampling::rgb) return Lanes::interleaved;
  return is_bayer(format) ? Lanes::mosaic : Lanes::planar;
}

CodeWeights::CodeWeights(const RigTable& table, const BlockLayout& layout)
    : table_(table), layout_(layout), block_weights_(layout.size() + kBlockLightPadding) {
  if (layout.edge() < 2 || layout.edge() > kMaxRows) return;
  for (int lens = 0; lens < layout.lens_count(); ++lens) {
    auto& rows = rows_.emplace_back();
    for (int top = 0; top < table.lenses[static_cast<std::size_t>(lens)].height; top += layout.edge())
      plan_row(lens, top, rows.emplace_back());
  }
}

CodeWeights::BlockWeightArrays::BlockWeightArrays(std::size_t blocks) {
  for (auto* values : {&mean, &along_x, &along_y, &half_x, &total, &pixels, &per_total, &per_pixel, &inverse_vignetting,
                       &spread, &solid_angle})
    values->resize(blocks);
  for (auto* of_lanes : {&unit, &middle_x, &middle_y})
    for (std::vector<float>& values : *of_lanes) values.resize(blocks);
}

BlockWeights CodeWeights::block_weights(std::size_t block, Lanes lanes) const {
  const auto kind = static_cast<std::size_t>(lanes);
  const auto from = [block](const std::vector<float>& all) { return all.data() + block; };
  const BlockWeightArrays& w = block_weights_;
  return {from(w.mean),       from(w.along_x),        from(w.along_y),        from(w.half_x),
          from(w.unit[kind]), from(w.middle_x[kind]), from(w.middle_y[kind]), from(w.total),
          from(w.pixels),     from(w.per_total),      from(w.per_pixel),      from(w.inverse_vignetting),
          from(w.spread),     from(w.solid_angle)};
}

void CodeWeights::plan_row(int lens, int top, std::vector<WeightRun>& runs) {
  const std::size_t first_block = layout_.block_of(lens, 0, top);
  for (int column = 0; column < layout_.columns(lens); ++column) {
    const std::size_t block = first_block + static_cast<std::size_t>(column);
    plan_block(lens, block);
    if (!(block_weights_.pixels[block] > 0)) continue;
    const bool weighted = block_weights_.unit[0][block] > 0;
    if (runs.empty() || runs.back().blocks.end != column || runs.back().weighted != weighted)
      runs.push_back({{column, column}, weighted, {}});
    runs.back().blocks.end = column + 1;
  }
  for (WeightRun& run : runs)
    if (run.weighted) plan_weights(lens, top, run);
}

void CodeWeights::plan_block(int lens_number, std::size_t block) {
  const LensTable& lens = table_.lenses[static_cast<std::size_t>(lens_number)];
  const BlockLayout::Place p = layout_.place(block);
  double sum = 0, sr = 0, visible = 0, x_fit = 0, y_fit = 0, squares = 0;
  const double middle_x = 0.5 * (p.width - 1), middle_y = 0.5 * (p.height - 1);
  BlockLayout::for_each_pixel(p, lens, [&](int x, int y, std::size_t i) {
    const double a = lens.solid_angle[i], w = a * lens.inverse_vignetting[i];
    visible += a > 0 ? 1 : 0;
    sr += a;
    sum += w;
    squares += w * w;
    x_fit += w * (x - middle_x);
    y_fit += w * (y - middle_y);
  });
  if (!(sum > 0)) return;
  const double pixels = static_cast<double>(p.width) * p.height;
  block_weights_.half_x[block] = static_cast<float>(middle_x);
  block_weights_.pixels[block] = static_cast<float>(visible);
  block_weights_.total[block] = static_cast<float>(sum);
  block_weights_.solid_angle[block] = static_cast<float>(sr);
  block_weights_.per_total[block] = static_cast<float>(1 / sum);
  block_weights_.per_pixel[block] = visible > 0 ? 1 / static_cast<float>(visible) : 0;
  block_weights_.inverse_vignetting[block] = sr > 0 ? static_cast<float>(sum / sr) : 0;
  block_weights_.spread[block] = visible > 0 ? static_cast<float>(sum * sum / static_cast<double>(visible)) : 0;
  // Sums of (x - middle)² and (y - middle)² over the block; on a full grid the fits of x and y are independent.
  const double xx = pixels * (p.width * p.width - 1) / 12.0, yy = pixels * (p.height * p.height - 1) / 12.0;
  const double mean = sum / pixels, along_x = xx > 0 ? x_fit / xx : 0, along_y = yy > 0 ? y_fit / yy : 0;
  const double residual = squares - pixels * mean * mean - along_x * along_x * xx - along_y * along_y * yy;
  if (visible == pixels && residual <= pixels * (kMaxPlaneResidual * mean) * (kMaxPlaneResidual * mean)) {
    block_weights_.mean[block] = static_cast<float>(mean);
    block_weights_.along_x[block] = static_cast<float>(along_x);
    block_weights_.along_y[block] = static_cast<float>(along_y);
  } else {
    for (std::vector<float>& unit : block_weights_.unit) unit[block] = 1;
  }
}

LaneRange CodeWeights::lane_range(int lens, Lanes lanes, const WeightRun& run, BlockRange blocks) const {
  const std::size_t per_pixel = lanes == Lanes::interleaved ? 3 : 1, edge = static_cast<std::size_t>(layout_.edge());
  const std::size_t row = static_cast<std::size_t>(table_.lenses[static_cast<std::size_t>(lens)].width) * per_pixel;
  // The lanes of `range`, moved left and widened so that at least kMinLanes end before `limit`.
  const auto lanes_of_range = [&](BlockRange range, std::size_t limit) {
    const std::size_t begin = static_cast<std::size_t>(range.first) * edge * per_pixel;
    const std::size_t end = std::min(static_cast<std::size_t>(range.end) * edge * per_pixel, row);
    const std::size_t count = std::max(end - begin, kMinLanes);
    return LaneRange{std::min(begin, limit - count), count};
  };
  const LaneRange whole = lanes_of_range(run.blocks, row);
  return lanes_of_range(blocks, whole.begin + whole.count);
}

void CodeWeights::plan_weights(int lens_number, int top, WeightRun& run) {
  const LensTable& lens = table_.lenses[static_cast<std::size_t>(lens_number)];
  if (lens.width < static_cast<int>(kMinLanes)) return;
  const int rows = std::min(layout_.edge(), lens.height - top);
  const std::size_t first = layout_.block_of(lens_number, run.blocks.first * layout_.edge(), top);
  for (std::size_t kind = 0; kind < kLaneKinds; ++kind) {
    const auto lanes = static_cast<Lanes>(kind);
    const LaneRange s = lane_range(lens_number, lanes, run, run.blocks);
    run.weights[kind] = bytes_.size();
    bytes_.resize(bytes_.size() + static_cast<std::size_t>(rows) * s.count);
    for (std::size_t b = 0; b < static_cast<std::size_t>(run.blocks.end - run.blocks.first); ++b)
      round_weights(lens_number, first + b, lanes, s, bytes_.data() + run.weights[kind]);
  }
}

/// Rounds weights to 8 bits with error diffusion in serpentine order, which preserves sums and moments.
void CodeWeights::round_weights(int lens_number, std::size_t block, Lanes lanes, const LaneRange& s,
                                std::uint8_t* weights) {
  const LensTable& lens = table_.lenses[static_cast<std::size_t>(lens_number)];
  const BlockLayout::Place p = layout_.place(block);
  // A sample of a mosaic represents its quad.
  const int step = lanes == Lanes::mosaic ? 2 : 1;
  const auto weight = [&](int x, int y) {
    double sum = 0;
    int pixels = 0;
    for (int j = y; j < std::min(y + step, p.height); ++j) {
      for (int i = x; i < std::min(x + step, p.width); ++i, ++pixels) {
        const std::size_t at = lens.index(p.x + i, p.y + j);
        sum += static_cast<double>(lens.solid_angle[at]) * lens.inverse_vignetting[at];
      }
    }
    return sum / pixels;
  };
  double largest = 0;
  for (int y = 0; y < p.height; y += step)
    for (int x = 0; x < p.width; x += step) largest = std::max(largest, weight(x, y));
  const std::size_t per_pixel = lanes == Lanes::interleaved ? 3 : 1;
  double rounding_error = 0, sum = 0, x_sum = 0, y_sum = 0;
  for (int y = 0; y < p.height; y += step) {
    const int last = (p.width - 1) / step * step;
    for (int to = 0; to < p.width; to += step) {
      const int x = y / step % 2 == 0 ? to : last - to;
      const double exact = weight(x, y) / largest * 255;
      if (!(exact > 0)) continue;
      // Visible pixels keep a nonzero weight, so that a sun at the edge of a lens does not vanish.
      const auto rounded = std::clamp(std::lround(exact + rounding_error), 1L, 255L);
      rounding_error += exact - static_cast<double>(rounded);
      for (int j = y; j < std::min(y + step, p.height); ++j) {
        for (int i = x; i < std::min(x + step, p.width); ++i) {
          sum += static_cast<double>(rounded);
          x_sum += static_cast<double>(rounded) * i;
          y_sum += static_cast<double>(rounded) * j;
          std::uint8_t* at =
              weights + static_cast<std::size_t>(j) * s.count + static_cast<std::size_t>(p.x + i) * per_pixel - s.begin;
          std::fill_n(at, per_pixel, static_cast<std::uint8_t>(rounded));
        }
      }
    }
  }
  const auto kind = static_cast<std::size_t>(lanes);
  block_weights_.unit[kind][block] = static_cast<float>(256 * block_weights_.total[block] / sum);
  block_weights_.middle_x[kind][block] = static_cast<float>(x_sum / sum);
  block_weights_.middle_y[kind][block] = static_cast<float>(y_sum / sum);
}

}  // namespace lightwell::estimate
