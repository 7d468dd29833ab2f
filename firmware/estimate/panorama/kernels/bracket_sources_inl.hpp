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

HWY_BEFORE_NAMESPACE();
namespace lightwell::estimate {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using D8 = hn::ScalableTag<std::uint8_t>;
using D32 = hn::ScalableTag<std::uint32_t>;
using DI32 = hn::ScalableTag<std::int32_t>;
using DF = hn::ScalableTag<float>;
using V8 = hn::Vec<D8>;
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

/// Software prefetch: rows of many exposures are too many streams for the hardware prefetcher.
HWY_INLINE void prefetch(const void* at, std::ptrdiff_t ahead, std::size_t bytes) {
  // Integer arithmetic, because the address may be beyond the image.
  const std::uintptr_t from = reinterpret_cast<std::uintptr_t>(at) + static_cast<std::uintptr_t>(ahead);
  for (std::size_t i = 0; i < bytes; i += 64) __builtin_prefetch(reinterpret_cast<const void*>(from + i));
}

/// Linear values and weights of one exposure's pixels of a strip. `top`: linear value of the brightest of the four
/// sites of a mosaic's quad; unused for other formats.
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

struct Rgb8 {
  V8 r, g, b;
  HWY_INLINE Rgb8() {}
  HWY_INLINE Rgb8(V8 red, V8 green, V8 blue) : r(red), g(green), b(blue) {}
};

#if HWY_TARGET == HWY_AVX3_DL
// Byte shuffles hold a table of 256 bytes. Codes are permuted so that bytes, widened twice within 128-bit lanes, come
// out in the order of pixels.
struct Order {
  __m512i plain;
  __m512i first[3], second[3];  ///< Of interleaved r, g, b: from bytes 0 to 127 of 192, then from the last 64.

  Order() : Order([](unsigned i) { return 16 * (i % 16 / 4) + 4 * (i / 16) + i % 4; }) {}
  /// `place`: index of the pixel at byte i.
  template <class Place>
  explicit Order(Place&& place) {
    alignas(64) std::uint8_t index[64], low[3][64], high[3][64];
    for (unsigned i = 0; i < 64; ++i) {
      const unsigned from = place(i);
      index[i] = static_cast<std::uint8_t>(from);
      for (unsigned c = 0; c < 3; ++c) {
        const unsigned byte = 3 * from + c;
        low[c][i] = static_cast<std::uint8_t>(byte & 127);
        high[c][i] = static_cast<std::uint8_t>(byte < 128 ? i : 64 + (byte - 128));
      }
    }
    plain = _mm512_load_si512(index);
    for (int c = 0; c < 3; ++c) {
      first[c] = _mm512_load_si512(low[c]);
      second[c] = _mm512_load_si512(high[c]);
    }
  }
  HWY_INLINE V8 operator()(V8 v) const { return V8{_mm512_permutexvar_epi8(plain, v.raw)}; }
  HWY_INLINE Rgb8 interleaved(const std::uint8_t* at) const {
    const __m512i a = _mm512_loadu_si512(at), b = _mm512_loadu_si512(at + 64), c = _mm512_loadu_si512(at + 128);
    const auto channel = [&](int k) HWY_ATTR {
      return V8{_mm512_permutex2var_epi8(_mm512_permutex2var_epi8(a, first[k], b), second[k], c)};
    };
    return {channel(0), channel(1), channel(2)};
  }
};

/// The order of LinearCodes, and the permutation from it to Order.
struct LinearOrder : Order {
  __m512i shuffle;
  LinearOrder() : Order([](unsigned i) { return 16 * (i % 4) + i / 4; }) {
    alignas(64) std::uint8_t index[64];
    // Order has pixel 16 p + 4 l + i at byte 16 l + 4 p + i.
    for (unsigned at = 0; at < 64; ++at) {
      const unsigned pixel = 16 * (at % 16 / 4) + 4 * (at / 16) + at % 4;
      index[at] = static_cast<std::uint8_t>(4 * (pixel % 16) + pixel / 16);
    }
    shuffle = _mm512_load_si512(index);
  }
  HWY_INLINE V8 across(V8 v) const { return V8{_mm512_permutexvar_epi8(shuffle, v.raw)}; }
};

class CodeLookup {
 public:
  explicit CodeLookup(const CodeLut& lut) : lut_(lut) {}
  HWY_INLINE Four linear(V8 codes) const {
    const __mmask64 high = _mm512_movepi8_mask(codes.raw);
    const __m512i zero = _mm512_setzero_si512();
    const __m512i b1 = bytes(lut_.linear_bytes[0].data(), codes.raw, high);
    const __m512i b2 = bytes(lut_.linear_bytes[1].data(), codes.raw, high);
    const __m512i b3 = bytes(lut_.linear_bytes[2].data(), codes.raw, high);
    return floats(_mm512_unpacklo_epi8(zero, b1), _mm512_unpackhi_epi8(zero, b1), _mm512_unpacklo_epi8(b2, b3),
                  _mm512_unpackhi_epi8(b2, b3));
  }
  HWY_INLINE Four weight(V8 codes) const {
    const __mmask64 high = _mm512_movepi8_mask(codes.raw);
    const __m512i zero = _mm512_setzero_si512();
    const __m512i b2 = bytes(lut_.weight_bytes[0].data(), codes.raw, high);
    const __m512i b3 = bytes(lut_.weight_bytes[1].data(), codes.raw, high);
    return floats(zero, zero, _mm512_unpacklo_epi8(b2, b3), _mm512_unpackhi_epi8(b2, b3));
  }

