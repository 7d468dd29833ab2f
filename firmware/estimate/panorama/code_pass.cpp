#include "estimate/panorama/code_pass.hpp"

#include <algorithm>
#include <cmath>
#include <lightwell/color.hpp>

#include "calibration/response.hpp"
#include "estimate/panorama/kernels/block_sums.hpp"
#include "estimate/panorama/kernels/ycbcr_planes.hpp"

namespace lightwell::estimate {
namespace {

/// A block's weights count as a plane where they differ from one by at most this share, RMS. What is left averages out
/// over the pixels of a block, and over blocks.
constexpr double kPlane = 5e-4;
/// Pixels of YCbCr that are turned into planes at a time: 16 rows of three planes of them stay in the nearest cache.
constexpr std::size_t kChunk = 256;

const std::uint8_t* bytes(const View& view, std::size_t row) {
  return reinterpret_cast<const std::uint8_t*>(view.data.data()) + row * view.stride;
}

}  // namespace

CodePass::Scratch::Scratch(std::size_t lanes) : sum(lanes), early(lanes), across(lanes), peak(lanes), clipped(lanes) {}

LaneSums CodePass::Scratch::at(std::size_t lane) {
  return {sum.data() + lane, early.data() + lane, peak.data() + lane, clipped.data() + lane};
}

CodePass::Lanes CodePass::lanes_of(PixelFormat format) {
  if (format == PixelFormat::rgb8) return Lanes::interleaved;
  return is_bayer(format) ? Lanes::mosaic : Lanes::planar;
}

CodePass::CodePass(const RigParameters& rig, const RigTable& table, const BlockLayout& layout)
    : table_(table), layout_(layout), planned_(layout.size()), planes_(3 * kMostRows * kChunk) {
  const auto edge = static_cast<std::size_t>(layout.edge());
  const std::size_t columns = (static_cast<std::size_t>(widest(table)) + edge - 1) / edge;
  groups_.assign(3, Scratch(3 * columns * edge + kFewestLanes + kBlockRoom));
  if (layout.edge() < 2 || layout.edge() > kMostRows) return;
  for (int lens = 0; lens < layout.lens_count(); ++lens)
    plan_lens(lens, rig.lenses[static_cast<std::size_t>(lens)].photometry);
  keep_worths();
  codes_.resize(columns);
}

BlockWorth CodePass::Worths::at(std::size_t block, Lanes lanes) const {
  const auto kind = static_cast<std::size_t>(lanes);
  const auto from = [block](const std::vector<float>& all) { return all.data() + block; };
  return {from(mean),       from(along_x),        from(along_y),        from(half_x),
          from(unit[kind]), from(middle_x[kind]), from(middle_y[kind]), from(total),
          from(pixels),     from(per_total),      from(per_pixel),      from(brighten),
          from(spread),     from(solid_angle)};
}

void CodePass::Codes::resize(std::size_t blocks) {
  for (auto* of_colors : {&sum, &across, &down, &top})
    for (std::vector<float>& values : *of_colors) values.resize(blocks + kBlockLightRoom);
  clipped.resize(blocks + kBlockLightRoom);
}

BlockCodes CodePass::Codes::at_first() {
  const auto of = [](std::array<std::vector<float>, 3>& c) { return std::array{c[0].data(), c[1].data(), c[2].data()}; };
  return {of(sum), of(across), of(down), of(top), clipped.data()};
}

void CodePass::keep_worths() {
  const auto keep = [&](std::vector<float>& out, auto&& value) {
    out.resize(planned_.size() + kBlockLightRoom);
    for (std::size_t block = 0; block < planned_.size(); ++block) out[block] = value(planned_[block]);
  };
  keep(worths_.mean, [](const BlockWeight& b) { return b.mean; });
  keep(worths_.along_x, [](const BlockWeight& b) { return b.along_x; });
  keep(worths_.along_y, [](const BlockWeight& b) { return b.along_y; });
  keep(worths_.half_x, [](const BlockWeight& b) { return b.half_x; });
  keep(worths_.total, [](const BlockWeight& b) { return b.total; });
  keep(worths_.pixels, [](const BlockWeight& b) { return b.pixels; });
  keep(worths_.per_total, [](const BlockWeight& b) { return b.per_total; });
  keep(worths_.per_pixel, [](const BlockWeight& b) { return b.per_pixel; });
  keep(worths_.brighten, [](const BlockWeight& b) { return b.brighten; });
  keep(worths_.spread, [](const BlockWeight& b) { return b.spread; });
  keep(worths_.solid_angle, [](const BlockWeight& b) { return b.solid_angle; });
  for (std::size_t kind = 0; kind < kLaneKinds; ++kind) {
    keep(worths_.unit[kind], [kind](const BlockWeight& b) { return b.unit[kind]; });
    keep(worths_.middle_x[kind], [kind](const BlockWeight& b) { return b.middle_x[kind]; });
    keep(worths_.middle_y[kind], [kind](const BlockWeight& b) { return b.middle_y[kind]; });
  }
  planned_ = {};
}

bool CodePass::takes(std::span<const Frame> bracket) const {
  if (bracket.size() != 1 || lenses_.empty()) return false;
  for (const View& v : bracket[0].views()) {
    if (v.format == PixelFormat::rgb_f32 || v.width < static_cast<int>(kFewestLanes)) return false;
    // A word's table would have 4096 entries; sensors with raw output are linear.
    const bool words = v.format == PixelFormat::bayer_rggb10 || v.format == PixelFormat::bayer_rggb12;
    if (words && !lenses_[static_cast<std::size_t>(v.lens)].identity) return false;
  }
  return true;
}

void CodePass::plan_lens(int lens, const PhotometricCalibration& photometry) {
  LensPlan plan;
  const std::vector<float> linear = linear_table(photometry, 256);
  plan.linear_from = linear.front();
  plan.linear_unit = 1 - plan.linear_from;
  plan.identity = photometry.response.kind == ResponseCurve::Kind::linear;
  // What rounding takes from one code the next gets: light that spreads over several codes keeps its sum.
  double carried = 0;
  for (std::size_t code = 0; code < 256; ++code) {
    const double exact = std::clamp((linear[code] - plan.linear_from) / plan.linear_unit, 0.0F, 1.0F) * 65535.0;
    plan.linear16[code] = static_cast<std::uint16_t>(std::clamp(std::lround(exact + carried), 0L, 65535L));
    carried += exact - plan.linear16[code];
  }
  plan.step8.resize(4096);
  for (std::size_t i = 0, code = 1; i < plan.step8.size(); ++i) {
    while (code < 255 && linear[code] < static_cast<float>(i) / 4095) ++code;
    plan.step8[i] = linear[code] - linear[code - 1];
  }
  plan.clipped8 = saturated_from(photometry, 256);
  plan.clipped10 = saturated_from(photometry, 1024);
  plan.clipped12 = saturated_from(photometry, 4096);
  plan.read2 = static_cast<float>(photometry.read_noise * photometry.read_noise);
  plan.shot = static_cast<float>(photometry.shot_noise);
  plan.cut_noise = photometry.black_level < 2 * photometry.read_noise ? static_cast<float>(photometry.read_noise) : 0.0F;
  for (std::size_t c = 0; c < 3; ++c) plan.white[c] = static_cast<float>(photometry.white_balance[c]);

  const int columns = layout_.columns(lens), height = table_.lenses[static_cast<std::size_t>(lens)].height;
  for (int top = 0; top < height; top += layout_.edge()) {
    BlockRow row;
    const std::size_t first_block = layout_.block_of(lens, 0, top);
    for (int column = 0; column < columns; ++column) {
      BlockWeight& block = planned_[first_block + static_cast<std::size_t>(column)];
      plan_block(lens, first_block + static_cast<std::size_t>(column), block);
      if (!(block.pixels > 0)) continue;
      const bool weighted = block.unit[0] > 0;
      if (row.runs.empty() || row.runs.back().end != column || row.runs.back().weighted != weighted)
        row.runs.push_back({column, column, weighted, {}});
      row.runs.back().end = column + 1;
    }
    for (Run& run : row.runs)
      if (run.weighted) plan_weights(lens, top / layout_.edge(), run);
    plan.rows.push_back(std::move(row));
  }
  lenses_.push_back(std::move(plan));
}

void CodePass::plan_block(int lens_number, std::size_t block, BlockWeight& out) const {
  const LensTable& lens = table_.lenses[static_cast<std::size_t>(lens_number)];
  const BlockLayout::Place p = layout_.place(block);
  double sum = 0, sr = 0, seen = 0, x_fit = 0, y_fit = 0, squares = 0;
  const double middle_x = 0.5 * (p.width - 1), middle_y = 0.5 * (p.height - 1);
  for (int y = 0; y < p.height; ++y) {
    for (int x = 0; x < p.width; ++x) {
      const auto i = static_cast<std::size_t>(p.y + y) * static_cast<std::size_t>(lens.width) + static_cast<std::size_t>(p.x + x);
      const double a = lens.solid_angle[i], w = a * lens.inverse_vignetting[i];
      seen += a > 0 ? 1 : 0;
      sr += a;
      sum += w;
      squares += w * w;
      x_fit += w * (x - middle_x);
      y_fit += w * (y - middle_y);
    }
  }
  out = {};
  if (!(sum > 0)) return;
  const double pixels = static_cast<double>(p.width) * p.height;
  out.half_x = static_cast<float>(middle_x);
  out.pixels = static_cast<float>(seen);
  out.total = static_cast<float>(sum);
  out.solid_angle = static_cast<float>(sr);
  out.per_total = static_cast<float>(1 / sum);
  out.per_pixel = seen > 0 ? 1 / static_cast<float>(seen) : 0;
  out.brighten = sr > 0 ? static_cast<float>(sum / sr) : 0;
  out.spread = seen > 0 ? static_cast<float>(sum * sum / static_cast<double>(seen)) : 0;
  // Sum of (x - middle)² over the block; the fit over a full grid separates.
  const double xx = pixels * (p.width * p.width - 1) / 12.0, yy = pixels * (p.height * p.height - 1) / 12.0;
  const double mean = sum / pixels, along_x = xx > 0 ? x_fit / xx : 0, along_y = yy > 0 ? y_fit / yy : 0;
  const double rest = squares - pixels * mean * mean - along_x * along_x * xx - along_y * along_y * yy;
  if (seen == pixels && rest <= pixels * (kPlane * mean) * (kPlane * mean)) {
    out.mean = static_cast<float>(mean);
    out.along_x = static_cast<float>(along_x);
    out.along_y = static_cast<float>(along_y);
  } else {
    std::fill_n(out.unit, kLaneKinds, 1.0F);
  }
}

CodePass::Stretch CodePass::stretch(const LensTable& lens, Lanes lanes, int first, int end) const {
  const std::size_t per_pixel = lanes == Lanes::interleaved ? 3 : 1, edge = static_cast<std::size_t>(layout_.edge());
  const std::size_t row = static_cast<std::size_t>(lens.width) * per_pixel;
  const std::size_t begin = static_cast<std::size_t>(first) * edge * per_pixel;
  const std::size_t count = std::max(std::min(static_cast<std::size_t>(end) * edge * per_pixel, row) - begin, kFewestLanes);
  return {std::min(begin, row - count), count};
}

void CodePass::plan_weights(int lens_number, int block_row, Run& run) {
  const LensTable& lens = table_.lenses[static_cast<std::size_t>(lens_number)];
  if (lens.width < static_cast<int>(kFewestLanes)) return;
  const int top = block_row * layout_.edge(), rows = std::min(layout_.edge(), lens.height - top);
  const std::size_t first = layout_.block_of(lens_number, run.first * layout_.edge(), top);
  for (std::size_t kind = 0; kind < kLaneKinds; ++kind) {
    const auto lanes = static_cast<Lanes>(kind);
    const Stretch s = stretch(lens, lanes, run.first, run.end);
    run.weights[kind] = weights_.size();
    weights_.resize(weights_.size() + static_cast<std::size_t>(rows) * s.count);
    for (std::size_t b = 0; b < static_cast<std::size_t>(run.end - run.first); ++b)
      round_weights(lens_number, first + b, lanes, s, weights_.data() + run.weights[kind]);
  }
}

/// What rounding takes from one pixel the next gets, to and fro through the block: sums and moments stay.
void CodePass::round_weights(int lens_number, std::size_t block, Lanes lanes, const Stretch& s, std::uint8_t* weights) {
  const LensTable& lens = table_.lenses[static_cast<std::size_t>(lens_number)];
  const BlockLayout::Place p = layout_.place(block);
  // A sample of a mosaic stands for the whole quad.
  const int step = lanes == Lanes::mosaic ? 2 : 1;
  const auto weight = [&](int x, int y) {
    double sum = 0;
    int pixels = 0;
    for (int j = y; j < std::min(y + step, p.height); ++j) {
      for (int i = x; i < std::min(x + step, p.width); ++i, ++pixels) {
        const auto at = static_cast<std::size_t>(p.y + j) * static_cast<std::size_t>(lens.width) + static_cast<std::size_t>(p.x + i);
        sum += static_cast<double>(lens.solid_angle[at]) * lens.inverse_vignetting[at];
      }
    }
    return sum / pixels;
  };
  double largest = 0;
  for (int y = 0; y < p.height; y += step)
    for (int x = 0; x < p.width; x += step) largest = std::max(largest, weight(x, y));
  const std::size_t per_pixel = lanes == Lanes::interleaved ? 3 : 1;
  double carried = 0, sum = 0, x_sum = 0, y_sum = 0;
  for (int y = 0; y < p.height; y += step) {
    const int last = (p.width - 1) / step * step;
    for (int to = 0; to < p.width; to += step) {
      const int x = y / step % 2 == 0 ? to : last - to;
      const double exact = weight(x, y) / largest * 255;
      if (!(exact > 0)) continue;
      // What is seen at all keeps a weight: a sun in the last pixel must not vanish.
      const auto rounded = std::clamp(std::lround(exact + carried), 1L, 255L);
      carried += exact - static_cast<double>(rounded);
      for (int j = y; j < std::min(y + step, p.height); ++j) {
        for (int i = x; i < std::min(x + step, p.width); ++i) {
          sum += static_cast<double>(rounded);
          x_sum += static_cast<double>(rounded) * i;
          y_sum += static_cast<double>(rounded) * j;
          std::uint8_t* at = weights + static_cast<std::size_t>(j) * s.count + static_cast<std::size_t>(p.x + i) * per_pixel - s.begin;
          std::fill_n(at, per_pixel, static_cast<std::uint8_t>(rounded));
        }
      }
    }
  }
  BlockWeight& out = planned_[block];
  const auto kind = static_cast<std::size_t>(lanes);
  out.unit[kind] = static_cast<float>(256 * out.total / sum);
  out.middle_x[kind] = static_cast<float>(x_sum / sum);
  out.middle_y[kind] = static_cast<float>(y_sum / sum);
}

void CodePass::run(const Frame& frame, BlockSums& out) {
  out.clear();
  const auto radiance_per_linear = static_cast<float>(1 / (frame.info.exposure_s * frame.info.gain));
  for (const View& view : frame.views()) {
    const LensPlan& plan = lenses_[static_cast<std::size_t>(view.lens)];
    for (std::size_t row = 0; row < plan.rows.size(); ++row) {
      const int top = static_cast<int>(row) * layout_.edge(), rows = std::min(layout_.edge(), view.height - top);
      for (const Run& run : plan.rows[row].runs) {
        sum_run(view, plan, top, rows, run);
        finish_run(view, plan, top, rows, run, radiance_per_linear, out);
      }
    }
  }
}

void CodePass::sum_run(const View& view, const LensPlan& plan, int top, int rows, const Run& run) {
  const LensTable& lens = table_.lenses[static_cast<std::size_t>(view.lens)];
  const Lanes lanes = lanes_of(view.format);
  const Stretch s = stretch(lens, lanes, run.first, run.end);
  const std::uint8_t* weights = weights_.data() + run.weights[static_cast<std::size_t>(lanes)];
  const CodeTable16* table = plan.identity ? nullptr : &plan.linear16;
  const auto sum_codes = [&](const CodeRows& codes, const std::uint8_t* w, std::size_t w_stride, std::size_t count,
                             const LaneSums& to) {
    if (run.weighted)
      sum_weighted_lanes(codes, w, w_stride, count, to);
    else
      sum_lanes(codes, count, to);
  };
  if (lanes == Lanes::interleaved) {
    sum_codes({bytes(view, static_cast<std::size_t>(top)) + s.begin, view.stride, rows, table, plan.clipped8}, weights,
              s.count, s.count, groups_[0].at(s.begin));
    return;
  }
  if (lanes == Lanes::mosaic) {
    for (std::size_t parity = 0; parity < 2; ++parity) {
      const std::uint8_t* first = bytes(view, static_cast<std::size_t>(top) + parity);
      const LaneSums to = groups_[parity].at(s.begin);
      const std::uint8_t* w = weights + parity * s.count;
      if (view.format == PixelFormat::bayer_rggb8) {
        sum_codes({first + s.begin, 2 * view.stride, rows / 2, table, plan.clipped8}, w, 2 * s.count, s.count, to);
        continue;
      }
      const bool ten = view.format == PixelFormat::bayer_rggb10;
      const WordRows words{first + 2 * s.begin, 2 * view.stride, rows / 2,
                           static_cast<std::uint16_t>(ten ? 1023 : 4095), ten ? plan.clipped10 : plan.clipped12};
      if (run.weighted)
        sum_weighted_wide_lanes(words, w, 2 * s.count, s.count, to);
      else
        sum_wide_lanes(words, s.count, to);
    }
    return;
  }
  for (std::size_t done = 0; done < s.count; done += kChunk) {
    const std::size_t count = std::min(kChunk, std::max(s.count - done, kFewestLanes));
    const std::size_t within = std::min(done, s.count - count), at = s.begin + within;
    const auto plane = [&](int y) {
      constexpr std::size_t kNext = kMostRows * kChunk;
      std::uint8_t* r = planes_.data() + static_cast<std::size_t>(y) * kChunk;
      return PlaneRow{r, r + kNext, r + 2 * kNext};
    };
    const auto line = [&](int y) { return bytes(view, static_cast<std::size_t>(top + y)); };
    if (view.format == PixelFormat::yuyv) {
      for (int y = 0; y < rows; ++y) planes_of_yuyv(line(y) + 2 * at, count, plane(y));
    } else {
      for (int y = 0; y < rows; y += 2) {
        // Blocks begin at even rows; of an odd height the last row has its chroma for itself.
        const int below = std::min(y + 1, rows - 1);
        planes_of_nv12(line(y) + at, line(below) + at, bytes(view, static_cast<std::size_t>(view.height + (top + y) / 2)) + at, count,
                       plane(y), plane(below));
      }
    }
    for (std::size_t c = 0; c < 3; ++c)
      sum_codes({planes_.data() + c * kMostRows * kChunk, kChunk, rows, table, plan.clipped8}, weights + within, s.count,
                count, groups_[c].at(at));
  }
}

template <CodePass::Lanes lanes>
void CodePass::take_codes(const LensPlan& plan, int rows, std::size_t begin, std::size_t columns, std::size_t blocks,
                          unsigned clipped_from) {
  constexpr std::size_t channels = lanes == Lanes::interleaved ? 3 : lanes == Lanes::mosaic ? 2 : 1;
  const auto sum_rows = static_cast<float>(lanes == Lanes::mosaic ? rows / 2 : rows);
  // Sums stay below 2^31, and signed numbers become floats in vectors.
  const auto number = [](std::uint32_t v) { return static_cast<float>(static_cast<std::int32_t>(v)); };
  struct Sums {
    float sum, across, down;
  };
  const auto take = [&](std::size_t g, std::size_t at) {
    const Scratch& group = groups_[g];
    const float sum = number(group.sum[at]);
    return Sums{sum, number(group.across[at]), sum_rows * sum - number(group.early[at])};
  };
  const auto linear = [&](std::uint16_t code) {
    return static_cast<float>(plan.identity ? code : plan.linear16[code]);
  };
  const auto clipped = [&](std::size_t g, std::size_t block, std::size_t c) {
    unsigned count = 0;
    for (std::size_t i = 0; i < columns; ++i) count += groups_[g].clipped[begin + (block * columns + i) * channels + c];
    return static_cast<float>(count * (lanes == Lanes::mosaic ? 4 : 1));
  };
  const auto put = [&](std::size_t c, std::size_t b, const Sums& s, float scale) {
    codes_.sum[c][b] = scale * s.sum;
    codes_.across[c][b] = scale * s.across;
    codes_.down[c][b] = scale * s.down;
  };
  for (std::size_t b = 0; b < blocks; ++b) {
    const std::size_t at = begin + b * channels;
    codes_.clipped[b] = 0;
    if constexpr (lanes == Lanes::mosaic) {
      // Places of quads to places of pixels. Each sample stands for its quad; of green there are two.
      const auto of_pixels = [&](std::size_t q) {
        const Sums s = take(q / 2, at + q % 2);
        return Sums{s.sum, 2 * s.across + 0.5F * s.sum, 2 * s.down + 0.5F * s.sum};
      };
      const Sums g0 = of_pixels(1), g1 = of_pixels(2);
      put(0, b, of_pixels(0), 4);
      put(1, b, {g0.sum + g1.sum, g0.across + g1.across, g0.down + g1.down}, 2);
      put(2, b, of_pixels(3), 4);
      const std::array<std::uint16_t, 4> top = {groups_[0].peak[at], groups_[0].peak[at + 1], groups_[1].peak[at],
                                                groups_[1].peak[at + 1]};
      codes_.top[0][b] = linear(top[0]);
      codes_.top[1][b] = linear(std::max(top[1], top[2]));
      codes_.top[2][b] = linear(top[3]);
      for (std::size_t q = 0; q < 4; ++q)
        if (top[q] >= clipped_from) codes_.clipped[b] = std::max(codes_.clipped[b], clipped(q / 2, b, q % 2));
    } else {
      for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t g = lanes == Lanes::planar ? c : 0, own = lanes == Lanes::planar ? 0 : c;
        put(c, b, take(g, at + own), 1);
        const std::uint16_t top = groups_[g].peak[at + own];
        codes_.top[c][b] = linear(top);
        if (top >= clipped_from) codes_.clipped[b] = std::max(codes_.clipped[b], clipped(g, b, own));
      }
    }
  }
}

