#include "estimate/panorama/kernels/ycbcr_planes.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "estimate/panorama/kernels/ycbcr_planes.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, says Highway.
#include <hwy/highway.h>
#include "estimate/panorama/kernels/strips_inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace lightwell::estimate {
namespace HWY_NAMESPACE {

/// Of a coefficient times a difference of codes that was shifted up by `shift` bits: the factor for which the rounding
/// high product comes out in 1/64 of a code.
constexpr std::int16_t scaled(double coefficient, int shift) {
  return static_cast<std::int16_t>(coefficient * 64 * 32768 / (1 << shift) + 0.5);
}

/// Each even (odd) lane twice.
HWY_INLINE V16 even_twice(V16 v) {
  const auto pairs = hn::And(hn::BitCast(D32(), v), hn::Set(D32(), 0xFFFF));
  return hn::BitCast(D16(), hn::Or(pairs, hn::ShiftLeft<16>(pairs)));
}
HWY_INLINE V16 odd_twice(V16 v) {
  const auto pairs = hn::ShiftRight<16>(hn::BitCast(D32(), v));
  return hn::BitCast(D16(), hn::Or(pairs, hn::ShiftLeft<16>(pairs)));
}

/// 16-bit lanes of luma, Cb and Cr codes, half a vector of pixels each, to codes of r, g, b in 1/64, rounded.
struct Ycbcr {
  hn::Vec<DI16> r, g, b;

  HWY_INLINE Ycbcr(V16 luma, V16 cb, V16 cr) {
    const DI16 d;
    const auto y = hn::ShiftLeft<7>(hn::Sub(hn::BitCast(d, luma), hn::Set(d, 16)));
    const auto u = hn::ShiftLeft<8>(hn::Sub(hn::BitCast(d, cb), hn::Set(d, 128)));
    const auto v = hn::ShiftLeft<8>(hn::Sub(hn::BitCast(d, cr), hn::Set(d, 128)));
    const auto times = [&](hn::Vec<DI16> a, std::int16_t k) HWY_ATTR { return hn::MulFixedPoint15(a, hn::Set(d, k)); };
    const auto l = hn::Add(times(y, scaled(1.164384, 7)), hn::Set(d, 32));
    r = hn::ShiftRight<6>(hn::SaturatedAdd(l, times(v, scaled(1.596027, 8))));
    g = hn::ShiftRight<6>(hn::SaturatedSub(hn::SaturatedSub(l, times(u, scaled(0.391762, 8))), times(v, scaled(0.812968, 8))));
    b = hn::ShiftRight<6>(hn::SaturatedAdd(l, times(u, scaled(2.017232, 8))));
  }
};

/// Clamped to 0 to 255.
HWY_INLINE V8 packed(hn::Vec<DI16> lower, hn::Vec<DI16> upper) {
  const hn::Half<D8> half;
  return hn::Combine(D8(), hn::DemoteTo(half, upper), hn::DemoteTo(half, lower));
}

HWY_INLINE void store_codes(const Ycbcr& lower, const Ycbcr& upper, std::size_t at, std::uint8_t* r, std::uint8_t* g,
                            std::uint8_t* b) {
  const D8 d;
  hn::StoreU(packed(lower.r, upper.r), d, r + at);
  hn::StoreU(packed(lower.g, upper.g), d, g + at);
  hn::StoreU(packed(lower.b, upper.b), d, b + at);
}

/// Half a vector of pixels from luma in the low bytes and Cb, Cr by turns in the high ones.
HWY_INLINE Ycbcr of_pairs(V16 pixels) {
  const V16 luma = hn::And(pixels, hn::Set(D16(), 0xFF));
  const V16 chroma = hn::ShiftRight<8>(pixels);
  return {luma, even_twice(chroma), odd_twice(chroma)};
}

void PlanesOfYuyv(const std::uint8_t* row, std::size_t pixels, std::uint8_t* r, std::uint8_t* g, std::uint8_t* b) {
  const D8 d8;
  const D16 d16;
  for_strips(pixels, [&](std::size_t at) HWY_ATTR {
    __builtin_prefetch(row + 2 * at + kAhead);
    const V16 lower = hn::BitCast(d16, hn::LoadU(d8, row + 2 * at));
    const V16 upper = hn::BitCast(d16, hn::LoadU(d8, row + 2 * at + hn::Lanes(d8)));
    store_codes(of_pairs(lower), of_pairs(upper), at, r, g, b);
  });
}

void PlanesOfNv12(const std::uint8_t* luma, const std::uint8_t* chroma, std::size_t pixels, std::uint8_t* r,
                  std::uint8_t* g, std::uint8_t* b) {
  const D8 d8;
  for_strips(pixels, [&](std::size_t at) HWY_ATTR {
    // Cb Cr of two pixels stand where these two are in the row.
    const Wide y = widened(hn::LoadU(d8, luma + at)), c = widened(hn::LoadU(d8, chroma + at));
    store_codes({y.lower, even_twice(c.lower), odd_twice(c.lower)}, {y.upper, even_twice(c.upper), odd_twice(c.upper)},
                at, r, g, b);
  });
}

}  // namespace HWY_NAMESPACE
}  // namespace lightwell::estimate
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lightwell::estimate {

HWY_EXPORT(PlanesOfYuyv);
HWY_EXPORT(PlanesOfNv12);

void planes_of_yuyv(const std::uint8_t* row, std::size_t pixels, std::uint8_t* r, std::uint8_t* g, std::uint8_t* b) {
  HWY_DYNAMIC_DISPATCH(PlanesOfYuyv)(row, pixels, r, g, b);
}

void planes_of_nv12(const std::uint8_t* luma, const std::uint8_t* chroma, std::size_t pixels, std::uint8_t* r,
                    std::uint8_t* g, std::uint8_t* b) {
  HWY_DYNAMIC_DISPATCH(PlanesOfNv12)(luma, chroma, pixels, r, g, b);
}

}  // namespace lightwell::estimate
#endif  // HWY_ONCE
