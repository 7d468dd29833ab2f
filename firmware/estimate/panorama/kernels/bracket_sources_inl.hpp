// Sources of a bracket's pixels, by format: linear values and weights of a strip of pixels.
// Included once per Highway target, not once per file; must follow hwy/highway.h.
#if defined(LIGHTWELL_KERNELS_BRACKET_SOURCES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef LIGHTWELL_KERNELS_BRACKET_SOURCES_INL
#undef LIGHTWELL_KERNELS_BRACKET_SOURCES_INL
#else
#define LIGHTWELL_KERNELS_BRACKET_SOURCES_INL
#endif

#include <hwy/highway.h>

#include "estimate/panorama/kernels/bracket_rows.hpp"
#include "estimate/panorama/kernels/strips_inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace lightwell::estimate {
namespace HWY_NAMESPACE {

using DI32 = hn::ScalableTag<std::int32_t>;
using DF = hn::ScalableTag<float>;
using VF = hn::Vec<DF>;

/// A strip is one vector of 8-bit codes, or four vectors of floats.
constexpr std::size_t kParts = 4;
// Constructors are explicit where vectors are members: GCC compiles implicit ones without the target's attributes.
struct Four {
  VF part[kParts];
  HWY_INLINE Four() {}
  HWY_INLINE Four(VF a, VF b, VF c, VF d) : part{a, b, c, d} {}
  HWY_INLINE VF at(std::size_t p) const { return part[p]; }
};

/// Linear values and weights of one exposure's pixels of a strip. `top`: the brightest site of a mosaic's quad.
struct Sample {
  Four r, g, b, weight, top;
  HWY_INLINE Sample() {}
};

HWY_INLINE Four largest(const Four& a, const Four& b) {
  Four out;
  for (std::size_t p = 0; p < kParts; ++p) out.part[p] = hn::Max(a.part[p], b.part[p]);
  return out;
}

HWY_INLINE Four middle(const Four& a, const Four& b) {
  Four out;
  for (std::size_t p = 0; p < kParts; ++p) out.part[p] = hn::Mul(hn::Add(a.part[p], b.part[p]), hn::Set(DF(), 0.5F));
  return out;
}

#if HWY_TARGET == HWY_NEON && HWY_ARCH_ARM_A64
/// Looks up 16 codes at once, four 64-byte tables for each byte of a float.
class CodeLookup {
 public:
  explicit CodeLookup(const CodeLut& lut) : linear_(lut.linear_bytes), weight_(lut.weight_bytes) {}
  template <std::size_t kCount>
  HWY_INLINE void linear(const V8 (&codes)[kCount], Four* const (&out)[kCount]) const {
    V8 bytes[3][kCount];
    select(linear_, codes, bytes);
    for (std::size_t i = 0; i < kCount; ++i) *out[i] = floats(bytes[0][i], bytes[1][i], bytes[2][i]);
  }
  HWY_INLINE Four weight(V8 codes) const {
    V8 bytes[2][1];
    select(weight_, {codes}, bytes);
    return floats(bytes[0][0], bytes[1][0], hn::Zero(D8()));
  }

 private:
  template <std::size_t kBytes, std::size_t kCount>
  static HWY_INLINE void select(const CodeBytes<kBytes>& tables, const V8 (&codes)[kCount],
                                V8 (&bytes)[kBytes][kCount]) {
    for (std::size_t b = 0; b < kBytes; ++b)
      for (std::size_t quarter = 0; quarter < 4; ++quarter) {
        const uint8x16x4_t table = vld1q_u8_x4(tables[b].data() + 64 * quarter);
        for (std::size_t i = 0; i < kCount; ++i) {
          const uint8x16_t at = vsubq_u8(codes[i].raw, vdupq_n_u8(static_cast<std::uint8_t>(64 * quarter)));
          // An index beyond 64 bytes gives zero (tbl) or leaves the element unchanged (tbx).
          bytes[b][i] = V8(quarter == 0 ? vqtbl4q_u8(table, at) : vqtbx4q_u8(bytes[b][i].raw, table, at));
        }
      }
  }
  /// From the upper three bytes of each float.
  static HWY_INLINE Four floats(V8 first, V8 second, V8 third) {
    const D8 d;
    const D16 d16;
    const V8 zero = hn::Zero(d);
    const auto words = [d16](V8 v) HWY_ATTR { return hn::BitCast(d16, v); };
    const V16 upper[] = {words(hn::InterleaveLower(d, second, first)), words(hn::InterleaveUpper(d, second, first))};
    const V16 lower[] = {words(hn::InterleaveLower(d, zero, third)), words(hn::InterleaveUpper(d, zero, third))};
    const auto float_of = [](V16 v) HWY_ATTR { return hn::BitCast(DF(), v); };
    return {
        float_of(hn::InterleaveLower(d16, lower[0], upper[0])), float_of(hn::InterleaveUpper(d16, lower[0], upper[0])),
        float_of(hn::InterleaveLower(d16, lower[1], upper[1])), float_of(hn::InterleaveUpper(d16, lower[1], upper[1]))};
  }

