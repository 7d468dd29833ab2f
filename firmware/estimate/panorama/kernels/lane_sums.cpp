#include "estimate/panorama/kernels/lane_sums.hpp"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "estimate/panorama/kernels/lane_sums.cpp"
#include <hwy/foreach_target.h>
// Highway requires this include after foreach_target.h.
#include <hwy/highway.h>

#include "estimate/panorama/kernels/strips_inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace lightwell::estimate {
namespace HWY_NAMESPACE {

#if HWY_TARGET == HWY_NEON && HWY_ARCH_ARM_A64
class Lookup {
 public:
  explicit Lookup(const CodeTable16& table) {
    for (int quarter = 0; quarter < 4; ++quarter) {
      for (int i = 0; i < 4; ++i) {
        // Separates alternating low and high bytes.
        const uint8x16x2_t both = vld2q_u8(reinterpret_cast<const std::uint8_t*>(table.data() + 64 * quarter + 16 * i));
        part_[0][quarter].val[i] = both.val[0];
        part_[1][quarter].val[i] = both.val[1];
      }
    }
  }
  HWY_INLINE Wide operator()(V8 codes) const {
    const uint8x16_t at[4] = {codes.raw, vsubq_u8(codes.raw, vdupq_n_u8(64)), vsubq_u8(codes.raw, vdupq_n_u8(128)),
                              vsubq_u8(codes.raw, vdupq_n_u8(192))};
    uint8x16_t bytes[2];
    for (int half = 0; half < 2; ++half) {
      // An index beyond 64 bytes gives zero (tbl) or leaves the element unchanged (tbx).
      bytes[half] = vqtbl4q_u8(part_[half][0], at[0]);
      for (int quarter = 1; quarter < 4; ++quarter)
        bytes[half] = vqtbx4q_u8(bytes[half], part_[half][quarter], at[quarter]);
    }
    return {V16(vreinterpretq_u16_u8(vzip1q_u8(bytes[0], bytes[1]))),
            V16(vreinterpretq_u16_u8(vzip2q_u8(bytes[0], bytes[1])))};
  }

 private:
  uint8x16x4_t part_[2][4];
};
#else
class Lookup {
 public:
  explicit Lookup(const CodeTable16& table) : table_(table.data()) {}
  HWY_INLINE Wide operator()(V8 codes) const {
    const D8 d8;
    const D16 d16;
    HWY_ALIGN std::uint8_t in[hn::MaxLanes(d8)];
    HWY_ALIGN std::uint16_t out[hn::MaxLanes(d8)];
    hn::Store(codes, d8, in);
    for (std::size_t i = 0; i < hn::Lanes(d8); ++i) out[i] = table_[in[i]];
    return {hn::Load(d16, out), hn::Load(d16, out + hn::Lanes(d16))};
  }

 private:
  const std::uint16_t* table_;
};
#endif

/// 257 v: converts the full scale of 8 bits to that of 16.
struct Repeat {
  HWY_INLINE Wide operator()(V8 codes) const {
    const Wide w = widened(codes);
    return {hn::Or(w.lower, hn::ShiftLeft<8>(w.lower)), hn::Or(w.upper, hn::ShiftLeft<8>(w.upper))};
  }
};

/// Four vectors of 32-bit elements for one of 8-bit elements: sums of 16-bit values over rows.
struct Sums32 {
  V32 part[4];

