#include "estimate/panorama/code_pass.hpp"

#include <algorithm>
#include <cmath>

#include <lightwell/color.hpp>

#include "calibration/model/response.hpp"
#include "imaging/pixel_layout.hpp"

namespace lightwell::estimate {
namespace {

/// Pixels of YCbCr that are converted to planes at a time: 16 rows of three planes fit into the L1 cache.
constexpr std::size_t kCodeChunk = 256;

}  // namespace

CodePass::CodePass(const RigParameters& rig, const RigTable& table, const BlockLayout& layout)
    : layout_(layout), weights_(table, layout), planes_(3 * kMaxRows * kCodeChunk) {
  const auto edge = static_cast<std::size_t>(layout.edge());
  const std::size_t columns = (static_cast<std::size_t>(max_image_width(table)) + edge - 1) / edge;
  groups_.assign(3, Scratch(3 * columns * edge + kMinLanes));
  if (layout.edge() < 2 || layout.edge() > kMaxRows) return;
  for (int lens = 0; lens < layout.lens_count(); ++lens)
    plan_lens(rig.lenses[static_cast<std::size_t>(lens)].photometry);
  codes_.resize(columns);
}

void CodePass::Codes::resize(std::size_t blocks) {
  for (auto* of_colors : {&sum, &across, &down, &top})
    for (std::vector<float>& values : *of_colors) values.resize(blocks + kBlockLightPadding);
  clipped.resize(blocks + kBlockLightPadding);
}

BlockCodes CodePass::Codes::at_first() {
  const auto of = [](std::array<std::vector<float>, 3>& c) {
    return std::array{c[0].data(), c[1].data(), c[2].data()};
  };
  return {of(sum), of(across), of(down), of(top), clipped.data()};
}

bool CodePass::supports(std::span<const Frame> bracket) const {
  // lenses_ is empty if the kernels do not support the height of the blocks: see the constructor.
  if (bracket.size() != 1 || lenses_.empty()) return false;
  for (const View& v : bracket[0].views()) {
    const PixelLayout& layout = pixel_layout(v.format);
    if (layout.is_float() || v.width < static_cast<int>(kMinLanes)) return false;
    // The kernels of this pass have lookup tables for 8-bit codes only; sensors with raw output are linear.
    if (layout.bits > 8 && !lenses_[static_cast<std::size_t>(v.lens)].linear) return false;
  }
  return true;
}

void CodePass::plan_lens(const PhotometricCalibration& photometry) {
  LensPlan plan;
  const std::vector<float> linear = linear_table(photometry, 256);
  const float linear_from = linear.front();
  plan.linear_unit = 1 - linear_from;
  plan.linear = photometry.response.kind == ResponseCurve::Kind::linear;
  std::array<double, 256> linear16{};
  for (std::size_t code = 0; code < linear16.size(); ++code)
    linear16[code] = (linear[code] - linear_from) / plan.linear_unit * 65535.0;
  plan.linear16 = CodeTable(linear16);
  plan.step8.resize(4096);
  for (std::size_t i = 0, code = 1; i < plan.step8.size(); ++i) {
    while (code < 255 && linear[code] < static_cast<float>(i) / 4095) ++code;
    plan.step8[i] = linear[code] - linear[code - 1];
  }
  for (std::size_t i = 0; i < kCodeBits.size(); ++i)
    plan.clipped_from[i] = saturated_from(photometry, 1 << kCodeBits[i]);
  BlockRun& run = plan.run;
  run.linear_from = linear_from;
  run.read2 = static_cast<float>(photometry.read_noise * photometry.read_noise);
  run.shot = static_cast<float>(photometry.shot_noise);
  run.cut_noise = photometry.black_level < 2 * photometry.read_noise ? static_cast<float>(photometry.read_noise) : 0.0F;
  for (std::size_t c = 0; c < 3; ++c) {
    run.white[c] = static_cast<float>(photometry.white_balance[c]);
    run.luminance[c] = kLuminanceWeights[c] * run.white[c];
  }
  if (!plan.linear) run.step = plan.step8.data();
  lenses_.push_back(std::move(plan));
}

void CodePass::run(const Frame& frame, std::span<const std::uint8_t> read, const SampledRows& sampled, BlockSums& out) {
  out.clear_totals();
  const auto radiance_per_linear = static_cast<float>(1 / (frame.info.exposure_s * frame.info.gain));
  for (const View& view : frame.views()) {
    const LensPlan& plan = lenses_[static_cast<std::size_t>(view.lens)];
    for (int top = 0; top < view.height; top += layout_.edge()) {
      const int rows = sampled.count(std::min(layout_.edge(), view.height - top));
      const std::size_t row = layout_.block_of(view.lens, 0, top);
      for (const WeightRun& run : weights_.runs(view.lens, top / layout_.edge())) {
        const auto column = [row](std::size_t block) { return static_cast<int>(block - row); };
        for_each_read(read, row + static_cast<std::size_t>(run.blocks.first),
                      row + static_cast<std::size_t>(run.blocks.end), [&](std::size_t first, std::size_t last) {
                        const Strip strip{view, plan, top, rows, sampled, run, {column(first), column(last)}};
                        sum_strip(strip);
                        finish_strip(strip, radiance_per_linear, out);
                        std::fill(&out.block_motion[first], out.block_motion.data() + last, 0.0F);
                      });
      }
    }
  }
}

void CodePass::sum_strip(const Strip& strip) {
  const auto& [view, plan, top, rows, sampled, run, blocks] = strip;
  const PixelLayout& layout = pixel_layout(view.format);
  const unsigned clipped_from = plan.clipped_from[layout.depth_index()];
  const Lanes lanes = lanes_of(view.format);
  const LaneRange s = weights_.lane_range(view.lens, lanes, run, blocks);
  const LaneRange whole = weights_.lane_range(view.lens, lanes, run, run.blocks);
  const CodeTable* table = plan.linear ? nullptr : &plan.linear16;
  // Weights from a lane of row `first` on, of every `step`th row.
  const auto weights_at = [&](std::size_t lane, std::size_t first, std::size_t step) {
    if (!run.weighted) return LaneWeights{nullptr, 0};
    return LaneWeights{weights_.weights(run, lanes) + first * whole.count + (lane - whole.begin), step * whole.count};
  };
  const auto step = static_cast<std::size_t>(sampled.step);
  if (lanes == Lanes::interleaved) {
    sum_lanes({row_of(view, top + sampled.row(0)) + s.begin, step * view.stride, rows, table, clipped_from},
              weights_at(s.begin, 0, 1), s.count, groups_[0].at(s.begin));
    return;
  }
  if (lanes == Lanes::mosaic) {
    const std::size_t quad_stride = (sampled.all() ? 2 : step) * view.stride;
    for (std::size_t parity = 0; parity < 2; ++parity) {
      const std::uint8_t* first = row_of(view, top + sampled.row(static_cast<int>(parity)));
      const LaneSums to = groups_[parity].at(s.begin);
      const LaneWeights weights = weights_at(s.begin, parity, 2);
      if (layout.sample_bytes == 1)
        sum_lanes({first + s.begin, quad_stride, rows / 2, table, clipped_from}, weights, s.count, to);
      else
        sum_wide_lanes(
            {first + 2 * s.begin, quad_stride, rows / 2, static_cast<std::uint16_t>(layout.full_scale()), clipped_from},
            weights, s.count, to);
    }
    return;
  }
  for (std::size_t done = 0; done < s.count; done += kCodeChunk) {
    const std::size_t count = std::min(kCodeChunk, std::max(s.count - done, kMinLanes));
    const std::size_t within = std::min(done, s.count - count), at = s.begin + within;
    const auto plane = [&](int y) {
      constexpr std::size_t kPlaneStride = kMaxRows * kCodeChunk;
      std::uint8_t* r = planes_.data() + static_cast<std::size_t>(y) * kCodeChunk;
      return PlaneRow{r, r + kPlaneStride, r + 2 * kPlaneStride};
    };
    const auto line = [&](int y) { return row_of(view, top + sampled.row(y)); };
    if (view.format == PixelFormat::yuyv) {
      for (int y = 0; y < rows; ++y) planes_of_yuyv(line(y) + 2 * at, count, plane(y));
    } else {
      for (int y = 0; y < rows; y += 2) {
        // Blocks begin at even rows; with an odd height, the last row does not share its chroma.
        const int below = std::min(y + 1, rows - 1);
        planes_of_nv12(line(y) + at, line(below) + at, row_of(view, view.height + (top + sampled.row(y)) / 2) + at,
                       count, plane(y), plane(below));
      }
    }
    for (std::size_t c = 0; c < 3; ++c)
      sum_lanes({planes_.data() + c * kMaxRows * kCodeChunk, kCodeChunk, rows, table, clipped_from},
                weights_at(at, 0, 1), count, groups_[c].at(at));
  }
}

template <Lanes lanes>
void CodePass::gather_codes(const LensPlan& plan, int rows, std::size_t begin, std::size_t columns, std::size_t blocks,
                            unsigned clipped_from) {
  constexpr std::size_t channels = lanes == Lanes::interleaved ? 3 : lanes == Lanes::mosaic ? 2 : 1;
  const auto sum_rows = static_cast<float>(lanes == Lanes::mosaic ? rows / 2 : rows);
  // Sums are below 2^31; SIMD converts signed integers to floats.
  const auto number = [](std::uint32_t v) { return static_cast<float>(static_cast<std::int32_t>(v)); };
  struct Sums {
    float sum, across, down;
  };
  const auto sums_at = [&](std::size_t g, std::size_t at) {
    const Scratch& group = groups_[g];
    const float sum = number(group.sum[at]);
    return Sums{sum, number(group.across[at]), sum_rows * sum - number(group.early[at])};
  };
  const auto linear = [&](std::uint16_t code) { return static_cast<float>(plan.linear ? code : plan.linear16[code]); };
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
      // Converts positions of quads to positions of pixels. Each sample represents its quad; there are two of green.
      const auto of_pixels = [&](std::size_t q) {
        const Sums s = sums_at(q / 2, at + q % 2);
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
        put(c, b, sums_at(g, at + own), 1);
        const std::uint16_t top = groups_[g].peak[at + own];
        codes_.top[c][b] = linear(top);
        if (top >= clipped_from) codes_.clipped[b] = std::max(codes_.clipped[b], clipped(g, b, own));
      }
    }
  }
}

