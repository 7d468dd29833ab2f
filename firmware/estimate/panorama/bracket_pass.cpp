#include "estimate/panorama/bracket_pass.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include <lightwell/color.hpp>

#include "calibration/model/response.hpp"
#include "estimate/panorama/kernels/lane_sums.hpp"

namespace lightwell::estimate {
namespace {

/// Columns of pixels that are processed at once: their sums fit into the L1 cache.
constexpr int kBracketChunk = 384;
/// Tolerances of the comparison of exposures. On a uniform wall, the rounding error is the same in all pixels: up to
/// 1.7 sigma of a pixel in each exposure. Response and exposure times are known to about 1 %.
constexpr float kNoiseSigmas = 3, kRelativeTolerance = 0.02F;
/// The same for formats with shared chroma, which is rounded before its conversion to r, g, b.
constexpr float kChromaNoiseSigmas = 6, kChromaRelativeTolerance = 0.05F;
/// Planes of r, g, b and of shared_tops(), each of two rows.
constexpr std::size_t kPlaneRows = 8;
constexpr int kMinLanesInt = static_cast<int>(kMinLanes);
constexpr std::size_t kColumnKinds = 10 + 2 * (kMaxBracket - 1);

/// Rounds a float to its upper `bits` bits.
float round_mantissa(float v, int bits) {
  const auto whole = std::bit_cast<std::uint32_t>(v);
  const std::uint32_t half = 1U << (31 - bits);
  return std::bit_cast<float>((whole + half) & ~(2 * half - 1));
}

template <std::size_t kBytes>
void set_bytes(const std::vector<float>& values, CodeBytes<kBytes>& out) {
  for (std::size_t code = 0; code < values.size(); ++code)
    for (std::size_t b = 0; b < kBytes; ++b)
      out[b][code] = static_cast<std::uint8_t>(std::bit_cast<std::uint32_t>(values[code]) >> (24 - 8 * b));
}

CodeLut make_lut(const PhotometricCalibration& p, int levels) {
  CodeLut w;
  w.linear = linear_table(p, levels);
  w.weight.resize(w.linear.size());
  const auto read2 = static_cast<float>(p.read_noise * p.read_noise), shot = static_cast<float>(p.shot_noise);
  const auto cut_noise = p.black_level < 2 * p.read_noise ? static_cast<float>(p.read_noise) : 0.0F;
  w.saturated_from = saturated_from(p, levels);
  std::vector<float> variance(w.linear.size());
  for (std::size_t i = 0; i < w.linear.size(); ++i) {
    const float x = w.linear[i], step = i > 0 ? x - w.linear[i - 1] : w.linear[1] - w.linear[0];
    // 1e-12 keeps the weight finite for a camera without a noise model; variances of linear values are then equal.
    variance[i] = read2 + shot * std::max(0.0F, x) + step * step * (1.0F / 12) + 1e-12F;
    const float bias = near_black_bias(x, step, cut_noise);
    if (!(bias > 0)) continue;
    w.near_black_limit = std::max(w.near_black_limit, x + 0.5F * step);
    w.near_black_bias = std::max(w.near_black_bias, bias);
  }
  if (p.response.kind == ResponseCurve::Kind::linear) {
    w.unit = static_cast<float>(1 / ((levels - 1) * (1 - p.black_level)));
    for (std::size_t i = 0; i < w.linear.size(); ++i)
      w.linear[i] = static_cast<float>(i) - static_cast<float>((levels - 1) * p.black_level);
  }
  w.near_black_limit /= w.unit;
  w.near_black_bias /= w.unit;
  for (std::size_t i = 0; i < w.saturated_from && i < w.weight.size(); ++i)
    w.weight[i] = round_mantissa(w.unit * w.unit / variance[i], 16);
  if (w.saturated_from < w.linear.size()) w.saturated_linear = w.linear[w.saturated_from];
  if (levels == 256) {
    for (float& linear : w.linear) linear = round_mantissa(linear, 24);
    set_bytes(w.linear, w.linear_bytes);
    set_bytes(w.weight, w.weight_bytes);
  }
  return w;
}

}  // namespace

BracketPass::BracketPass(const RigParameters& rig, const RigTable& table, const BlockLayout& layout)
    : table_(table), layout_(layout) {
  const auto width = static_cast<std::size_t>(max_image_width(table));
  // Whole blocks, and padding for whole vectors.
  column_stride_ = width + kMaxRows + 2 * kMinLanes;
  sums_.resize(kColumnKinds * column_stride_);
  float* at = sums_.data();
  const auto next = [&] { return std::exchange(at, at + column_stride_); };
  for (float** column : {&columns_.r, &columns_.g, &columns_.b, &columns_.low, &columns_.peak, &columns_.noise,
                         &columns_.bias, &columns_.clipped, &folded_.luminance, &folded_.across})
    *column = next();
  for (auto& column : columns_.difference) column = next();
  for (auto& column : columns_.noise_allowance) column = next();
  planes_.resize(kMaxBracket * kPlaneRows * width);
  disagreement_.resize(kBracketChunk);
  for (const LensParameters& lens : rig.lenses) {
    const PhotometricCalibration& p = lens.photometry;
    LensPlan plan;
    for (std::size_t i = 0; i < kCodeBits.size(); ++i) plan.luts[i] = make_lut(p, 1 << kCodeBits[i]);
    plan.linear = p.response.kind == ResponseCurve::Kind::linear;
    for (std::size_t c = 0; c < 3; ++c) plan.white[c] = static_cast<float>(p.white_balance[c]);
    lenses_.push_back(std::move(plan));
  }
}

bool BracketPass::supports(std::span<const Frame> bracket) const {
  // A quad of a mosaic must lie in one block.
  if (bracket.size() < 2 || layout_.edge() < 2) return false;
  const PixelFormat format = bracket[0].views()[0].format;
  if (pixel_layout(format).is_float()) return false;
  for (const Frame& frame : bracket)
    for (const View& v : frame.views())
      if (v.format != format || v.width < (is_bayer(format) ? 2 : 1) * kMinLanesInt) return false;
  return true;
}

void BracketPass::sort(std::span<const Frame> bracket) {
  count_ = static_cast<int>(bracket.size());
  format_ = bracket[0].views()[0].format;
  std::array<double, kMaxBracket> exposure{};
  std::array<std::uint8_t, kMaxBracket> order{};
  for (std::size_t k = 0; k < bracket.size(); ++k) {
    exposure[k] = bracket[k].info.exposure_s * bracket[k].info.gain;
    std::size_t at = k;
    for (; at > 0 && exposure[order[at - 1]] > exposure[k]; --at) order[at] = order[at - 1];
    order[at] = static_cast<std::uint8_t>(k);
  }
  const double longest = exposure[order[bracket.size() - 1]];
  unit_ = static_cast<float>(1 / longest);
  for (LensPlan& plan : lenses_) plan.present = false;
  for (std::size_t k = 0; k < bracket.size(); ++k) {
    // An exposure that is shorter by more than 1e12 contributes only lower bounds.
    scale_[k] = static_cast<float>(std::min(longest / exposure[order[k]], 1e12));
    for (const View& view : bracket[order[k]].views()) {
      LensPlan& plan = lenses_[static_cast<std::size_t>(view.lens)];
      plan.present = true;
      plan.view[k] = view;
    }
  }
}

void BracketPass::run(std::span<const Frame> bracket, std::span<const std::uint8_t> read, const SampledRows& sampled,
                      BlockSums& out) {
  sort(bracket);
  out.clear_totals();
  for (int lens = 0; lens < layout_.lens_count(); ++lens) {
    const LensPlan& plan = lenses_[static_cast<std::size_t>(lens)];
    if (!plan.present) continue;
    const LensTable& table = table_.lenses[static_cast<std::size_t>(lens)];
    const CodeLut& lut = plan.luts[pixel_layout(format_).depth_index()];
    for (int top = 0; top < table.height; top += layout_.edge()) {
      const int rows = std::min(layout_.edge(), table.height - top);
      const std::size_t row = layout_.block_of(lens, 0, top);
      for_each_read(
          read, row, row + static_cast<std::size_t>(layout_.columns(lens)), [&](std::size_t first, std::size_t last) {
            const int left = static_cast<int>(first - row) * layout_.edge();
            const int right = std::min(static_cast<int>(last - row) * layout_.edge(), table.width);
            for (int begin = left; begin < right; begin += kBracketChunk)
              run_chunk({lens, table, plan, lut, top, rows, begin, std::min(begin + kBracketChunk, right), sampled},
                        out);
          });
    }
  }
}

void BracketPass::run_chunk(const Chunk& chunk, BlockSums& out) {
  const std::size_t first_block = layout_.block_of(chunk.lens, chunk.begin, chunk.top);
  const std::size_t first = static_cast<std::size_t>(chunk.begin) / (is_bayer(format_) ? 2 : 1);
  const auto blocks = static_cast<std::size_t>((chunk.end - chunk.begin + layout_.edge() - 1) >> layout_.shift());
  const float unit = unit_ * chunk.lut.unit;
  const float pixels = is_bayer(format_) ? 4 : 1;  // per column of the comparison
  sum(chunk, count_);
  unsigned reduced_counts = 0;  // Bit mask of the numbers of exposures of blocks that exclude some.
  for (std::size_t k = 0; k < blocks; ++k) {
    const int consistent = consistent_exposures(first + k, disagreement_[k]);
    out.exposures[first_block + k] = static_cast<std::uint8_t>(consistent);
    out.block_motion[first_block + k] = 0;
    if (consistent == count_)
      finish_block(chunk, first_block + k, first + k, out);
    else
      reduced_counts |= 1U << consistent;
  }
  for (int count = 1; count < count_; ++count) {
    if ((reduced_counts >> count & 1U) == 0) continue;
    sum(chunk, count);
    for (std::size_t k = 0; k < blocks; ++k) {
      const std::size_t block = first_block + k;
      if (out.exposures[block] != count) continue;
      finish_block(chunk, block, first + k, out);
      out.block_motion[block] =
          std::max(disagreement_[k] * pixels * layout_.pixel_sr(block) * unit, out.sum[block].luminance());
      out.motion_luminance += out.block_motion[block];
    }
  }
}

void BracketPass::sum(const Chunk& chunk, int count) {
  const LensTable& lens = chunk.table;
  const auto width = static_cast<std::size_t>(lens.width);
  const int per = is_bayer(format_) ? 2 : 1;
  const auto first = static_cast<std::size_t>(chunk.begin / per),
             length = static_cast<std::size_t>((chunk.end - chunk.begin) / per);
  const int edge = layout_.edge() / per;
  const auto blocks = (length + static_cast<std::size_t>(edge) - 1) / static_cast<std::size_t>(edge);
  const std::size_t column_count = blocks * static_cast<std::size_t>(edge);
  for (float* column : {columns_.r, columns_.g, columns_.b, columns_.low, columns_.peak, columns_.noise, columns_.bias,
                        columns_.clipped})
    std::fill_n(column + first, column_count, 0.0F);
  for (std::size_t k = 0; k + 1 < static_cast<std::size_t>(count); ++k) {
    std::fill_n(columns_.difference[k] + first, column_count, 0.0F);
    std::fill_n(columns_.noise_allowance[k] + first, column_count, 0.0F);
  }

  BracketRow row;
  const PixelLayout& layout = pixel_layout(format_);
  row.source = layout.sampling == ColorSampling::rgb
                   ? chunk.plan.linear ? BracketSource::linear8 : BracketSource::interleaved8
               : layout.sampling == ColorSampling::ycbcr ? BracketSource::planes8
               : layout.sample_bytes == 1                ? BracketSource::mosaic8
                                                         : BracketSource::mosaic16;
  row.lut = &chunk.lut;
  row.count = count;
  row.noise_sigmas = row.source == BracketSource::planes8 ? kChromaNoiseSigmas : kNoiseSigmas;
  row.relative_tolerance = row.source == BracketSource::planes8 ? kChromaRelativeTolerance : kRelativeTolerance;
  row.next_row = width;
  for (std::size_t c = 0; c < 3; ++c) row.luminance[c] = static_cast<float>(kLuminanceWeights[c]) * chunk.plan.white[c];
  for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) row.exposures[k].scale = scale_[k];
  const int read_rows = chunk.sampled.count(chunk.rows);
  for (int k = 0; k < read_rows; k += per) {
    const int y = chunk.top + chunk.sampled.row(k);
    const RowSpan span = span_of(lens, y);
    const int begin = std::max(span.first, chunk.begin), end = std::min(span.end, chunk.end);
    if (begin >= end) continue;
    row.solid_angle = lens.solid_angle.data() + static_cast<std::size_t>(y) * width;
    row.inverse_vignetting = lens.inverse_vignetting.data() + static_cast<std::size_t>(y) * width;
    row.depth = static_cast<float>(y - chunk.top) + (per == 2 ? 0.5F : 0.0F);
    // Whole vectors are read; where the span is narrower, pixels beside it, too.
    const int readable_end = std::min(std::max((end + 1) & ~1, begin / 2 * 2 + per * kMinLanesInt), lens.width);
    const int readable_begin = std::max(0, std::min(begin / 2 * 2, readable_end - per * kMinLanesInt));
    set_row_pointers(chunk, y, readable_begin, readable_end, row);
    merge_bracket_row(row, static_cast<std::size_t>(begin / per), static_cast<std::size_t>(end / per),
                      static_cast<std::size_t>(readable_end / per), columns_);
  }
  fold_bracket_columns(columns_, count - 1, row.luminance, first, edge, blocks, folded_);
}