  const CodeBytes<3>& linear_;
  const CodeBytes<2>& weight_;
};
#else
/// Looks up one code after another.
class CodeLookup {
 public:
  explicit CodeLookup(const CodeLut& lut) : linear_(lut.linear.data()), weight_(lut.weight.data()) {}
  template <std::size_t kCount>
  HWY_INLINE void linear(const V8 (&codes)[kCount], Four* const (&out)[kCount]) const {
    for (std::size_t i = 0; i < kCount; ++i) *out[i] = look_up(linear_, codes[i]);
  }
  HWY_INLINE Four weight(V8 codes) const { return look_up(weight_, codes); }

 private:
  static HWY_INLINE Four look_up(const float* table, V8 codes) {
    HWY_ALIGN std::uint8_t in[hn::MaxLanes(D8())];
    HWY_ALIGN float floats[hn::MaxLanes(D8())];
    hn::Store(codes, D8(), in);
    for (std::size_t i = 0; i < hn::Lanes(D8()); ++i) floats[i] = table[in[i]];
    Four out;
    for (std::size_t p = 0; p < kParts; ++p) out.part[p] = hn::Load(DF(), floats + p * hn::Lanes(DF()));
    return out;
  }

  const float* linear_;
  const float* weight_;
};
#endif

class Interleaved8 {
 public:
  using Sample = HWY_NAMESPACE::Sample;
  explicit Interleaved8(const CodeLut& lut) : lut_(lut) {}
  HWY_INLINE void load(const ExposureRow& row, std::size_t at, Sample& out) const {
    const std::uint8_t* from = row.at[0] + 3 * at;
    prefetch(from, row.ahead, 3 * hn::Lanes(D8()));
    V8 r, g, b;
    hn::LoadInterleaved3(D8(), from, r, g, b);
    look_up(r, g, b, hn::Max(r, hn::Max(g, b)), out);
  }

 protected:
  HWY_INLINE void look_up(V8 r, V8 g, V8 b, V8 top, Sample& out) const {
    out.weight = lut_.weight(top);
    lut_.linear({r, g, b}, {&out.r, &out.g, &out.b});
  }
  CodeLookup lut_;
};

class Linear8 {
 public:
  using Sample = HWY_NAMESPACE::Sample;
  explicit Linear8(const CodeLut& lut) : lut_(lut), from_(lut.linear[0]) {}
  HWY_INLINE void load(const ExposureRow& row, std::size_t at, Sample& out) const {
    const std::uint8_t* from = row.at[0] + 3 * at;
    prefetch(from, row.ahead, 3 * hn::Lanes(D8()));
    V8 r, g, b;
    hn::LoadInterleaved3(D8(), from, r, g, b);
    out.weight = lut_.weight(hn::Max(r, hn::Max(g, b)));
    out.r = linear(r);
    out.g = linear(g);
    out.b = linear(b);
  }