void CodePass::finish_run(const View& view, const LensPlan& plan, int top, int rows, const Run& run,
                          float radiance_per_linear, BlockSums& out) {
  const Lanes lanes = lanes_of(view.format);
  const auto edge = static_cast<std::size_t>(layout_.edge()), first = static_cast<std::size_t>(run.first);
  const std::size_t blocks = static_cast<std::size_t>(run.end) - first;
  const std::size_t row_lanes = static_cast<std::size_t>(view.width) * (lanes == Lanes::interleaved ? 3 : 1);
  const std::size_t per_block = edge * (lanes == Lanes::interleaved ? 3 : 1);
  const std::size_t group_count = lanes == Lanes::interleaved ? 1 : lanes == Lanes::mosaic ? 2 : 3;
  const std::size_t channels = lanes == Lanes::interleaved ? 3 : lanes == Lanes::mosaic ? 2 : 1;
  const std::size_t begin = first * per_block, end = begin + blocks * per_block, columns = per_block / channels;
  for (std::size_t g = 0; g < group_count; ++g) {
    Scratch& group = groups_[g];
    // The last block of a row may be narrower.
    for (std::size_t lane = row_lanes; lane < end; ++lane)
      group.sum[lane] = group.early[lane] = group.peak[lane] = group.clipped[lane] = 0;
    sum_blocks(group.at(begin), static_cast<int>(channels), static_cast<int>(columns), blocks, group.across.data() + begin);
  }

  const bool words = view.format == PixelFormat::bayer_rggb10 || view.format == PixelFormat::bayer_rggb12;
  const float top_code = view.format == PixelFormat::bayer_rggb10 ? 1023 : words ? 4095 : 255;
  const unsigned clipped_from = !words ? plan.clipped8 : top_code == 1023 ? plan.clipped10 : plan.clipped12;
  switch (lanes) {
    case Lanes::interleaved: take_codes<Lanes::interleaved>(plan, rows, begin, columns, blocks, clipped_from); break;
    case Lanes::planar: take_codes<Lanes::planar>(plan, rows, begin, columns, blocks, clipped_from); break;
    case Lanes::mosaic: take_codes<Lanes::mosaic>(plan, rows, begin, columns, blocks, clipped_from); break;
  }

  BlockRun in;
  in.weighted = run.weighted;
  in.plain_unit = plan.linear_unit / (plan.identity ? top_code : 65535);
  in.unit = !run.weighted ? in.plain_unit : plan.identity ? in.plain_unit / (words ? 16 : 257) : in.plain_unit;
  // Products of weights lose what is behind the point, on average: of four or eight bits of it.
  in.cut_off = words ? 0.469F : 0.498F;
  in.linear_from = plan.linear_from;
  in.half_y = 0.5F * static_cast<float>(rows - 1);
  in.radiance = radiance_per_linear;
  for (std::size_t c = 0; c < 3; ++c) {
    in.white[c] = plan.white[c];
    in.luminance[c] = kLuminanceWeights[c] * plan.white[c];
  }
  in.read2 = plan.read2;
  in.shot = plan.shot;
  in.cut_noise = plan.cut_noise;
  if (!plan.identity) in.step = plan.step8.data();
  const std::size_t block = layout_.block_of(view.lens, static_cast<int>(first * edge), top);
  const BlockDoubt doubt = light_of_blocks(in, worths_.at(block, lanes), codes_.at_first(), blocks,
                                           {&out.sum[block], &out.peak[block], &out.offset_x[block], &out.offset_y[block],
                                            &out.clipped[block]});
  out.noise += doubt.noise * radiance_per_linear * radiance_per_linear;
  out.bias += doubt.bias * radiance_per_linear;
  out.clipped_sr += doubt.clipped_sr;
}

}  // namespace lightwell::estimate
