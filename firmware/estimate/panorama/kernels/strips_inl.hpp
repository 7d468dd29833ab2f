// Vector types and iteration shared by the kernels over rows of 8-bit codes.
// Included once per Highway target, not once per file; must follow hwy/highway.h.
#if defined(LIGHTWELL_KERNELS_STRIPS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef LIGHTWELL_KERNELS_STRIPS_INL
#undef LIGHTWELL_KERNELS_STRIPS_INL
#else
#define LIGHTWELL_KERNELS_STRIPS_INL
#endif

#include <cstddef>
#include <cstdint>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lightwell::estimate {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using D8 = hn::ScalableTag<std::uint8_t>;
using D16 = hn::RepartitionToWide<D8>;
using D32 = hn::RepartitionToWide<D16>;
using DI16 = hn::RebindToSigned<D16>;
using V8 = hn::Vec<D8>;
using V16 = hn::Vec<D16>;
using V32 = hn::Vec<D32>;

/// Prefetch distance in bytes. A strip reads all rows of a block, too many streams for the hardware prefetcher: without
/// software prefetch, the pass takes twice as long on images larger than the cache.
constexpr std::ptrdiff_t kAhead = 512;

/// A vector of 8-bit elements widened to 16 bits: lower and upper half.
struct Wide {
  V16 lower, upper;
};

HWY_INLINE Wide widened(V8 v) {
  const hn::Half<D8> half;
  return {hn::PromoteTo(D16(), hn::LowerHalf(half, v)), hn::PromoteTo(D16(), hn::UpperHalf(half, v))};
}

// x86 unpacks within 128-bit blocks by one instruction; across a whole vector it takes several.
#undef LIGHTWELL_UNPACKS_BLOCKS
#define LIGHTWELL_UNPACKS_BLOCKS (HWY_ARCH_X86 && HWY_TARGET < HWY_EMU128)

/// Words from low and high bytes, in UnpackedOrder.
HWY_INLINE Wide wide(V8 low, V8 high) {
#if LIGHTWELL_UNPACKS_BLOCKS
  return {hn::BitCast(D16(), hn::InterleaveLower(D8(), low, high)),
          hn::BitCast(D16(), hn::InterleaveUpper(D8(), low, high))};
#else
  const Wide l = widened(low), h = widened(high);
  return {hn::Or(l.lower, hn::ShiftLeft<8>(h.lower)), hn::Or(l.upper, hn::ShiftLeft<8>(h.upper))};
#endif
}
HWY_INLINE Wide unpacked(V8 v) {
#if LIGHTWELL_UNPACKS_BLOCKS
  return wide(v, hn::Zero(D8()));
#else
  return widened(v);
#endif
}

/// The order of a row: the lower vector holds the first half of the elements.
struct RowOrder {
  HWY_INLINE static Wide widened(V8 v) { return HWY_NAMESPACE::widened(v); }
  /// Distance of the 128-bit blocks of a vector in the row, and of the first blocks of both vectors.
  static constexpr std::size_t block_step() { return 8; }
  static std::size_t upper_at() { return hn::Lanes(D16()); }
};
/// The order of unpacked(): the lower vector holds the first half of each 128-bit block.
struct UnpackedOrder {
  HWY_INLINE static Wide widened(V8 v) { return unpacked(v); }
  static constexpr std::size_t block_step() { return LIGHTWELL_UNPACKS_BLOCKS ? 16 : RowOrder::block_step(); }
  static std::size_t upper_at() { return LIGHTWELL_UNPACKS_BLOCKS ? 8 : RowOrder::upper_at(); }
};

/// Calls strip(at) for each vector of lanes; the last is shifted back so that it ends with the row.
template <class Strip>
HWY_INLINE void for_strips(std::size_t lanes, Strip&& strip) {
  const std::size_t n = hn::Lanes(D8());
  std::size_t at = 0;
  for (; at + n <= lanes; at += n) strip(at);
  if (at < lanes) strip(lanes - n);
}

}  // namespace HWY_NAMESPACE
}  // namespace lightwell::estimate
HWY_AFTER_NAMESPACE();

#endif