RowSpan BracketPass::span_of(const LensTable& lens, int y) const {
  RowSpan span = lens.rows[static_cast<std::size_t>(y)];
  const PixelLayout& layout = pixel_layout(format_);
  if (layout.unit_width == 1) return span;
  // Pairs, and quads of two rows, are processed together.
  if (layout.unit_height == 2) {
    const RowSpan other = lens.rows[static_cast<std::size_t>(y ^ 1)];
    if (span.first >= span.end)
      span = other;
    else if (other.first < other.end)
      span = {std::min(span.first, other.first), std::max(span.end, other.end)};
  }
  return {span.first & ~1, (span.end + 1) & ~1};
}

std::ptrdiff_t BracketPass::prefetch_distance(const Chunk& chunk, int y, std::ptrdiff_t row,
                                              std::ptrdiff_t pixel) const {
  const int per = chunk.sampled.all() ? is_bayer(format_) ? 2 : 1 : chunk.sampled.step;
  if (y + per < chunk.top + chunk.rows) return per * row;
  // The first row of the next chunk, to the right or below.
  const std::ptrdiff_t below = chunk.top + chunk.rows - y;
  return chunk.end >= chunk.table.width ? below * row - chunk.begin * pixel
                                        : (chunk.end - chunk.begin) * pixel - (y - chunk.top) * row;
}

