#include "estimate/panorama/kernels/lane_sums.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "estimate/panorama/kernels/ycbcr_planes.cpp"
#include <hwy/foreach_target.h>
// Highway requires this include after foreach_target.h.
#include <hwy/highway.h>

#include "estimate/panorama/kernels/strips_inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace lightwell::estimate {
namespace HWY_NAMESPACE {

/// Packs with saturation to [0, 255].
HWY_INLINE V8 packed(hn::Vec<DI16> lower, hn::Vec<DI16> upper) {
  const hn::Half<D8> half;
  return hn::Combine(D8(), hn::DemoteTo(half, upper), hn::DemoteTo(half, lower));
}

/// Packs with saturation, and restores the order of unpacked().
#if LIGHTWELL_UNPACKS_BLOCKS
HWY_INLINE V8 repacked(hn::Vec<DI16> lower, hn::Vec<DI16> upper) {
#if HWY_TARGET <= HWY_AVX3
  return V8{_mm512_packus_epi16(lower.raw, upper.raw)};
#elif HWY_TARGET <= HWY_AVX2
  return V8{_mm256_packus_epi16(lower.raw, upper.raw)};
#else
  return V8{_mm_packus_epi16(lower.raw, upper.raw)};
#endif
}
#else
HWY_INLINE V8 repacked(hn::Vec<DI16> lower, hn::Vec<DI16> upper) { return packed(lower, upper); }
#endif

/// Fixed-point factor of a coefficient for MulFixedPoint15() with a difference of codes that was shifted left by
/// `shift` bits; the product is in 1/64 of a code.
constexpr std::int16_t scaled(double coefficient, int shift) {
  return static_cast<std::int16_t>(coefficient * 64 * 32768 / (1 << shift) + 0.5);
}

/// Duplicates each even (odd) lane.
HWY_INLINE hn::Vec<DI16> even_twice(hn::Vec<DI16> v) {
  const auto pairs = hn::And(hn::BitCast(D32(), v), hn::Set(D32(), 0xFFFF));
  return hn::BitCast(DI16(), hn::Or(pairs, hn::ShiftLeft<16>(pairs)));
}
HWY_INLINE hn::Vec<DI16> odd_twice(hn::Vec<DI16> v) {
  const auto pairs = hn::ShiftRight<16>(hn::BitCast(D32(), v));
  return hn::BitCast(DI16(), hn::Or(pairs, hn::ShiftLeft<16>(pairs)));
}

/// Contribution of chroma to r, g, b in 1/64 of a code, from 16-bit lanes of Cb and Cr; two pixels share a pair.
struct Chroma {
  hn::Vec<DI16> r, g, b;

  HWY_INLINE explicit Chroma(V16 pairs) {
    const DI16 d;
    const auto shifted = hn::ShiftLeft<8>(hn::Sub(hn::BitCast(d, pairs), hn::Set(d, 128)));
    const auto times = [&](double of_cb, double of_cr) HWY_ATTR {
      const auto lower = static_cast<std::uint16_t>(scaled(of_cb, 8)),
                 upper = static_cast<std::uint16_t>(scaled(of_cr, 8));
      const auto both = hn::Set(D32(), static_cast<std::uint32_t>(upper) << 16 | lower);
      return hn::MulFixedPoint15(shifted, hn::BitCast(d, both));
    };
    const auto own = times(2.017232, 1.596027), green = times(0.391762, 0.812968);
    b = even_twice(own);
    r = odd_twice(own);
    g = hn::Add(even_twice(green), odd_twice(green));
  }
};

/// Half a vector of pixels: codes of r, g, b, rounded, not yet clamped.
struct Codes {
  hn::Vec<DI16> r, g, b;

