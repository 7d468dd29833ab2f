#include "estimate/panorama/kernels/lane_sums.hpp"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "estimate/panorama/kernels/lane_sums.cpp"
#include <hwy/foreach_target.h>
// Highway requires this include after foreach_target.h.
#include <hwy/highway.h>

#include "estimate/panorama/kernels/code_lookup_inl.hpp"
#include "estimate/panorama/kernels/strips_inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace lightwell::estimate {
namespace HWY_NAMESPACE {

/// 257 v: converts the full scale of 8 bits to that of 16.
struct Repeat {
  using Order = UnpackedOrder;
  HWY_INLINE Wide operator()(V8 codes) const { return wide(codes, codes); }
};

/// Four vectors of 32-bit elements for one of 8-bit elements: sums of 16-bit values over rows.
class Sums32 {
 public:
  HWY_INLINE Sums32() {
    for (V32& p : part_) p = hn::Zero(D32());
  }
  HWY_INLINE void add(const Wide& v) {
    add(v.lower, part_[0], part_[1]);
    add(v.upper, part_[2], part_[3]);
  }
  HWY_INLINE void add(const Sums32& s) {
    for (int i = 0; i < 4; ++i) part_[i] = hn::Add(part_[i], s.part_[i]);
  }
  template <class Order>
  HWY_INLINE void store(std::uint32_t* to) const {
    store(part_[0], part_[1], Order::block_step(), to);
    store(part_[2], part_[3], Order::block_step(), to + Order::upper_at());
  }

 private:
#if LIGHTWELL_UNPACKS_BLOCKS
  // Sums of even and of odd elements: no element moves to another block before store().
  HWY_INLINE static void add(V16 v, V32& even, V32& odd) {
    const V32 pairs = hn::BitCast(D32(), v);
    even = hn::Add(even, hn::And(pairs, hn::Set(D32(), 0xFFFF)));
    odd = hn::Add(odd, hn::ShiftRight<16>(pairs));
  }
  HWY_INLINE static void store(V32 even, V32 odd, std::size_t step, std::uint32_t* to) {
    const D32 d;
    HWY_ALIGN std::uint32_t first[hn::MaxLanes(d)], second[hn::MaxLanes(d)];
    hn::Store(hn::InterleaveLower(d, even, odd), d, first);
    hn::Store(hn::InterleaveUpper(d, even, odd), d, second);
    const hn::FixedTag<std::uint32_t, 4> block;
    for (std::size_t i = 0; i < hn::Lanes(d); i += 4, to += step) {
      hn::StoreU(hn::Load(block, first + i), block, to);
      hn::StoreU(hn::Load(block, second + i), block, to + 4);
    }
  }
#else
  HWY_INLINE static void add(V16 v, V32& lower, V32& upper) {
    const hn::Half<D16> half;
    lower = hn::Add(lower, hn::PromoteTo(D32(), hn::LowerHalf(half, v)));
    upper = hn::Add(upper, hn::PromoteTo(D32(), hn::UpperHalf(half, v)));
  }
  HWY_INLINE static void store(V32 lower, V32 upper, std::size_t /*step*/, std::uint32_t* to) {
    const D32 d;
    hn::StoreU(lower, d, to);
    hn::StoreU(upper, d, to + hn::Lanes(d));
  }
#endif

  V32 part_[4];
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
      const Wide w = unpacked(v);
      sum = {hn::Add(sum.lower, w.lower), hn::Add(sum.upper, w.upper)};
      early = {hn::Add(early.lower, sum.lower), hn::Add(early.upper, sum.upper)};
    }
    Sums32 wide_sum, wide_early;
    wide_sum.add(sum);
    wide_early.add(early);
    wide_sum.store<UnpackedOrder>(out.sum + at);
    wide_early.store<UnpackedOrder>(out.early + at);
    store_peak(rows, limit, peak, nullptr, 0, at, out);
  });
}

/// Sums of looked-up codes.
template <class Lookup>
class TableSums {
 public:
  HWY_INLINE explicit TableSums(const Lookup& lookup) : lookup_(lookup) {}
  HWY_INLINE void add(V8 codes) {
    sum_.add(lookup_(codes));
    early_.add(sum_);
  }
  HWY_INLINE void store(std::uint32_t* sum, std::uint32_t* early) const {
    sum_.template store<typename Lookup::Order>(sum);
    early_.template store<typename Lookup::Order>(early);
  }

 private:
  Sums32 sum_, early_;
  const Lookup& lookup_;
};

template <class Lookup>
void SumLookedUpBy(const Lookup& lookup, const CodeRows& rows, std::size_t lanes, const LaneSums& out) {
  const D8 d8;
  const Limit8 limit(rows.clipped_from);
  for_strips(lanes, [&](std::size_t at) HWY_ATTR {
    TableSums<Lookup> sums(lookup);
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

void SumLookedUp(const CodeRows& rows, std::size_t lanes, const LaneSums& out) {
  with_lookup(*rows.table, [&](const auto& lookup) HWY_ATTR { SumLookedUpBy(lookup, rows, lanes, out); });
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
      const Wide linear = to_linear(v), wide = ToLinear::Order::widened(w);
      sum.add(Wide{hn::MulHigh(linear.lower, hn::ShiftLeft<8>(wide.lower)),
                   hn::MulHigh(linear.upper, hn::ShiftLeft<8>(wide.upper))});
      early.add(sum);
    }
    sum.template store<typename ToLinear::Order>(out.sum + at);
    early.template store<typename ToLinear::Order>(out.early + at);
    store_peak(rows, limit, peak, weights, weight_stride, at, out);
  });
}

void SumWeightedCodes(const CodeRows& rows, const std::uint8_t* weights, std::size_t weight_stride, std::size_t lanes,
                      const LaneSums& out) {
  if (rows.table != nullptr)
    with_lookup(*rows.table,
                [&](const auto& lookup) HWY_ATTR { SumWeighted(rows, lookup, weights, weight_stride, lanes, out); });
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
    sum.store<RowOrder>(out.sum + at);
    early.store<RowOrder>(out.early + at);
    store_wide(peak, out.peak + at);
    if (clips && (reaches(d16, peak.lower, limit) || reaches(d16, peak.upper, limit))) {
      Wide unused{hn::Zero(d16), hn::Zero(d16)};
      clipped.lower = count_from(d16, limit, rows.rows, [&](int y) HWY_ATTR { return seen_words(y, unused).lower; });
      clipped.upper = count_from(d16, limit, rows.rows, [&](int y) HWY_ATTR { return seen_words(y, unused).upper; });
    }
    store_wide(clipped, out.clipped + at);
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

}  // namespace lightwell::estimate
#endif  // HWY_ONCE
