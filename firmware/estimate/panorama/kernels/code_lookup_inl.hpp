// Conversion of vectors of 8-bit codes to linear values.
// Included once per Highway target, not once per file; must follow hwy/highway.h.
#if defined(LIGHTWELL_KERNELS_CODE_LOOKUP_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef LIGHTWELL_KERNELS_CODE_LOOKUP_INL
#undef LIGHTWELL_KERNELS_CODE_LOOKUP_INL
#else
#define LIGHTWELL_KERNELS_CODE_LOOKUP_INL
#endif

#include "estimate/panorama/kernels/code_table.hpp"
#include "estimate/panorama/kernels/strips_inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace lightwell::estimate {
namespace HWY_NAMESPACE {

#if HWY_TARGET == HWY_NEON && HWY_ARCH_ARM_A64
/// Looks up 16 codes at once, four 64-byte tables for each byte of a value.
class TableLookup {
 public:
  using Order = RowOrder;
  explicit TableLookup(const CodeTable& table) {
    for (int quarter = 0; quarter < 4; ++quarter) {
      for (int i = 0; i < 4; ++i) {
        // Separates alternating low and high bytes.
        const uint8x16x2_t both =
            vld2q_u8(reinterpret_cast<const std::uint8_t*>(table.values().data() + 64 * quarter + 16 * i));
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
/// Looks up one code after another: for the few curves that have no segments.
class TableLookup {
 public:
  using Order = RowOrder;
  explicit TableLookup(const CodeTable& table) : table_(table.values().data()) {}
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

/// Evaluates CodeSegments, which must outlive it.
class SegmentLookup {
 public:
  using Order = UnpackedOrder;
  explicit SegmentLookup(const CodeSegments& segments) : segments_(segments) {}
  HWY_INLINE Wide operator()(V8 codes) const {
    const D8 d;
    const D16 d16;
    const V8 lower_bits = hn::Set(d, 15);
    const V8 segment = hn::And(hn::BitCast(d, hn::ShiftRight<4>(hn::BitCast(d16, codes))), lower_bits);
    const V8 within = hn::And(codes, lower_bits);
    // Below 128, and so an index, in the exact segment alone.
    const V8 exact_from = hn::Set(d, static_cast<std::uint8_t>(CodeSegments::kLength * segments_.exact_segment));
    const V8 in_exact = hn::SaturatedAdd(hn::Xor(codes, exact_from), hn::Set(d, 0x70));
    const Wide base = wide(hn::Or(selected(segments_.base.low, segment), selected(segments_.exact.low, in_exact)),
                           hn::Or(selected(segments_.base.high, segment), selected(segments_.exact.high, in_exact)));
    const Wide rise = words(segments_.rise, segment), bend = words(segments_.bend, segment);
    // t 2^12 and t² 2^7: the products' upper 16 bits are the quotients.
    const V8 zero = hn::Zero(d), shifted = hn::BitCast(d, hn::ShiftLeft<4>(hn::BitCast(d16, within)));
    const Wide t = wide(zero, shifted), t2 = wide(zero, selected(kSquares, within));
    return {sum(base.lower, rise.lower, bend.lower, t.lower, t2.lower),
            sum(base.upper, rise.upper, bend.upper, t.upper, t2.upper)};
  }

 private:
  using Bytes = std::array<std::uint8_t, CodeSegments::kLength>;
  alignas(16) static constexpr Bytes kSquares = {0, 1, 4, 9, 16, 25, 36, 49, 64, 81, 100, 121, 144, 169, 196, 225};

  /// An index of 128 or more selects 0.
  HWY_INLINE static V8 selected(const Bytes& bytes, V8 index) {
    return hn::TableLookupBytesOr0(hn::LoadDup128(D8(), bytes.data()), index);
  }
  HWY_INLINE static Wide words(const CodeSegments::Words& words, V8 index) {
    return wide(selected(words.low, index), selected(words.high, index));
  }
  HWY_INLINE static V16 sum(V16 base, V16 rise, V16 bend, V16 t, V16 t2) {
    const DI16 d;
    const auto quadratic = hn::MulHigh(hn::BitCast(d, bend), hn::BitCast(d, hn::ShiftRight<1>(t2)));
    return hn::Add(hn::Add(base, hn::MulHigh(rise, t)), hn::BitCast(D16(), quadratic));
  }

  const CodeSegments& segments_;
};
#endif

/// Calls of(lookup) with the fastest lookup for the table.
template <class Of>
HWY_INLINE void with_lookup(const CodeTable& table, Of&& of) {
#if !(HWY_TARGET == HWY_NEON && HWY_ARCH_ARM_A64)
  if (table.segments() != nullptr) return of(SegmentLookup(*table.segments()));
#endif
  of(TableLookup(table));
}

}  // namespace HWY_NAMESPACE
}  // namespace lightwell::estimate
HWY_AFTER_NAMESPACE();

#endif