  HWY_INLINE Sums32() {
    for (V32& p : part) p = hn::Zero(D32());
  }
  HWY_INLINE void add(const Wide& v) {
    const hn::Half<D16> half;
    part[0] = hn::Add(part[0], hn::PromoteTo(D32(), hn::LowerHalf(half, v.lower)));
    part[1] = hn::Add(part[1], hn::PromoteTo(D32(), hn::UpperHalf(half, v.lower)));
    part[2] = hn::Add(part[2], hn::PromoteTo(D32(), hn::LowerHalf(half, v.upper)));
    part[3] = hn::Add(part[3], hn::PromoteTo(D32(), hn::UpperHalf(half, v.upper)));
  }
  HWY_INLINE void add(const Sums32& s) {
    for (int i = 0; i < 4; ++i) part[i] = hn::Add(part[i], s.part[i]);
  }
  HWY_INLINE void store(std::uint32_t* to) const {
    const D32 d;
    for (std::size_t i = 0; i < 4; ++i) hn::StoreU(part[i], d, to + i * hn::Lanes(d));
  }
};

HWY_INLINE void store_wide(const Wide& v, std::uint16_t* to) {
  const D16 d;
  hn::StoreU(v.lower, d, to);
  hn::StoreU(v.upper, d, to + hn::Lanes(d));
}

/// Number of rows in which each lane is at least `limit`; called only where a peak reaches it.
template <class D, class Row>
HWY_INLINE hn::Vec<D> count_from(D d, hn::Vec<D> limit, int rows, Row&& row) {
  hn::Vec<D> count = hn::Zero(d);
  for (int y = 0; y < rows; ++y) {
    const hn::Vec<D> v = row(y);
    count = hn::Add(count, hn::IfThenElseZero(hn::Eq(hn::Max(v, limit), v), hn::Set(d, 1)));
  }
  return count;
}

template <class D>
HWY_INLINE bool reaches(D d, hn::Vec<D> peak, hn::Vec<D> limit) {
  return !hn::AllFalse(d, hn::Eq(hn::Max(peak, limit), peak));
}

/// Smallest clipped 8-bit code; `clips` is false where there is none.
struct Limit8 {
  bool clips;
  V8 value;
  HWY_INLINE explicit Limit8(unsigned from)
      : clips(from < 256), value(hn::Set(D8(), static_cast<std::uint8_t>(std::min(from, 255U)))) {}
};

HWY_INLINE void store_peak(const CodeRows& rows, const Limit8& limit, V8 peak, const std::uint8_t* weights,
                           std::size_t weight_stride, std::size_t at, const LaneSums& out) {
  const D8 d8;
  V8 clipped = hn::Zero(d8);
  if (limit.clips && reaches(d8, peak, limit.value))
    clipped = count_from(d8, limit.value, rows.rows, [&](int y) HWY_ATTR {
      const auto row = static_cast<std::size_t>(y);
      const V8 v = hn::LoadU(d8, rows.first + row * rows.stride + at);
      if (weights == nullptr) return v;
      return hn::IfThenZeroElse(hn::Eq(hn::LoadU(d8, weights + row * weight_stride + at), hn::Zero(d8)), v);
    });
  store_wide(widened(peak), out.peak + at);
  store_wide(widened(clipped), out.clipped + at);
}

/// For linear codes: sums of 16 codes, and cumulative sums of these, fit into 16 bits.
void SumCodes(const CodeRows& rows, std::size_t lanes, const LaneSums& out) {
  const D8 d8;
  const D16 d16;
  const Limit8 limit(rows.clipped_from);
  for_strips(lanes, [&](std::size_t at) HWY_ATTR {
    Wide sum{hn::Zero(d16), hn::Zero(d16)}, early = sum;
    V8 peak = hn::Zero(d8);
    const std::uint8_t* row = rows.first + at;
    for (int y = 0; y < rows.rows; ++y, row += rows.stride) {
      __builtin_prefetch(row + kAhead);
      const V8 v = hn::LoadU(d8, row);
      peak = hn::Max(peak, v);
      const Wide w = widened(v);
      sum = {hn::Add(sum.lower, w.lower), hn::Add(sum.upper, w.upper)};
      early = {hn::Add(early.lower, sum.lower), hn::Add(early.upper, sum.upper)};
    }
    Sums32 wide_sum, wide_early;
    wide_sum.add(sum);
    wide_early.add(early);
    wide_sum.store(out.sum + at);
    wide_early.store(out.early + at);
    store_peak(rows, limit, peak, nullptr, 0, at, out);
  });
}

/// Sums of looked-up codes.
class TableSums {
 public:
  HWY_INLINE explicit TableSums(const Lookup& lookup) : lookup_(lookup) {}
  HWY_INLINE void add(V8 codes) {
    sum_.add(lookup_(codes));
    early_.add(sum_);
  }
  HWY_INLINE void store(std::uint32_t* sum, std::uint32_t* early) const {
    sum_.store(sum);
    early_.store(early);
  }