 private:
  static HWY_INLINE __m512i bytes(const std::uint8_t* table, __m512i codes, __mmask64 high) {
    const __m512i below = _mm512_permutex2var_epi8(_mm512_load_si512(table), codes, _mm512_load_si512(table + 64));
    const __m512i above =
        _mm512_permutex2var_epi8(_mm512_load_si512(table + 128), codes, _mm512_load_si512(table + 192));
    return _mm512_mask_blend_epi8(high, below, above);
  }
  static HWY_INLINE Four floats(__m512i low01, __m512i high01, __m512i low23, __m512i high23) {
    return {VF{_mm512_castsi512_ps(_mm512_unpacklo_epi16(low01, low23))},
            VF{_mm512_castsi512_ps(_mm512_unpackhi_epi16(low01, low23))},
            VF{_mm512_castsi512_ps(_mm512_unpacklo_epi16(high01, high23))},
            VF{_mm512_castsi512_ps(_mm512_unpackhi_epi16(high01, high23))}};
  }

  const CodeLut& lut_;
};
#else
struct Order {
  HWY_INLINE V8 operator()(V8 v) const { return v; }
  HWY_INLINE V8 across(V8 v) const { return v; }
  HWY_INLINE Rgb8 interleaved(const std::uint8_t* at) const {
    Rgb8 out;
    hn::LoadInterleaved3(D8(), at, out.r, out.g, out.b);
    return out;
  }
};
using LinearOrder = Order;

class CodeLookup {
 public:
  explicit CodeLookup(const CodeLut& lut) : linear_(lut.linear.data()), weight_(lut.weight.data()) {}
  HWY_INLINE Four linear(V8 codes) const { return look_up(linear_, codes); }
  HWY_INLINE Four weight(V8 codes) const { return look_up(weight_, codes); }

 private:
  static HWY_INLINE Four look_up(const float* table, V8 codes) {
#if HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_AVX3
    const hn::Half<D8> half;
    const hn::RepartitionToWide<D8> d16;
    const hn::Half<decltype(d16)> half16;
    Four out;
    const auto low = hn::PromoteTo(d16, hn::LowerHalf(half, codes)),
               high = hn::PromoteTo(d16, hn::UpperHalf(half, codes));
    const auto gather = [&](auto v16) HWY_ATTR { return hn::GatherIndex(DF(), table, hn::PromoteTo(DI32(), v16)); };
    out.part[0] = gather(hn::LowerHalf(half16, low));
    out.part[1] = gather(hn::UpperHalf(half16, low));
    out.part[2] = gather(hn::LowerHalf(half16, high));
    out.part[3] = gather(hn::UpperHalf(half16, high));
    return out;
#else
    // No efficient gather instruction.
    HWY_ALIGN std::uint8_t in[hn::MaxLanes(D8())];
    HWY_ALIGN float floats[hn::MaxLanes(D8())];
    hn::Store(codes, D8(), in);
    for (std::size_t i = 0; i < hn::Lanes(D8()); ++i) floats[i] = table[in[i]];
    Four out;
    for (std::size_t p = 0; p < kParts; ++p) out.part[p] = hn::Load(DF(), floats + p * hn::Lanes(DF()));
    return out;
#endif
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
    load(order_.interleaved(from), out);
  }

