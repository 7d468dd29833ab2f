#include "estimate/panorama/kernels/block_sums.hpp"

#include <algorithm>
#include <bit>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "estimate/panorama/kernels/block_sums.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, says Highway.
#include <hwy/highway.h>
#include "estimate/panorama/kernels/strips_inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace lightwell::estimate {
namespace HWY_NAMESPACE {

#if HWY_TARGET <= HWY_AVX3 && HWY_ARCH_X86
// Neighbouring columns are added, and again, until a block is one column. Each step picks the even and the odd columns out
// of two vectors; 15 lanes (30 of 16 bits) at a time hold whole columns of 1 and of 3 channels, 16 (32) of 1 and of 2.
struct Fold {
  std::size_t step32, step16;
  __m512i even32, odd32, even16, odd16;

  explicit Fold(std::size_t channels) : step32(channels == 3 ? 15 : 16), step16(2 * step32) {
    alignas(64) std::uint32_t e32[16], o32[16];
    alignas(64) std::uint16_t e16[32], o16[32];
    for (std::size_t i = 0; i < 16; ++i) {
      const std::size_t column = 2 * (i / channels), channel = i % channels;
      e32[i] = static_cast<std::uint32_t>(column * channels + channel) & 31;
      o32[i] = static_cast<std::uint32_t>((column + 1) * channels + channel) & 31;
    }
    for (std::size_t i = 0; i < 32; ++i) {
      const std::size_t column = 2 * (i / channels), channel = i % channels;
      e16[i] = static_cast<std::uint16_t>((column * channels + channel) & 63);
      o16[i] = static_cast<std::uint16_t>(((column + 1) * channels + channel) & 63);
    }
    even32 = _mm512_load_si512(e32);
    odd32 = _mm512_load_si512(o32);
    even16 = _mm512_load_si512(e16);
    odd16 = _mm512_load_si512(o16);
  }
};

void SumBlocks(const LaneSums& lanes, int channels, int edge, std::size_t blocks, std::uint32_t* across) {
  const Fold fold(static_cast<std::size_t>(channels));
  std::size_t left = blocks * static_cast<std::size_t>(edge) * static_cast<std::size_t>(channels);
  if (edge == 1) std::fill_n(across, left, 0U);
  for (int width = 1; width < edge; width *= 2) {
    left /= 2;
    const __m128i shift = _mm_cvtsi32_si128(std::countr_zero(static_cast<unsigned>(width)));
    for (std::size_t to = 0; to < left; to += fold.step32) {
      const std::size_t from = 2 * to;
      const auto part = [&](const std::uint32_t* p, __m512i which) HWY_ATTR {
        return _mm512_permutex2var_epi32(_mm512_loadu_si512(p + from), which, _mm512_loadu_si512(p + from + 16));
      };
      const __m512i even = part(lanes.sum, fold.even32), odd = part(lanes.sum, fold.odd32);
      const __m512i early = _mm512_add_epi32(part(lanes.early, fold.even32), part(lanes.early, fold.odd32));
      __m512i moved = _mm512_sll_epi32(odd, shift);
      if (width > 1)
        moved = _mm512_add_epi32(moved, _mm512_add_epi32(part(across, fold.even32), part(across, fold.odd32)));
      _mm512_storeu_si512(lanes.sum + to, _mm512_add_epi32(even, odd));
      _mm512_storeu_si512(lanes.early + to, early);
      _mm512_storeu_si512(across + to, moved);
    }
    for (std::size_t to = 0; to < left; to += fold.step16) {
      const __m512i low = _mm512_loadu_si512(lanes.peak + 2 * to), high = _mm512_loadu_si512(lanes.peak + 2 * to + 32);
      _mm512_storeu_si512(lanes.peak + to, _mm512_max_epu16(_mm512_permutex2var_epi16(low, fold.even16, high),
                                                            _mm512_permutex2var_epi16(low, fold.odd16, high)));
    }
  }
}
#else
template <class D>
HWY_INLINE void load_channels(D d, int channels, const hn::TFromD<D>* from, hn::Vec<D> (&out)[3]) {
  if (channels == 3)
    hn::LoadInterleaved3(d, from, out[0], out[1], out[2]);
  else if (channels == 2)
    hn::LoadInterleaved2(d, from, out[0], out[1]);
  else
    out[0] = hn::LoadU(d, from);
}

template <int kEdge>
void SumBlocksOf(const LaneSums& lanes, int channels, std::size_t blocks, std::uint32_t* across_out) {
  const hn::CappedTag<std::uint32_t, kEdge> d32;
  const hn::CappedTag<std::uint16_t, kEdge> d16;
  const auto count = static_cast<std::size_t>(channels);
  for (std::size_t block = 0; block < blocks; ++block) {
    hn::Vec<decltype(d32)> sum[3], early[3], across[3], part[3], part_early[3];
    hn::Vec<decltype(d16)> peak[3], part_peak[3];
    for (std::size_t c = 0; c < count; ++c) {
      sum[c] = early[c] = across[c] = hn::Zero(d32);
      peak[c] = hn::Zero(d16);
    }
    const std::size_t first = block * kEdge;
    for (std::size_t i = 0; i < kEdge; i += hn::Lanes(d32)) {
      load_channels(d32, channels, lanes.sum + (first + i) * count, part);
      load_channels(d32, channels, lanes.early + (first + i) * count, part_early);
      const auto column = hn::Iota(d32, static_cast<std::uint32_t>(i));
      for (std::size_t c = 0; c < count; ++c) {
        sum[c] = hn::Add(sum[c], part[c]);
        early[c] = hn::Add(early[c], part_early[c]);
        across[c] = hn::Add(across[c], hn::Mul(part[c], column));
      }
    }
    for (std::size_t i = 0; i < kEdge; i += hn::Lanes(d16)) {
      load_channels(d16, channels, lanes.peak + (first + i) * count, part_peak);
      for (std::size_t c = 0; c < count; ++c) peak[c] = hn::Max(peak[c], part_peak[c]);
    }
    for (std::size_t c = 0; c < count; ++c) {
      const std::size_t at = block * count + c;
      lanes.sum[at] = hn::GetLane(hn::SumOfLanes(d32, sum[c]));
      lanes.early[at] = hn::GetLane(hn::SumOfLanes(d32, early[c]));
      lanes.peak[at] = hn::GetLane(hn::MaxOfLanes(d16, peak[c]));
      across_out[at] = hn::GetLane(hn::SumOfLanes(d32, across[c]));
    }
  }
}

/// Too narrow for a vector.
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
#endif

}  // namespace HWY_NAMESPACE
}  // namespace lightwell::estimate
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lightwell::estimate {

HWY_EXPORT(SumBlocks);

void sum_blocks(const LaneSums& lanes, int channels, int edge, std::size_t blocks, std::uint32_t* across) {
  HWY_DYNAMIC_DISPATCH(SumBlocks)(lanes, channels, edge, blocks, across);
}

}  // namespace lightwell::estimate
#endif  // HWY_ONCE