void CodePass::finish_strip(const Strip& strip, float radiance_per_linear, BlockSums& out) {
  const auto& [view, plan, top, rows, sampled, run, range] = strip;
  const Lanes lanes = lanes_of(view.format);
  const auto edge = static_cast<std::size_t>(layout_.edge()), first = static_cast<std::size_t>(range.first);
  const std::size_t blocks = static_cast<std::size_t>(range.end) - first;
  const std::size_t row_lanes = static_cast<std::size_t>(view.width) * (lanes == Lanes::interleaved ? 3 : 1);
  const std::size_t per_block = edge * (lanes == Lanes::interleaved ? 3 : 1);
  const std::size_t group_count = lanes == Lanes::interleaved ? 1 : lanes == Lanes::mosaic ? 2 : 3;
  const std::size_t channels = lanes == Lanes::interleaved ? 3 : lanes == Lanes::mosaic ? 2 : 1;
  const std::size_t begin = first * per_block, end = begin + blocks * per_block, columns = per_block / channels;
  for (std::size_t g = 0; g < group_count; ++g) {
    Scratch& group = groups_[g];
    // Clears the lanes beyond the image: the last block of a row may be narrower.
    for (std::size_t lane = row_lanes; lane < end; ++lane)
      group.sum[lane] = group.early[lane] = group.peak[lane] = group.clipped[lane] = 0;
    sum_blocks(group.at(begin), static_cast<int>(channels), static_cast<int>(columns), blocks,
               group.across.data() + begin);
  }

  const PixelLayout& layout = pixel_layout(view.format);
  const bool words = layout.sample_bytes == 2;
  const auto top_code = static_cast<float>(layout.full_scale());
  const unsigned clipped_from = plan.clipped_from[layout.depth_index()];
  switch (lanes) {
    case Lanes::interleaved:
      gather_codes<Lanes::interleaved>(plan, rows, begin, columns, blocks, clipped_from);
      break;
    case Lanes::planar:
      gather_codes<Lanes::planar>(plan, rows, begin, columns, blocks, clipped_from);
      break;
    case Lanes::mosaic:
      gather_codes<Lanes::mosaic>(plan, rows, begin, columns, blocks, clipped_from);
      break;
  }

  BlockRun in = plan.run;
  in.weighted = run.weighted;
  in.plain_unit = plan.linear_unit / (plan.linear ? top_code : 65535);
  in.unit = !run.weighted ? in.plain_unit : plan.linear ? in.plain_unit / (words ? 16 : 257) : in.plain_unit;
  // Mean truncation error of the products with weights, whose fraction of four or eight bits is cut off.
  in.cut_off = words ? 0.469F : 0.498F;
  in.half_y = 0.5F * static_cast<float>(rows - 1);
  if (!sampled.all()) {
    const RowStatistics read = statistics_of(sampled, layout_.edge());
    in.row_step = static_cast<float>(read.spacing);
    in.row_shift = static_cast<float>(read.mean - 0.5 * (layout_.edge() - 1));
    in.share = static_cast<float>(rows) / static_cast<float>(layout_.edge());
  }
  in.radiance = radiance_per_linear;
  const std::size_t block = layout_.block_of(view.lens, static_cast<int>(first * edge), top);
  const BlockErrorSums errors =
      convert_block_sums(in, weights_.block_weights(block, lanes), codes_.at_first(), blocks,
                         {&out.sum[block], &out.peak[block], &out.offset_x[block], &out.offset_y[block],
                          &out.clipped[block], &out.block_noise[block], &out.block_bias[block]});
  out.noise += errors.noise;
  out.bias += errors.bias;
  out.clipped_sr += errors.clipped_sr;
}

}  // namespace lightwell::estimate
