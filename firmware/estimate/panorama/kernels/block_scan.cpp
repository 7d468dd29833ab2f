#include "estimate/panorama/kernels/block_scan.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "estimate/panorama/kernels/block_scan.cpp"
#include <hwy/foreach_target.h>
// Highway requires this include after foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lightwell::estimate {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Sum of the low and the high words of 32-bit elements.
template <class D32>
HWY_INLINE hn::Vec<D32> sum_of_words(D32 d, hn::Vec<D32> pairs) {
  return hn::Add(hn::And(pairs, hn::Set(d, 0xFFFF)), hn::ShiftRight<16>(pairs));
}

template <class D32>
HWY_INLINE std::uint32_t total(D32 d, hn::Vec<D32> v) {
  return hn::GetLane(hn::SumOfLanes(d, v));
}

// Sums over the rows of a block, of whole vectors of a row.

/// Bytes, in words of 16 bits: 16 rows of three vectors fit.
template <std::size_t kBytes>
struct ByteSums {
  static constexpr std::size_t kAtOnce = kBytes;
  using D8 = hn::CappedTag<std::uint8_t, kBytes>;
  using DHalf = hn::Half<D8>;
  using D16 = hn::Rebind<std::uint16_t, DHalf>;
  using D32 = hn::RepartitionToWide<D16>;
  using V8 = hn::Vec<D8>;
  using V16 = hn::Vec<D16>;
  V16 all_lower, all_upper, read_lower, read_upper;
  V8 largest;

  HWY_INLINE ByteSums() {
    all_lower = all_upper = read_lower = read_upper = hn::Zero(D16());
    largest = hn::Zero(D8());
  }
  static HWY_INLINE V16 lower(V8 v) { return hn::PromoteTo(D16(), hn::LowerHalf(DHalf(), v)); }
  static HWY_INLINE V16 upper(V8 v) { return hn::PromoteTo(D16(), hn::UpperHalf(DHalf(), v)); }
  HWY_INLINE void add(const std::uint8_t* row, const std::uint8_t* next) {
    const V8 a = hn::LoadU(D8(), row), b = hn::LoadU(D8(), next);
    largest = hn::Max(largest, hn::Max(a, b));
    all_lower = hn::Add(all_lower, hn::Add(lower(a), lower(b)));
    all_upper = hn::Add(all_upper, hn::Add(upper(a), upper(b)));
  }
  HWY_INLINE void add_read(const std::uint8_t* row) {
    const V8 v = hn::LoadU(D8(), row);
    read_lower = hn::Add(read_lower, lower(v));
    read_upper = hn::Add(read_upper, upper(v));
  }
  HWY_INLINE BlockScan fold() const {
    const D32 d;
    return {total(d, sum_of_words(d, hn::BitCast(d, hn::Add(all_lower, all_upper)))),
            total(d, sum_of_words(d, hn::BitCast(d, hn::Add(read_lower, read_upper)))),
            hn::GetLane(hn::MaxOfLanes(D8(), largest)), 0};
  }
};

/// Luma in the low bytes, in words of 16 bits; of the high bytes, the largest.
struct YuyvSums {
  static constexpr std::size_t kAtOnce = 16;
  using D16 = hn::CappedTag<std::uint16_t, 8>;
  using D32 = hn::RepartitionToWide<D16>;
  using V16 = hn::Vec<D16>;
  V16 all, read, largest, chroma;

  HWY_INLINE YuyvSums() { all = read = largest = chroma = hn::Zero(D16()); }
  static HWY_INLINE V16 words(const std::uint8_t* at) {
    return hn::BitCast(D16(), hn::LoadU(hn::Repartition<std::uint8_t, D16>(), at));
  }
  static HWY_INLINE V16 luma(V16 words) { return hn::And(words, hn::Set(D16(), 0xFF)); }
  HWY_INLINE void add(const std::uint8_t* row, const std::uint8_t* next) {
    const V16 a = words(row), b = words(next), v = luma(a), w = luma(b);
    largest = hn::Max(largest, hn::Max(v, w));
    all = hn::Add(all, hn::Add(v, w));
    // The high byte decides which word is the largest.
    chroma = hn::Max(chroma, hn::Max(a, b));
  }
  HWY_INLINE void add_read(const std::uint8_t* at) { read = hn::Add(read, luma(words(at))); }
  HWY_INLINE BlockScan fold() const {
    const D32 d;
    return {total(d, sum_of_words(d, hn::BitCast(d, all))), total(d, sum_of_words(d, hn::BitCast(d, read))),
            hn::GetLane(hn::MaxOfLanes(D16(), largest)),
            static_cast<std::uint32_t>(hn::GetLane(hn::MaxOfLanes(D16(), chroma))) >> 8U};
  }
};