 protected:
  HWY_INLINE void load(const Rgb8& codes, Sample& out) const {
    load(codes, hn::Max(codes.r, hn::Max(codes.g, codes.b)), out);
  }
  HWY_INLINE void load(const Rgb8& codes, V8 top, Sample& out) const {
    out.weight = lut_.weight(top);
    out.r = lut_.linear(codes.r);
    out.g = lut_.linear(codes.g);
    out.b = lut_.linear(codes.b);
  }
  Order order_;
  CodeLookup lut_;
};

#if HWY_TARGET == HWY_AVX3_DL
/// Linear codes: byte p of each 32-bit element belongs to part p, so that codes are widened only when used.
class LinearCodes {
 public:
  HWY_INLINE LinearCodes() {}
  void load(V8 codes, float from) {
    codes_ = codes;
    from_ = from;
  }
  HWY_INLINE VF at(std::size_t p) const {
    const D32 d;
    const auto code = hn::And(
        hn::Vec<D32>{_mm512_srl_epi32(codes_.raw, _mm_cvtsi64_si128(static_cast<long long>(8 * p)))}, hn::Set(d, 255));
    return hn::Add(hn::ConvertTo(DF(), hn::BitCast(DI32(), code)), hn::Set(DF(), from_));
  }

 private:
  V8 codes_;
  float from_;
};
#else
class LinearCodes {
 public:
  HWY_INLINE LinearCodes() {}
  HWY_INLINE void load(V8 codes, float from) {
    const hn::Half<D8> half;
    const hn::RepartitionToWide<D8> d16;
    const hn::Half<decltype(d16)> half16;
    const auto low = hn::PromoteTo(d16, hn::LowerHalf(half, codes)),
               high = hn::PromoteTo(d16, hn::UpperHalf(half, codes));
    const auto floats = [&](auto v16) HWY_ATTR {
      return hn::Add(hn::ConvertTo(DF(), hn::PromoteTo(DI32(), v16)), hn::Set(DF(), from));
    };
    values_ = {floats(hn::LowerHalf(half16, low)), floats(hn::UpperHalf(half16, low)),
               floats(hn::LowerHalf(half16, high)), floats(hn::UpperHalf(half16, high))};
  }
  HWY_INLINE VF at(std::size_t p) const { return values_.part[p]; }

 private:
  Four values_;
};
#endif

class Linear8 {
 public:
  struct Sample {
    LinearCodes r, g, b;
    Four weight, top;
    HWY_INLINE Sample() {}
  };
  explicit Linear8(const CodeLut& lut) : lut_(lut), from_(lut.linear[0]) {}
  HWY_INLINE void load(const ExposureRow& row, std::size_t at, Sample& out) const {
    const std::uint8_t* from = row.at[0] + 3 * at;
    prefetch(from, row.ahead, 3 * hn::Lanes(D8()));
    const Rgb8 codes = order_.interleaved(from);
    out.weight = lut_.weight(order_.across(hn::Max(codes.r, hn::Max(codes.g, codes.b))));
    out.r.load(codes.r, from_);
    out.g.load(codes.g, from_);
    out.b.load(codes.b, from_);
  }

 private:
  LinearOrder order_;
  CodeLookup lut_;
  float from_;
};

class Planes8 : public Interleaved8 {
 public:
  using Interleaved8::Interleaved8;
  HWY_INLINE void load(const ExposureRow& row, std::size_t at, Sample& out) const {
    const D8 d;
    const auto codes = [&](std::size_t plane) HWY_ATTR { return order_(hn::LoadU(d, row.at[plane] + at)); };
    Interleaved8::load(Rgb8{codes(0), codes(1), codes(2)}, codes(3), out);
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
    red = order_(red), green1 = order_(green1), green2 = order_(green2), blue = order_(blue);
    out.weight = lut_.weight(hn::Max(hn::Max(red, green1), hn::Max(green2, blue)));
    out.r = lut_.linear(red);
    out.b = lut_.linear(blue);
    const Four g1 = lut_.linear(green1), g2 = lut_.linear(green2);
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
