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