/// Words, in 32 bits.
struct WordSums {
  static constexpr std::size_t kAtOnce = 16;
  using D16 = hn::CappedTag<std::uint16_t, 8>;
  using D32 = hn::RepartitionToWide<D16>;
  hn::Vec<D32> all, read;
  hn::Vec<D16> largest, mask;

  HWY_INLINE explicit WordSums(std::uint16_t bits) {
    all = read = hn::Zero(D32());
    largest = hn::Zero(D16());
    mask = hn::Set(D16(), bits);
  }
  HWY_INLINE hn::Vec<D16> sample(const std::uint8_t* at) const {
    return hn::And(hn::BitCast(D16(), hn::LoadU(hn::Repartition<std::uint8_t, D16>(), at)), mask);
  }
  HWY_INLINE void add(const std::uint8_t* row, const std::uint8_t* next) {
    const hn::Vec<D16> a = sample(row), b = sample(next);
    largest = hn::Max(largest, hn::Max(a, b));
    // Two samples of 12 bits fit into 16.
    all = hn::Add(all, sum_of_words(D32(), hn::BitCast(D32(), hn::Add(a, b))));
  }
  HWY_INLINE void add_read(const std::uint8_t* at) {
    read = hn::Add(read, sum_of_words(D32(), hn::BitCast(D32(), sample(at))));
  }
  HWY_INLINE BlockScan fold() const {
    return {total(D32(), all), total(D32(), read), hn::GetLane(hn::MaxOfLanes(D16(), largest)), 0};
  }
};

template <class Sums>
HWY_INLINE BlockScan Scan(const BlockSamples& block, const SampledRows& rows, Sums sums) {
  const std::size_t stride = block.stride, step = static_cast<std::size_t>(rows.step) * stride;
  for (std::size_t at = 0; at < block.bytes; at += Sums::kAtOnce) {
    const std::uint8_t* row = block.first + at;
    for (int y = 0; y < block.rows; y += 4, row += 4 * stride) {
      sums.add(row, row + stride);
      sums.add(row + 2 * stride, row + 3 * stride);
    }
    const std::uint8_t* read = block.first + static_cast<std::size_t>(rows.offset) * stride + at;
    for (int k = 0; k < rows.units; ++k, read += step) {
      sums.add_read(read);
      if (rows.unit == 2) sums.add_read(read + stride);
    }
  }
  return sums.fold();
}

BlockScan ScanBytes(const BlockSamples& block, const SampledRows& rows) {
  return block.bytes % 16 == 0 ? Scan(block, rows, ByteSums<16>()) : Scan(block, rows, ByteSums<8>());
}

BlockScan ScanWords(const BlockSamples& block, const SampledRows& rows, std::uint16_t mask) {
  return Scan(block, rows, WordSums(mask));
}

template <std::size_t kBytes>
HWY_INLINE std::uint32_t Largest(const BlockSamples& block) {
  const hn::CappedTag<std::uint8_t, kBytes> d;
  hn::Vec<decltype(d)> largest = hn::Zero(d);
  for (std::size_t at = 0; at < block.bytes; at += kBytes) {
    const std::uint8_t* row = block.first + at;
    for (int y = 0; y < block.rows; y += 4, row += 4 * block.stride)
      for (std::size_t k = 0; k < 4; ++k) largest = hn::Max(largest, hn::LoadU(d, row + k * block.stride));
  }
  return hn::GetLane(hn::MaxOfLanes(d, largest));
}

std::uint32_t LargestByte(const BlockSamples& block) {
  return block.bytes % 16 == 0 ? Largest<16>(block) : Largest<8>(block);
}

BlockScan ScanYuyv(const BlockSamples& block, const SampledRows& rows) { return Scan(block, rows, YuyvSums()); }

}  // namespace HWY_NAMESPACE
}  // namespace lightwell::estimate
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lightwell::estimate {

HWY_EXPORT(ScanBytes);
HWY_EXPORT(ScanWords);
HWY_EXPORT(ScanYuyv);
HWY_EXPORT(LargestByte);

BlockScan scan_bytes(const BlockSamples& block, const SampledRows& rows) {
  return HWY_DYNAMIC_DISPATCH(ScanBytes)(block, rows);
}

BlockScan scan_words(const BlockSamples& block, const SampledRows& rows, std::uint16_t mask) {
  return HWY_DYNAMIC_DISPATCH(ScanWords)(block, rows, mask);
}

BlockScan scan_yuyv(const BlockSamples& block, const SampledRows& rows) {
  return HWY_DYNAMIC_DISPATCH(ScanYuyv)(block, rows);
}

std::uint32_t largest_byte(const BlockSamples& block) { return HWY_DYNAMIC_DISPATCH(LargestByte)(block); }

}  // namespace lightwell::estimate
#endif  // HWY_ONCE
