#include <algorithm>

#include "estimate/panorama/kernels/lane_sums.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "estimate/panorama/kernels/block_light.cpp"
#include <hwy/foreach_target.h>
// Highway requires this include after foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lightwell::estimate {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <int kChannels, class D>
HWY_INLINE void load_channels(D d, const hn::TFromD<D>* from, hn::Vec<D> (&out)[kChannels]) {
  if constexpr (kChannels == 3)
    hn::LoadInterleaved3(d, from, out[0], out[1], out[2]);
  else if constexpr (kChannels == 2)
    hn::LoadInterleaved2(d, from, out[0], out[1]);
  else
    out[0] = hn::LoadU(d, from);
}

template <int kEdge, int kChannels>
void SumBlocksOf(const LaneSums& lanes, std::size_t blocks, std::uint32_t* across_out) {
  const hn::CappedTag<std::uint32_t, kEdge> d32;
  const hn::CappedTag<std::uint16_t, kEdge> d16;
  for (std::size_t block = 0; block < blocks; ++block) {
    hn::Vec<decltype(d32)> sum[kChannels], early[kChannels], across[kChannels], part[kChannels], part_early[kChannels];
    hn::Vec<decltype(d16)> peak[kChannels], part_peak[kChannels];
    for (std::size_t c = 0; c < kChannels; ++c) {
      sum[c] = early[c] = across[c] = hn::Zero(d32);
      peak[c] = hn::Zero(d16);
    }
    const std::size_t first = block * kEdge;
    for (std::size_t i = 0; i < kEdge; i += hn::Lanes(d32)) {
      load_channels<kChannels>(d32, lanes.sum + (first + i) * kChannels, part);
      load_channels<kChannels>(d32, lanes.early + (first + i) * kChannels, part_early);
      const auto column = hn::Iota(d32, static_cast<std::uint32_t>(i));
      for (std::size_t c = 0; c < kChannels; ++c) {
        sum[c] = hn::Add(sum[c], part[c]);
        early[c] = hn::Add(early[c], part_early[c]);
        across[c] = hn::Add(across[c], hn::Mul(part[c], column));
      }
    }
    for (std::size_t i = 0; i < kEdge; i += hn::Lanes(d16)) {
      load_channels<kChannels>(d16, lanes.peak + (first + i) * kChannels, part_peak);
      for (std::size_t c = 0; c < kChannels; ++c) peak[c] = hn::Max(peak[c], part_peak[c]);
    }
    for (std::size_t c = 0; c < kChannels; ++c) {
      const std::size_t at = block * kChannels + c;
      lanes.sum[at] = hn::GetLane(hn::SumOfLanes(d32, sum[c]));
      lanes.early[at] = hn::GetLane(hn::SumOfLanes(d32, early[c]));
      lanes.peak[at] = hn::GetLane(hn::MaxOfLanes(d16, peak[c]));
      across_out[at] = hn::GetLane(hn::SumOfLanes(d32, across[c]));
    }
  }
}

template <int kEdge>
void SumBlocksOf(const LaneSums& lanes, int channels, std::size_t blocks, std::uint32_t* across) {
  if (channels == 3)
    SumBlocksOf<kEdge, 3>(lanes, blocks, across);
  else if (channels == 2)
    SumBlocksOf<kEdge, 2>(lanes, blocks, across);
  else
    SumBlocksOf<kEdge, 1>(lanes, blocks, across);
}

/// For blocks that are too narrow for a vector.
void SumNarrowBlocks(const LaneSums& lanes, std::size_t channels, std::size_t edge, std::size_t blocks,
                     std::uint32_t* across_out) {
  for (std::size_t block = 0; block < blocks; ++block) {
    for (std::size_t c = 0; c < channels; ++c) {
      std::uint32_t sum = 0, across = 0, early = 0;
      std::uint16_t peak = 0;
      for (std::size_t i = 0; i < edge; ++i) {
        const std::size_t lane = (block * edge + i) * channels + c;
        sum += lanes.sum[lane];
        across += static_cast<std::uint32_t>(i) * lanes.sum[lane];
        early += lanes.early[lane];
        peak = std::max(peak, lanes.peak[lane]);
      }
      const std::size_t at = block * channels + c;
      lanes.sum[at] = sum;
      lanes.early[at] = early;
      lanes.peak[at] = peak;
      across_out[at] = across;
    }
  }
}