 private:
  Sums32 sum_, early_;
  const Lookup& lookup_;
};

void SumLookedUp(const CodeRows& rows, std::size_t lanes, const LaneSums& out) {
  const D8 d8;
  const Limit8 limit(rows.clipped_from);
  const Lookup lookup(*rows.table);
  for_strips(lanes, [&](std::size_t at) HWY_ATTR {
    TableSums sums(lookup);
    V8 peak = hn::Zero(d8);
    const std::uint8_t* row = rows.first + at;
    int y = 0;
    for (; y + 1 < rows.rows; y += 2, row += 2 * rows.stride) {
      __builtin_prefetch(row + kAhead);
      __builtin_prefetch(row + rows.stride + kAhead);
      const V8 upper = hn::LoadU(d8, row), lower = hn::LoadU(d8, row + rows.stride);
      peak = hn::Max(peak, hn::Max(upper, lower));
      sums.add(upper);
      sums.add(lower);
    }
    if (y < rows.rows) {
      const V8 last = hn::LoadU(d8, row);
      peak = hn::Max(peak, last);
      sums.add(last);
    }
    sums.store(out.sum + at, out.early + at);
    store_peak(rows, limit, peak, nullptr, 0, at, out);
  });
}

template <class ToLinear>
void SumWeighted(const CodeRows& rows, const ToLinear& to_linear, const std::uint8_t* weights,
                 std::size_t weight_stride, std::size_t lanes, const LaneSums& out) {
  const D8 d8;
  const Limit8 limit(rows.clipped_from);
  for_strips(lanes, [&](std::size_t at) HWY_ATTR {
    Sums32 sum, early;
    V8 peak = hn::Zero(d8);
    const std::uint8_t* row = rows.first + at;
    const std::uint8_t* weight_row = weights + at;
    for (int y = 0; y < rows.rows; ++y, row += rows.stride, weight_row += weight_stride) {
      __builtin_prefetch(row + kAhead);
      const V8 v = hn::LoadU(d8, row), w = hn::LoadU(d8, weight_row);
      // Codes with zero weight are ignored in peaks and counts of clipped codes.
      peak = hn::Max(peak, hn::IfThenZeroElse(hn::Eq(w, hn::Zero(d8)), v));
      const Wide linear = to_linear(v), wide = widened(w);
      sum.add(Wide{hn::MulHigh(linear.lower, hn::ShiftLeft<8>(wide.lower)),
                   hn::MulHigh(linear.upper, hn::ShiftLeft<8>(wide.upper))});
      early.add(sum);
    }
    sum.store(out.sum + at);
    early.store(out.early + at);
    store_peak(rows, limit, peak, weights, weight_stride, at, out);
  });
}

void SumWeightedCodes(const CodeRows& rows, const std::uint8_t* weights, std::size_t weight_stride, std::size_t lanes,
                      const LaneSums& out) {
  if (rows.table != nullptr)
    SumWeighted(rows, Lookup(*rows.table), weights, weight_stride, lanes, out);
  else
    SumWeighted(rows, Repeat(), weights, weight_stride, lanes, out);
}

void SumWords(const WordRows& rows, const std::uint8_t* weights, std::size_t weight_stride, std::size_t lanes,
              const LaneSums& out) {
  const D8 d8;
  const D16 d16;
  const bool clips = rows.clipped_from < 65536;
  const V16 limit = hn::Set(d16, static_cast<std::uint16_t>(std::min(rows.clipped_from, 65535U)));
  const V16 mask = hn::Set(d16, rows.mask);
  const auto words = [&](const std::uint8_t* row) HWY_ATTR {
    const V8 lower = hn::LoadU(d8, row), upper = hn::LoadU(d8, row + hn::Lanes(d8));
    return Wide{hn::And(hn::BitCast(d16, lower), mask), hn::And(hn::BitCast(d16, upper), mask)};
  };
  const auto seen = [&](const Wide& v, const Wide& w) HWY_ATTR {
    return Wide{hn::IfThenZeroElse(hn::Eq(w.lower, hn::Zero(d16)), v.lower),
                hn::IfThenZeroElse(hn::Eq(w.upper, hn::Zero(d16)), v.upper)};
  };
  for_strips(lanes, [&](std::size_t at) HWY_ATTR {
    Sums32 sum, early;
    Wide peak{hn::Zero(d16), hn::Zero(d16)}, clipped = peak;
    const auto seen_words = [&](int y, Wide& weight) HWY_ATTR {
      const Wide v = words(rows.first + static_cast<std::size_t>(y) * rows.stride + 2 * at);
      if (weights == nullptr) return v;
      weight = widened(hn::LoadU(d8, weights + static_cast<std::size_t>(y) * weight_stride + at));
      return seen(v, weight);
    };
    for (int y = 0; y < rows.rows; ++y) {
      __builtin_prefetch(rows.first + static_cast<std::size_t>(y) * rows.stride + 2 * at + kAhead);
      Wide weight{hn::Zero(d16), hn::Zero(d16)};
      const Wide v = seen_words(y, weight);
      peak = {hn::Max(peak.lower, v.lower), hn::Max(peak.upper, v.upper)};
      sum.add(weights == nullptr ? v
                                 : Wide{hn::MulHigh(hn::ShiftLeft<4>(v.lower), hn::ShiftLeft<8>(weight.lower)),
                                        hn::MulHigh(hn::ShiftLeft<4>(v.upper), hn::ShiftLeft<8>(weight.upper))});
      early.add(sum);
    }
    sum.store(out.sum + at);
    early.store(out.early + at);
    store_wide(peak, out.peak + at);
    if (clips && (reaches(d16, peak.lower, limit) || reaches(d16, peak.upper, limit))) {
      Wide unused{hn::Zero(d16), hn::Zero(d16)};
      clipped.lower = count_from(d16, limit, rows.rows, [&](int y) HWY_ATTR { return seen_words(y, unused).lower; });
      clipped.upper = count_from(d16, limit, rows.rows, [&](int y) HWY_ATTR { return seen_words(y, unused).upper; });
    }
    store_wide(clipped, out.clipped + at);
  });
}

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

/// Packs with saturation to [0, 255].
HWY_INLINE V8 packed(hn::Vec<DI16> lower, hn::Vec<DI16> upper) {
  const hn::Half<D8> half;
  return hn::Combine(D8(), hn::DemoteTo(half, upper), hn::DemoteTo(half, lower));
}

// x86 unpacks and packs within 128-bit lanes by one instruction each; across a whole vector it takes several. Packing
// restores the order of lanes that unpacking changed.
#if HWY_ARCH_X86 && HWY_TARGET < HWY_EMU128
HWY_INLINE Wide unpacked(V8 v) {
  const V8 zero = hn::Zero(D8());
  return {hn::BitCast(D16(), hn::InterleaveLower(D8(), v, zero)),
          hn::BitCast(D16(), hn::InterleaveUpper(D8(), v, zero))};
}
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
HWY_INLINE Wide unpacked(V8 v) { return widened(v); }
HWY_INLINE V8 repacked(hn::Vec<DI16> lower, hn::Vec<DI16> upper) { return packed(lower, upper); }
#endif

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

}  // namespace HWY_NAMESPACE
}  // namespace lightwell::estimate
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lightwell::estimate {

HWY_EXPORT(SumCodes);
HWY_EXPORT(SumLookedUp);
HWY_EXPORT(SumWeightedCodes);
HWY_EXPORT(SumWords);
HWY_EXPORT(PlanesOfYuyv);
HWY_EXPORT(PlanesOfNv12);

void sum_lanes(const CodeRows& rows, const LaneWeights& weights, std::size_t lanes, const LaneSums& out) {
  if (weights.first != nullptr)
    HWY_DYNAMIC_DISPATCH(SumWeightedCodes)(rows, weights.first, weights.stride, lanes, out);
  else if (rows.table == nullptr)
    HWY_DYNAMIC_DISPATCH(SumCodes)(rows, lanes, out);
  else
    HWY_DYNAMIC_DISPATCH(SumLookedUp)(rows, lanes, out);
}

void sum_wide_lanes(const WordRows& rows, const LaneWeights& weights, std::size_t lanes, const LaneSums& out) {
  HWY_DYNAMIC_DISPATCH(SumWords)(rows, weights.first, weights.stride, lanes, out);
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