  HWY_INLINE Codes(V16 luma, const Chroma& chroma) {
    const DI16 d;
    const auto y = hn::ShiftLeft<7>(hn::Sub(hn::BitCast(d, luma), hn::Set(d, 16)));
    const auto l = hn::Add(hn::MulFixedPoint15(y, hn::Set(d, scaled(1.164384, 7))), hn::Set(d, 32));
    r = hn::ShiftRight<6>(hn::SaturatedAdd(l, chroma.r));
    g = hn::ShiftRight<6>(hn::SaturatedSub(l, chroma.g));
    b = hn::ShiftRight<6>(hn::SaturatedAdd(l, chroma.b));
  }
};

void PlanesOfYuyv(const std::uint8_t* row, std::size_t pixels, const PlaneRow& out) {
  const D8 d8;
  const D16 d16;
  for_strips(pixels, [&](std::size_t at) HWY_ATTR {
    __builtin_prefetch(row + 2 * at + kAhead);
    // Luma is in the low bytes, Cb and Cr alternate in the high ones.
    V16 luma[2], chroma[2];
    for (std::size_t half = 0; half < 2; ++half) {
      const V16 pixel = hn::BitCast(d16, hn::LoadU(d8, row + 2 * at + half * hn::Lanes(d8)));
      luma[half] = hn::And(pixel, hn::Set(d16, 0xFF));
      chroma[half] = hn::ShiftRight<8>(pixel);
    }
    const Codes lower(luma[0], Chroma(chroma[0])), upper(luma[1], Chroma(chroma[1]));
    hn::StoreU(packed(lower.r, upper.r), d8, out.r + at);
    hn::StoreU(packed(lower.g, upper.g), d8, out.g + at);
    hn::StoreU(packed(lower.b, upper.b), d8, out.b + at);
  });
}

void PlanesOfNv12(const std::uint8_t* upper_luma, const std::uint8_t* lower_luma, const std::uint8_t* chroma,
                  std::size_t pixels, const PlaneRow& upper, const PlaneRow& lower) {
  const D8 d8;
  for_strips(pixels, [&](std::size_t at) HWY_ATTR {
    __builtin_prefetch(upper_luma + at + kAhead);
    __builtin_prefetch(lower_luma + at + kAhead);
    __builtin_prefetch(chroma + at + kAhead);
    // Cb and Cr of two pixels are at the byte positions of their luma.
    const Wide pairs = unpacked(hn::LoadU(d8, chroma + at));
    const Chroma left(pairs.lower), right(pairs.upper);
    const Wide y = unpacked(hn::LoadU(d8, upper_luma + at)), below = unpacked(hn::LoadU(d8, lower_luma + at));
    const auto store = [&](const Codes& l, const Codes& r, const PlaneRow& out) HWY_ATTR {
      hn::StoreU(repacked(l.r, r.r), d8, out.r + at);
      hn::StoreU(repacked(l.g, r.g), d8, out.g + at);
      hn::StoreU(repacked(l.b, r.b), d8, out.b + at);
    };
    store({y.lower, left}, {y.upper, right}, upper);
    store({below.lower, left}, {below.upper, right}, lower);
  });
}

HWY_INLINE V8 difference(V8 a, V8 b) { return hn::Or(hn::SaturatedSub(a, b), hn::SaturatedSub(b, a)); }

/// The sum of chroma_changes_of_yuyv().
class ChromaChangeSum {
 public:
  HWY_INLINE ChromaChangeSum() : sum_(hn::Zero(D32())) {}
  HWY_INLINE void add(V8 of_chroma, V8 of_luma) {
    const D8 d;
    const D16 d16;
    const V8 chroma = hn::IfThenElseZero(hn::Gt(of_chroma, hn::Set(d, kMinChromaChange)), of_chroma);
    const V8 half = hn::And(hn::BitCast(d, hn::ShiftRight<1>(hn::BitCast(d16, of_luma))), hn::Set(d, 0x7F));
    const Wide c = unpacked(chroma), by = unpacked(hn::SaturatedAdd(chroma, half));
    add(hn::Mul(c.lower, by.lower));
    add(hn::Mul(c.upper, by.upper));
  }
  HWY_INLINE std::uint64_t total() const { return hn::GetLane(hn::SumOfLanes(D32(), sum_)); }

 private:
  HWY_INLINE void add(V16 v) {
    const D32 d;
    const V32 pairs = hn::BitCast(d, v);
    sum_ = hn::Add(sum_, hn::Add(hn::And(pairs, hn::Set(d, 0xFFFF)), hn::ShiftRight<16>(pairs)));
  }
  V32 sum_;
};

std::uint64_t ChromaChangesOfYuyv(const std::uint8_t* row, std::size_t pixels) {
  const D8 d;
  const D16 d16;
  ChromaChangeSum sum;
  for (std::size_t at = 0; at + hn::Lanes(d) + 4 <= 2 * pixels; at += hn::Lanes(d)) {
    const V8 change = difference(hn::LoadU(d, row + at), hn::LoadU(d, row + at + 4));
    // Luma in the low bytes, chroma in the high ones, which become low ones.
    const V16 words = hn::BitCast(d16, change);
    sum.add(hn::BitCast(d, hn::ShiftRight<8>(words)), hn::BitCast(d, hn::And(words, hn::Set(d16, 0xFF))));
  }
  return sum.total();
}

std::uint64_t ChromaChangesOfNv12(const std::uint8_t* luma, const std::uint8_t* chroma, std::size_t pixels) {
  const D8 d;
  ChromaChangeSum sum;
  for (std::size_t at = 0; at + hn::Lanes(d) + 2 <= pixels; at += hn::Lanes(d))
    sum.add(difference(hn::LoadU(d, chroma + at), hn::LoadU(d, chroma + at + 2)),
            difference(hn::LoadU(d, luma + at), hn::LoadU(d, luma + at + 2)));
  return sum.total();
}

}  // namespace HWY_NAMESPACE
}  // namespace lightwell::estimate
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lightwell::estimate {

HWY_EXPORT(PlanesOfYuyv);
HWY_EXPORT(PlanesOfNv12);
HWY_EXPORT(ChromaChangesOfYuyv);
HWY_EXPORT(ChromaChangesOfNv12);

std::uint64_t chroma_changes_of_yuyv(const std::uint8_t* row, std::size_t pixels) {
  return HWY_DYNAMIC_DISPATCH(ChromaChangesOfYuyv)(row, pixels);
}

std::uint64_t chroma_changes_of_nv12(const std::uint8_t* luma, const std::uint8_t* chroma, std::size_t pixels) {
  return HWY_DYNAMIC_DISPATCH(ChromaChangesOfNv12)(luma, chroma, pixels);
}

void planes_of_yuyv(const std::uint8_t* row, std::size_t pixels, const PlaneRow& out) {
  HWY_DYNAMIC_DISPATCH(PlanesOfYuyv)(row, pixels, out);
}

void planes_of_nv12(const std::uint8_t* upper_luma, const std::uint8_t* lower_luma, const std::uint8_t* chroma,
                    std::size_t pixels, const PlaneRow& upper, const PlaneRow& lower) {
  HWY_DYNAMIC_DISPATCH(PlanesOfNv12)(upper_luma, lower_luma, chroma, pixels, upper, lower);
}

}  // namespace lightwell::estimate
#endif  // HWY_ONCE