void SumBlocks(const LaneSums& lanes, int channels, int edge, std::size_t blocks, std::uint32_t* across) {
  if (edge == 16)
    SumBlocksOf<16>(lanes, channels, blocks, across);
  else if (edge == 8)
    SumBlocksOf<8>(lanes, channels, blocks, across);
  else
    SumNarrowBlocks(lanes, static_cast<std::size_t>(channels), static_cast<std::size_t>(edge), blocks, across);
}

using D = hn::CappedTag<float, 16>;
using V = hn::Vec<D>;

/// near_black_bias() of row_reader.hpp.
HWY_INLINE V near_black_bias(D d, V value, V step, float cut_noise) {
  const V noise = hn::Set(d, cut_noise), zero = hn::Zero(d);
  const auto coarse = hn::And(hn::Lt(value, hn::Mul(hn::Set(d, 4.0F), step)), hn::Lt(noise, step));
  const V rounding = hn::IfThenElse(coarse, hn::Mul(hn::Set(d, 0.5F), step), zero);
  const V cut = hn::IfThenElse(hn::Lt(value, hn::Set(d, 2 * cut_noise)), hn::Set(d, 0.4F * cut_noise), zero);
  return hn::Add(rounding, cut);
}

template <bool kWeighted>
BlockErrorSums LightOf(const BlockRun& run, const BlockWeights& weights, const BlockCodes& codes, std::size_t blocks,
                       const BlockLight& out) {
  const D d;
  const hn::Rebind<std::int32_t, D> di;
  const std::size_t lanes = hn::Lanes(d);
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0F), unit = hn::Set(d, run.unit),
          plain_unit = hn::Set(d, run.plain_unit);
  const V from = hn::Set(d, run.linear_from), radiance = hn::Set(d, run.radiance), half_y = hn::Set(d, run.half_y);
  const V radiance2 = hn::Mul(radiance, radiance), share = hn::Set(d, run.share), per_share = hn::Set(d, 1 / run.share);
  V noise = zero, bias = zero, clipped_sr = zero;
  for (std::size_t b = 0; b < blocks; b += lanes) {
    const auto load = [&](const float* p) HWY_ATTR { return hn::LoadU(d, p + b); };
    const V pixels = hn::Mul(share, load(weights.pixels)), total = hn::Mul(share, load(weights.total)),
            inverse_vignetting = load(weights.inverse_vignetting);
    const V per_pixel = hn::Mul(per_share, load(weights.per_pixel));
    V light[3], mean[3], sum = zero, across = zero, down = zero, brightest = zero;
    for (std::size_t c = 0; c < 3; ++c) {
      const V s = load(codes.sum[c]), x = load(codes.across[c]), y = load(codes.down[c]);
      const V weight = hn::Set(d, run.luminance[c]);
      V own_across, own_down, own;
      if constexpr (kWeighted) {
        const V value_per_unit = hn::Mul(unit, load(weights.unit));
        light[c] = hn::MulAdd(value_per_unit, hn::MulAdd(hn::Set(d, run.cut_off), pixels, s), hn::Mul(from, total));
        mean[c] = hn::Mul(light[c], load(weights.per_total));
        own = light[c];
        own_across = hn::Mul(value_per_unit, hn::NegMulAdd(load(weights.middle_x), s, x));
        own_down = hn::Mul(value_per_unit, hn::NegMulAdd(load(weights.middle_y), s, y));
      } else {
        own = hn::MulAdd(unit, s, hn::Mul(from, pixels));
        own_across = hn::Mul(unit, hn::NegMulAdd(load(weights.half_x), s, x));
        own_down = hn::MulAdd(hn::Set(d, run.row_shift), own,
                              hn::Mul(hn::Set(d, run.unit * run.row_step), hn::NegMulAdd(half_y, s, y)));
        light[c] = hn::MulAdd(load(weights.mean), own,
                              hn::MulAdd(load(weights.along_x), own_across, hn::Mul(load(weights.along_y), own_down)));
        mean[c] = hn::Mul(own, per_pixel);
      }
      sum = hn::MulAdd(weight, own, sum);
      across = hn::MulAdd(weight, own_across, across);
      down = hn::MulAdd(weight, own_down, down);
      brightest = hn::MulAdd(weight, hn::MulAdd(load(codes.top[c]), plain_unit, from), brightest);
      light[c] = hn::Mul(light[c], hn::Set(d, run.radiance * run.white[c]));
    }
    const V per_sum = hn::IfThenElseZero(hn::Gt(sum, zero), hn::Div(one, sum));
    const V peak = hn::Max(hn::Mul(brightest, hn::Mul(inverse_vignetting, radiance)), zero);
    V step = plain_unit;
    if (run.step != nullptr) {
      const V largest = hn::Min(hn::Max(hn::Max(hn::Max(mean[0], mean[1]), mean[2]), zero), one);
      step = hn::GatherIndex(d, run.step, hn::ConvertTo(di, hn::Mul(largest, hn::Set(d, 4095.0F))));
    }
    const V variance = hn::Add(hn::MulAdd(hn::Set(d, run.shot), hn::Max(mean[1], zero), hn::Set(d, run.read2)),
                               hn::Mul(hn::Mul(step, step), hn::Set(d, 1.0F / 12)));
    const V clipped =
        hn::Mul(hn::Mul(share, load(weights.solid_angle)), hn::Min(one, hn::Mul(load(codes.clipped), per_pixel)));

    // Masks the lanes beyond the last block.
    const std::size_t left = blocks - b;
    const auto valid = hn::FirstN(d, left);
    const V own_noise = hn::Mul(hn::Mul(hn::Mul(share, load(weights.spread)), variance), radiance2);
    const V own_bias = hn::Mul(hn::Mul(total, near_black_bias(d, mean[1], step, run.cut_noise)), radiance);
    noise = hn::Add(noise, hn::IfThenElseZero(valid, own_noise));
    bias = hn::Add(bias, hn::IfThenElseZero(valid, own_bias));
    clipped_sr = hn::Add(clipped_sr, hn::IfThenElseZero(valid, clipped));
    const V offset_x = hn::Mul(across, per_sum), offset_y = hn::Mul(down, per_sum);
    constexpr std::size_t kOutputs = 6;
    float* to[kOutputs] = {out.peak + b,    out.offset_x + b, out.offset_y + b,
                           out.clipped + b, out.noise + b,    out.bias + b};
    const V values[kOutputs] = {peak, offset_x, offset_y, clipped, own_noise, own_bias};
    if (left >= lanes) {
      hn::StoreInterleaved3(light[0], light[1], light[2], d, &out.light[b].r);
      for (std::size_t k = 0; k < kOutputs; ++k) hn::StoreU(values[k], d, to[k]);
    } else {
      alignas(64) float last[kOutputs][16];
      for (std::size_t c = 0; c < 3; ++c) hn::Store(light[c], d, last[c]);
      for (std::size_t i = 0; i < left; ++i) out.light[b + i] = {last[0][i], last[1][i], last[2][i]};
      for (std::size_t k = 0; k < kOutputs; ++k) hn::Store(values[k], d, last[k]);
      for (std::size_t k = 0; k < kOutputs; ++k)
        for (std::size_t i = 0; i < left; ++i) to[k][i] = last[k][i];
    }
  }
  const auto total_of = [&](V v) HWY_ATTR { return static_cast<double>(hn::GetLane(hn::SumOfLanes(d, v))); };
  return {total_of(noise), total_of(bias), total_of(clipped_sr)};
}

BlockErrorSums LightOfBlocks(const BlockRun& run, const BlockWeights& weights, const BlockCodes& codes,
                             std::size_t blocks, const BlockLight& out) {
  return run.weighted ? LightOf<true>(run, weights, codes, blocks, out)
                      : LightOf<false>(run, weights, codes, blocks, out);
}

}  // namespace HWY_NAMESPACE
}  // namespace lightwell::estimate
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lightwell::estimate {

HWY_EXPORT(SumBlocks);
HWY_EXPORT(LightOfBlocks);

void sum_blocks(const LaneSums& lanes, int channels, int edge, std::size_t blocks, std::uint32_t* across) {
  HWY_DYNAMIC_DISPATCH(SumBlocks)(lanes, channels, edge, blocks, across);
}

BlockErrorSums convert_block_sums(const BlockRun& run, const BlockWeights& weights, const BlockCodes& codes,
                                  std::size_t blocks, const BlockLight& out) {
  return HWY_DYNAMIC_DISPATCH(LightOfBlocks)(run, weights, codes, blocks, out);
}

}  // namespace lightwell::estimate
#endif  // HWY_ONCE
