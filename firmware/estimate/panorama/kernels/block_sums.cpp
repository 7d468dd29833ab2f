#include "estimate/panorama/kernels/block_sums.hpp"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "estimate/panorama/kernels/block_sums.cpp"
#include <hwy/foreach_target.h>
// Highway requires this include after foreach_target.h.
#include <hwy/highway.h>

#include "estimate/panorama/kernels/strips_inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace lightwell::estimate {
namespace HWY_NAMESPACE {

#if HWY_TARGET <= HWY_AVX3 && HWY_ARCH_X86
// Adds adjacent columns pairwise until a block is one column. Each step selects the even and the odd columns of two
// vectors. 15 lanes (30 of 16 bits) hold whole columns of 3 channels, 16 (32) of 1 and of 2. All steps of one vector of
// blocks are done in registers.
struct FoldTables {
  alignas(64) std::uint32_t even32[16]{}, odd32[16]{};
  alignas(64) std::uint16_t even16[32]{}, odd16[32]{};
  std::size_t step32, step16;

  constexpr explicit FoldTables(std::size_t channels) : step32(channels == 3 ? 15 : 16), step16(2 * step32) {
    // Lanes from `step` on are in the second vector.
    const auto place = [](std::size_t lane, std::size_t step, std::size_t width) {
      return (lane < step ? lane : lane - step + width) % (2 * width);
    };
    for (std::size_t i = 0; i < 32; ++i) {
      const std::size_t even = 2 * (i / channels) * channels + i % channels, odd = even + channels;
      even16[i] = static_cast<std::uint16_t>(place(even, step16, 32));
      odd16[i] = static_cast<std::uint16_t>(place(odd, step16, 32));
      if (i >= 16) continue;
      even32[i] = static_cast<std::uint32_t>(place(even, step32, 16));
      odd32[i] = static_cast<std::uint32_t>(place(odd, step32, 16));
    }
  }
};
constexpr FoldTables kFoldTables[] = {FoldTables(1), FoldTables(2), FoldTables(3)};

struct Fold {
  std::size_t step32, step16;
  __m512i even32, odd32, even16, odd16;

  explicit Fold(const FoldTables& t)
      : step32(t.step32),
        step16(t.step16),
        even32(_mm512_load_si512(t.even32)),
        odd32(_mm512_load_si512(t.odd32)),
        even16(_mm512_load_si512(t.even16)),
        odd16(_mm512_load_si512(t.odd16)) {}
};

struct Folded {
  __m512i sum, early, across;
};

/// A vector of columns after kSteps steps (2^kSteps original columns each), from lane `at` on.
template <int kSteps>
HWY_INLINE Folded folded(const Fold& fold, const LaneSums& lanes, std::size_t at) {
  if constexpr (kSteps == 0) {
    return {_mm512_loadu_si512(lanes.sum + at), _mm512_loadu_si512(lanes.early + at), _mm512_setzero_si512()};
  } else {
    const Folded a = folded<kSteps - 1>(fold, lanes, 2 * at), b = folded<kSteps - 1>(fold, lanes, 2 * at + fold.step32);
    const __m512i odd = _mm512_permutex2var_epi32(a.sum, fold.odd32, b.sum);
    const auto both = [&](__m512i first, __m512i second) HWY_ATTR {
      return _mm512_add_epi32(_mm512_permutex2var_epi32(first, fold.even32, second),
                              _mm512_permutex2var_epi32(first, fold.odd32, second));
    };
    // Columns within the odd one are 2^(kSteps - 1) original columns farther.
    const __m512i moved = _mm512_slli_epi32(odd, kSteps - 1);
    return {_mm512_add_epi32(_mm512_permutex2var_epi32(a.sum, fold.even32, b.sum), odd), both(a.early, b.early),
            kSteps == 1 ? moved : _mm512_add_epi32(moved, both(a.across, b.across))};
  }
}

template <int kSteps>
HWY_INLINE __m512i folded_peak(const Fold& fold, const std::uint16_t* peak, std::size_t at) {
  if constexpr (kSteps == 0) {
    return _mm512_loadu_si512(peak + at);
  } else {
    const __m512i a = folded_peak<kSteps - 1>(fold, peak, 2 * at);
    const __m512i b = folded_peak<kSteps - 1>(fold, peak, 2 * at + fold.step16);
    return _mm512_max_epu16(_mm512_permutex2var_epi16(a, fold.even16, b), _mm512_permutex2var_epi16(a, fold.odd16, b));
  }
}

template <int kSteps>
void SumBlocksOf(const LaneSums& lanes, std::size_t channels, std::size_t blocks, std::uint32_t* across) {
  const Fold fold(kFoldTables[channels - 1]);
  const std::size_t count = blocks * channels;
  for (std::size_t at = 0; at < count; at += fold.step32) {
    const Folded f = folded<kSteps>(fold, lanes, at);
    _mm512_storeu_si512(lanes.sum + at, f.sum);
    _mm512_storeu_si512(lanes.early + at, f.early);
    _mm512_storeu_si512(across + at, f.across);
  }
  for (std::size_t at = 0; at < count; at += fold.step16)
    _mm512_storeu_si512(lanes.peak + at, folded_peak<kSteps>(fold, lanes.peak, at));
}

void SumBlocks(const LaneSums& lanes, int channels, int edge, std::size_t blocks, std::uint32_t* across) {
  const auto count = static_cast<std::size_t>(channels);
  switch (edge) {
    case 16:
      return SumBlocksOf<4>(lanes, count, blocks, across);
    case 8:
      return SumBlocksOf<3>(lanes, count, blocks, across);
    case 4:
      return SumBlocksOf<2>(lanes, count, blocks, across);
    case 2:
      return SumBlocksOf<1>(lanes, count, blocks, across);
    default:
      return SumBlocksOf<0>(lanes, count, blocks, across);
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