 private:
  HWY_INLINE Four linear(V8 codes) const {
    const hn::Half<D8> half;
    const hn::RepartitionToWide<D8> d16;
    const hn::Half<decltype(d16)> half16;
    const auto low = hn::PromoteTo(d16, hn::LowerHalf(half, codes)),
               high = hn::PromoteTo(d16, hn::UpperHalf(half, codes));
    const auto floats = [&](auto v16) HWY_ATTR {
      return hn::Add(hn::ConvertTo(DF(), hn::PromoteTo(DI32(), v16)), hn::Set(DF(), from_));
    };
    return {floats(hn::LowerHalf(half16, low)), floats(hn::UpperHalf(half16, low)), floats(hn::LowerHalf(half16, high)),
            floats(hn::UpperHalf(half16, high))};
  }

  CodeLookup lut_;
  float from_;
};

class Planes8 : public Interleaved8 {
 public:
  using Interleaved8::Interleaved8;
  HWY_INLINE void load(const ExposureRow& row, std::size_t at, Sample& out) const {
    const auto codes = [&](std::size_t plane) HWY_ATTR { return hn::LoadU(D8(), row.at[plane] + at); };
    look_up(codes(0), codes(1), codes(2), codes(3), out);
  }
};

class Mosaic8 : public Interleaved8 {
 public:
  using Interleaved8::Interleaved8;
  HWY_INLINE void load(const ExposureRow& row, std::size_t at, Sample& out) const {
    const D8 d;
    V8 red, green1, green2, blue;
    for (int y = 0; y < 2; ++y) prefetch(row.at[y] + 2 * at, row.ahead, 2 * hn::Lanes(d));
    hn::LoadInterleaved2(d, row.at[0] + 2 * at, red, green1);
    hn::LoadInterleaved2(d, row.at[1] + 2 * at, green2, blue);
    out.weight = lut_.weight(hn::Max(hn::Max(red, green1), hn::Max(green2, blue)));
    Four g1, g2;
    lut_.linear({red, blue, green1, green2}, {&out.r, &out.b, &g1, &g2});
    out.g = middle(g1, g2);
    out.top = largest(largest(out.r, out.b), largest(g1, g2));
  }
};

class Mosaic16 {
 public:
  using Sample = HWY_NAMESPACE::Sample;
  explicit Mosaic16(const CodeLut& lut) : lut_(lut), top_(static_cast<std::uint32_t>(lut.linear.size() - 1)) {}
  HWY_INLINE void load(const ExposureRow& row, std::size_t at, Sample& out) const {
    const D32 d;
    const auto top_code = hn::Set(d, top_);
    for (int y = 0; y < 2; ++y) prefetch(row.at[y] + 4 * at, row.ahead, 4 * hn::Lanes(D8()));
    for (std::size_t p = 0; p < kParts; ++p) {
      const std::size_t byte = 4 * (at + p * hn::Lanes(d));
      // An element of 32 bits contains two words of 16, the left one in the lower bits.
      const auto upper = hn::BitCast(d, hn::LoadU(D8(), row.at[0] + byte));
      const auto lower = hn::BitCast(d, hn::LoadU(D8(), row.at[1] + byte));
      const auto even = [&](hn::Vec<D32> v) HWY_ATTR { return hn::Min(hn::And(v, hn::Set(d, 0xFFFF)), top_code); };
      const auto odd = [&](hn::Vec<D32> v) HWY_ATTR { return hn::Min(hn::ShiftRight<16>(v), top_code); };
      const auto red = even(upper), green1 = odd(upper), green2 = even(lower), blue = odd(lower);
      const auto top = hn::Max(hn::Max(red, green1), hn::Max(green2, blue));
      out.r.part[p] = look_up(lut_.linear.data(), red);
      out.b.part[p] = look_up(lut_.linear.data(), blue);
      out.g.part[p] = hn::Mul(hn::Add(look_up(lut_.linear.data(), green1), look_up(lut_.linear.data(), green2)),
                              hn::Set(DF(), 0.5F));
      out.top.part[p] = look_up(lut_.linear.data(), top);
      out.weight.part[p] = look_up(lut_.weight.data(), top);
    }
  }

 private:
  static HWY_INLINE VF look_up(const float* table, hn::Vec<D32> codes) {
    return hn::GatherIndex(DF(), table, hn::BitCast(DI32(), codes));
  }

  const CodeLut& lut_;
  std::uint32_t top_;
};

}  // namespace HWY_NAMESPACE
}  // namespace lightwell::estimate
HWY_AFTER_NAMESPACE();

#endif