void BracketPass::set_row_pointers(const Chunk& chunk, int y, int begin, int end, BracketRow& row) {
  row.ahead = prefetch_distance(chunk, y, chunk.table.width, 1);
  for (std::size_t k = 0; k < static_cast<std::size_t>(row.count); ++k) {
    const View& view = chunk.plan.view[k];
    ExposureRow& e = row.exposures[k];
    if (row.source == BracketSource::planes8) {
      convert_to_planes(chunk, y, begin, end, k, e);
      continue;
    }
    e.at = {row_of(view, y), is_bayer(format_) ? row_of(view, y + 1) : nullptr, nullptr, nullptr};
    e.ahead = prefetch_distance(chunk, y, static_cast<std::ptrdiff_t>(view.stride),
                                static_cast<std::ptrdiff_t>(pixel_layout(format_).pixel_bytes));
  }
}

void BracketPass::convert_to_planes(const Chunk& chunk, int y, int begin, int end, std::size_t k, ExposureRow& out) {
  const View& view = chunk.plan.view[k];
  const auto width = static_cast<std::size_t>(chunk.table.width);
  const auto from = static_cast<std::size_t>(begin), pixels = static_cast<std::size_t>(end - begin);
  const auto stride = static_cast<std::ptrdiff_t>(view.stride);
  std::uint8_t* first = planes_.data() + k * kPlaneRows * width;
  const auto plane = [&](int row, std::size_t c) { return first + (4 * static_cast<std::size_t>(row) + c) * width; };
  const auto planes = [&](int row) {
    return PlaneRow{plane(row, 0) + from, plane(row, 1) + from, plane(row, 2) + from};
  };
  const unsigned saturated_from = chunk.lut.saturated_from;
  const bool quads = format_ == PixelFormat::nv12;
  const int row = quads ? y % 2 : 0;
  out.at = {plane(row, 0), plane(row, 1), plane(row, 2), plane(row, 3)};
  if (row == 1 && chunk.sampled.all()) return;  // Converted with the row above.
  const PlaneRow upper = planes(0), lower = planes(1);
  if (!quads) {
    const std::uint8_t* here = row_of(view, y) + 2 * from;
    prefetch(here, prefetch_distance(chunk, y, stride, 2), 2 * pixels);
    planes_of_yuyv(here, pixels, upper);
    shared_tops(upper, nullptr, pixels, saturated_from, plane(0, 3) + from, nullptr);
    return;
  }
  const std::uint8_t* here = row_of(view, y - row) + from;
  const std::uint8_t* chroma = row_of(view, view.height + y / 2) + from;
  const std::ptrdiff_t ahead = prefetch_distance(chunk, y + 1, stride, 1) + stride;
  prefetch(here, ahead, pixels);
  prefetch(here + stride, ahead, pixels);
  // Chroma has half as many rows as luma.
  prefetch(chroma, y + 2 < chunk.top + chunk.rows ? stride : ahead + stride * (chunk.rows / 2 - 1), pixels);
  planes_of_nv12(here, here + stride, chroma, pixels, upper, lower);
  shared_tops(upper, &lower, pixels, saturated_from, plane(0, 3) + from, plane(1, 3) + from);
}

