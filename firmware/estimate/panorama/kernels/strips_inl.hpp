// What kernels over rows of 8-bit codes share: vectors and how a row is cut into them.
// Once for every vector unit, not once a file: to be included after hwy/highway.h.
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

/// A strip walks down as many rows as a block has, too many streams for the processor to foresee: without this the pass
/// takes twice as long on memory that no cache holds.
constexpr std::ptrdiff_t kAhead = 512;

/// Twice as wide: the lower and the upper half of what one vector held.
struct Wide {
  V16 lower, upper;
};

HWY_INLINE Wide widened(V8 v) {
  const hn::Half<D8> half;
  return {hn::PromoteTo(D16(), hn::LowerHalf(half, v)), hn::PromoteTo(D16(), hn::UpperHalf(half, v))};
}

/// Calls strip(at) for every vector of lanes; the last is shifted back to end with the row.
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