int BracketPass::consistent_exposures(std::size_t at, float& disagreement) const {
  for (std::size_t pair = 0; pair + 1 < static_cast<std::size_t>(count_); ++pair) {
    disagreement = std::abs(columns_.difference[pair][at]);
    if (disagreement > columns_.noise_allowance[pair][at]) return static_cast<int>(pair) + 1;
  }
  disagreement = 0;
  return count_;
}

void BracketPass::finish_block(const Chunk& chunk, std::size_t block, std::size_t at, BlockSums& out) const {
  const std::array<float, 3>& white = chunk.plan.white;
  const float luminance = folded_.luminance[at], unit = unit_ * chunk.lut.unit;
  // Converts positions of quads to positions of pixels.
  const float across = is_bayer(format_) ? 2 * folded_.across[at] + 0.5F * luminance : folded_.across[at];
  const CellSum light{columns_.r[at] * white[0] * unit, columns_.g[at] * white[1] * unit,
                      columns_.b[at] * white[2] * unit};
  out.set(block, light, columns_.peak[at] * unit, luminance, across, columns_.low[at], layout_.middle(block),
          columns_.clipped[at]);
  out.block_noise[block] = columns_.noise[at] * unit * unit;
  out.block_bias[block] = columns_.bias[at] * unit;
  out.noise += static_cast<double>(columns_.noise[at]) * unit * unit;
  out.bias += static_cast<double>(columns_.bias[at]) * unit;
}

}  // namespace lightwell::estimate
