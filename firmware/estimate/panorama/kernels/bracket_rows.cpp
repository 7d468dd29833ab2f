#include "estimate/panorama/kernels/bracket_rows.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "estimate/panorama/kernels/bracket_rows.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, says Highway.
#include <hwy/highway.h>

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

/// A strip is one vector of 8-bit codes, four of floats.
constexpr std::size_t kParts = 4;
/// What is saturated tells "at least": an exposure that sees less than this part of it saw something else.
constexpr float kContradiction = 0.5F;

// Constructors are written out where vectors are members: GCC gives implicit ones no target of their own.
struct Four {
  VF part[kParts];
  HWY_INLINE Four() {}
  HWY_INLINE Four(VF a, VF b, VF c, VF d) : part{a, b, c, d} {}
  HWY_INLINE VF at(std::size_t p) const { return part[p]; }
};

/// Rows of many exposures are too many streams, each too short, for the processor to foresee.
HWY_INLINE void fetch(const void* at, std::ptrdiff_t ahead, std::size_t bytes) {
  // As a number: what it points at may lie beyond the picture.
  const std::uintptr_t from = reinterpret_cast<std::uintptr_t>(at) + static_cast<std::uintptr_t>(ahead);
  for (std::size_t i = 0; i < bytes; i += 64) __builtin_prefetch(reinterpret_cast<const void*>(from + i));
}

/// Linear values and weight of one exposure's pixels of a strip, as they wait in memory. `top` is that of the brightest of
/// the four sites of a mosaic's quad, and not used elsewhere.
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
// All 256 entries of a byte's table fit the shuffles. Codes are put in the order in which bytes, widened twice within
// 128 bits, come out one after another.
struct Order {
  __m512i plain;
  __m512i first[3], second[3];  ///< Of interleaved r, g, b: from bytes 0 to 127 of 192, then from the last 64.

  Order() : Order([](unsigned i) { return 16 * (i % 16 / 4) + 4 * (i / 16) + i % 4; }) {}
  /// `place`: which pixel stands at byte i.
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

/// The order of LinearCodes, and from there to the other.
struct LinearOrder : Order {
  __m512i shuffle;
  LinearOrder() : Order([](unsigned i) { return 16 * (i % 4) + i / 4; }) {
    alignas(64) std::uint8_t index[64];
    // The other has pixel 16 p + 4 l + i at byte 16 l + 4 p + i.
    for (unsigned at = 0; at < 64; ++at) {
      const unsigned pixel = 16 * (at % 16 / 4) + 4 * (at / 16) + at % 4;
      index[at] = static_cast<std::uint8_t>(4 * (pixel % 16) + pixel / 16);
    }
    shuffle = _mm512_load_si512(index);
  }
  HWY_INLINE V8 across(V8 v) const { return V8{_mm512_permutexvar_epi8(shuffle, v.raw)}; }
};

class Worth {
 public:
  explicit Worth(const CodeWorth& worth) : worth_(worth) {}
  HWY_INLINE Four linear(V8 codes) const {
    const __mmask64 high = _mm512_movepi8_mask(codes.raw);
    const __m512i zero = _mm512_setzero_si512();
    const __m512i b1 = bytes(worth_.linear_bytes[0].data(), codes.raw, high);
    const __m512i b2 = bytes(worth_.linear_bytes[1].data(), codes.raw, high);
    const __m512i b3 = bytes(worth_.linear_bytes[2].data(), codes.raw, high);
    return floats(_mm512_unpacklo_epi8(zero, b1), _mm512_unpackhi_epi8(zero, b1), _mm512_unpacklo_epi8(b2, b3),
                  _mm512_unpackhi_epi8(b2, b3));
  }
  HWY_INLINE Four weight(V8 codes) const {
    const __mmask64 high = _mm512_movepi8_mask(codes.raw);
    const __m512i zero = _mm512_setzero_si512();
    const __m512i b2 = bytes(worth_.weight_bytes[0].data(), codes.raw, high);
    const __m512i b3 = bytes(worth_.weight_bytes[1].data(), codes.raw, high);
    return floats(zero, zero, _mm512_unpacklo_epi8(b2, b3), _mm512_unpackhi_epi8(b2, b3));
  }

 private:
  static HWY_INLINE __m512i bytes(const std::uint8_t* table, __m512i codes, __mmask64 high) {
    const __m512i below = _mm512_permutex2var_epi8(_mm512_load_si512(table), codes, _mm512_load_si512(table + 64));
    const __m512i above = _mm512_permutex2var_epi8(_mm512_load_si512(table + 128), codes, _mm512_load_si512(table + 192));
    return _mm512_mask_blend_epi8(high, below, above);
  }
  static HWY_INLINE Four floats(__m512i low01, __m512i high01, __m512i low23, __m512i high23) {
    return {VF{_mm512_castsi512_ps(_mm512_unpacklo_epi16(low01, low23))},
             VF{_mm512_castsi512_ps(_mm512_unpackhi_epi16(low01, low23))},
             VF{_mm512_castsi512_ps(_mm512_unpacklo_epi16(high01, high23))},
             VF{_mm512_castsi512_ps(_mm512_unpackhi_epi16(high01, high23))}};
  }

  const CodeWorth& worth_;
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

class Worth {
 public:
  explicit Worth(const CodeWorth& worth) : linear_(worth.linear.data()), weight_(worth.weight.data()) {}
  HWY_INLINE Four linear(V8 codes) const { return looked_up(linear_, codes); }
  HWY_INLINE Four weight(V8 codes) const { return looked_up(weight_, codes); }

 private:
  static HWY_INLINE Four looked_up(const float* table, V8 codes) {
#if HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_AVX3
    const hn::Half<D8> half;
    const hn::RepartitionToWide<D8> d16;
    const hn::Half<decltype(d16)> half16;
    Four out;
    const auto low = hn::PromoteTo(d16, hn::LowerHalf(half, codes)), high = hn::PromoteTo(d16, hn::UpperHalf(half, codes));
    const auto gather = [&](auto v16) HWY_ATTR { return hn::GatherIndex(DF(), table, hn::PromoteTo(DI32(), v16)); };
    out.part[0] = gather(hn::LowerHalf(half16, low));
    out.part[1] = gather(hn::UpperHalf(half16, low));
    out.part[2] = gather(hn::LowerHalf(half16, high));
    out.part[3] = gather(hn::UpperHalf(half16, high));
    return out;
#else
    // No gather to speak of.
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
  explicit Interleaved8(const CodeWorth& worth) : worth_(worth) {}
  HWY_INLINE void load(const ExposureRow& row, std::size_t at, Sample& out) const {
    const std::uint8_t* from = row.at[0] + 3 * at;
    fetch(from, row.ahead, 3 * hn::Lanes(D8()));
    load(order_.interleaved(from), out);
  }

 protected:
  HWY_INLINE void load(const Rgb8& codes, Sample& out) const {
    load(codes, hn::Max(codes.r, hn::Max(codes.g, codes.b)), out);
  }
  HWY_INLINE void load(const Rgb8& codes, V8 top, Sample& out) const {
    out.weight = worth_.weight(top);
    out.r = worth_.linear(codes.r);
    out.g = worth_.linear(codes.g);
    out.b = worth_.linear(codes.b);
  }
  Order order_;
  Worth worth_;
};

#if HWY_TARGET == HWY_AVX3_DL
/// Linear codes: byte p of each 32 bits belongs to part p, so that they need not be widened before they are used.
class LinearCodes {
 public:
  HWY_INLINE LinearCodes() {}
  void load(V8 codes, float from) {
    codes_ = codes;
    from_ = from;
  }
  HWY_INLINE VF at(std::size_t p) const {
    const D32 d;
    const auto code = hn::And(hn::Vec<D32>{_mm512_srl_epi32(codes_.raw, _mm_cvtsi64_si128(static_cast<long long>(8 * p)))}, hn::Set(d, 255));
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
    const auto low = hn::PromoteTo(d16, hn::LowerHalf(half, codes)), high = hn::PromoteTo(d16, hn::UpperHalf(half, codes));
    const auto floats = [&](auto v16) HWY_ATTR {
      return hn::Add(hn::ConvertTo(DF(), hn::PromoteTo(DI32(), v16)), hn::Set(DF(), from));
    };
    values_ = {floats(hn::LowerHalf(half16, low)), floats(hn::UpperHalf(half16, low)), floats(hn::LowerHalf(half16, high)),
                floats(hn::UpperHalf(half16, high))};
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
  explicit Linear8(const CodeWorth& worth) : worth_(worth), from_(worth.linear[0]) {}
  HWY_INLINE void load(const ExposureRow& row, std::size_t at, Sample& out) const {
    const std::uint8_t* from = row.at[0] + 3 * at;
    fetch(from, row.ahead, 3 * hn::Lanes(D8()));
    const Rgb8 codes = order_.interleaved(from);
    out.weight = worth_.weight(order_.across(hn::Max(codes.r, hn::Max(codes.g, codes.b))));
    out.r.load(codes.r, from_);
    out.g.load(codes.g, from_);
    out.b.load(codes.b, from_);
  }

 private:
  LinearOrder order_;
  Worth worth_;
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
    for (int y = 0; y < 2; ++y) fetch(row.at[y] + 2 * at, row.ahead, 2 * hn::Lanes(d));
    hn::LoadInterleaved2(d, row.at[0] + 2 * at, red, green1);
    hn::LoadInterleaved2(d, row.at[1] + 2 * at, green2, blue);
    red = order_(red), green1 = order_(green1), green2 = order_(green2), blue = order_(blue);
    out.weight = worth_.weight(hn::Max(hn::Max(red, green1), hn::Max(green2, blue)));
    out.r = worth_.linear(red);
    out.b = worth_.linear(blue);
    const Four g1 = worth_.linear(green1), g2 = worth_.linear(green2);
    out.g = middle(g1, g2);
    out.top = largest(largest(out.r, out.b), largest(g1, g2));
  }
};

class Mosaic16 {
 public:
  using Sample = HWY_NAMESPACE::Sample;
  explicit Mosaic16(const CodeWorth& worth) : worth_(worth), top_(static_cast<std::uint32_t>(worth.linear.size() - 1)) {}
  HWY_INLINE void load(const ExposureRow& row, std::size_t at, Sample& out) const {
    const D32 d;
    const auto top_code = hn::Set(d, top_);
    for (int y = 0; y < 2; ++y) fetch(row.at[y] + 4 * at, row.ahead, 4 * hn::Lanes(D8()));
    for (std::size_t p = 0; p < kParts; ++p) {
      const std::size_t byte = 4 * (at + p * hn::Lanes(d));
      // Two words of 16 bits, the lower first, are one of 32.
      const auto upper = hn::BitCast(d, hn::LoadU(D8(), row.at[0] + byte));
      const auto lower = hn::BitCast(d, hn::LoadU(D8(), row.at[1] + byte));
      const auto even = [&](hn::Vec<D32> v) HWY_ATTR { return hn::Min(hn::And(v, hn::Set(d, 0xFFFF)), top_code); };
      const auto odd = [&](hn::Vec<D32> v) HWY_ATTR { return hn::Min(hn::ShiftRight<16>(v), top_code); };
      const auto red = even(upper), green1 = odd(upper), green2 = even(lower), blue = odd(lower);
      const auto top = hn::Max(hn::Max(red, green1), hn::Max(green2, blue));
      out.r.part[p] = look_up(worth_.linear.data(), red);
      out.b.part[p] = look_up(worth_.linear.data(), blue);
      out.g.part[p] = hn::Mul(hn::Add(look_up(worth_.linear.data(), green1), look_up(worth_.linear.data(), green2)),
                              hn::Set(DF(), 0.5F));
      out.top.part[p] = look_up(worth_.linear.data(), top);
      out.weight.part[p] = look_up(worth_.weight.data(), top);
    }
  }

 private:
  static HWY_INLINE VF look_up(const float* table, hn::Vec<D32> codes) {
    return hn::GatherIndex(DF(), table, hn::BitCast(DI32(), codes));
  }

  const CodeWorth& worth_;
  std::uint32_t top_;
};

/// What the pixels of a part see.
struct Seen {
  VF weight;       ///< Solid angle times inverse vignetting.
  VF solid_angle;
  VF brighten;     ///< Inverse vignetting.
};

template <bool kQuads>
HWY_INLINE Seen seen_at(const BracketRow& row, std::size_t at) {
  const DF d;
  if constexpr (!kQuads) {
    const VF sr = hn::LoadU(d, row.solid_angle + at), brighten = hn::LoadU(d, row.inverse_vignetting + at);
    return {hn::Mul(sr, brighten), sr, brighten};
  } else {
    Seen sum{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
    for (std::size_t y = 0; y < 2; ++y) {
      VF sr0, sr1, b0, b1;
      hn::LoadInterleaved2(d, row.solid_angle + y * row.next_row + 2 * at, sr0, sr1);
      hn::LoadInterleaved2(d, row.inverse_vignetting + y * row.next_row + 2 * at, b0, b1);
      sum.weight = hn::MulAdd(sr1, b1, hn::MulAdd(sr0, b0, sum.weight));
      sum.solid_angle = hn::Add(sum.solid_angle, hn::Add(sr0, sr1));
    }
    // The mean over what sees something.
    sum.brighten = hn::Div(sum.weight, hn::Max(sum.solid_angle, hn::Set(d, 1e-30F)));
    return sum;
  }
}

HWY_INLINE void add_to(float* to, VF v) { hn::StoreU(hn::Add(hn::LoadU(DF(), to), v), DF(), to); }

/// A row's numbers beside what they are multiplied with: copies, as what is stored to memory might change the originals.
struct Constants {
  float scale[kMaxBracket], inverse[kMaxBracket], deviations[kMaxBracket], at_least[kMaxBracket];
  float hidden, hidden_until, depth, share, luminance[3];

  explicit Constants(const BracketRow& row)
      : hidden(row.worth->hidden), hidden_until(row.worth->hidden_until), depth(row.depth), share(row.share),
        luminance{row.luminance[0], row.luminance[1], row.luminance[2]} {
    for (int k = 0; k < row.count; ++k) {
      scale[k] = row.exposures[static_cast<std::size_t>(k)].scale;
      inverse[k] = 1 / scale[k];
      deviations[k] = row.deviations * scale[k];
      at_least[k] = row.worth->saturated_linear * scale[k];
    }
  }
};

/// What a part comes to, still to be divided by the weight.
struct Merged {
  VF r, g, b, weight, bias;
};

/// Saturated in every exposure: the highest of what they tell is a bound from below.
template <class AnySample>
HWY_NOINLINE Merged bound_clipped(const BracketRow& row, const AnySample* samples, std::size_t p, Merged m) {
  const DF d;
  const auto clipped = hn::Eq(m.weight, hn::Zero(d));
  VF r = hn::Zero(d), g = r, b = r;
  for (int k = 0; k < row.count; ++k) {
    const VF scale = hn::Set(d, row.exposures[static_cast<std::size_t>(k)].scale);
    r = hn::Max(r, hn::Mul(samples[k].r.at(p), scale));
    g = hn::Max(g, hn::Mul(samples[k].g.at(p), scale));
    b = hn::Max(b, hn::Mul(samples[k].b.at(p), scale));
  }
  m.r = hn::IfThenElse(clipped, r, m.r);
  m.g = hn::IfThenElse(clipped, g, m.g);
  m.b = hn::IfThenElse(clipped, b, m.b);
  m.bias = hn::IfThenZeroElse(clipped, m.bias);
  return m;
}

template <bool kQuads, class AnySample>
HWY_INLINE void merge_part(const BracketRow& row, const Constants& c, const BracketColumns& out, const AnySample* samples,
                           int count, std::size_t p, std::size_t at, const Seen& seen) {
  const DF d;
  const D32 d32;
  const VF zero = hn::Zero(d);
  Merged m{zero, zero, zero, zero, zero};
  VF light_before = zero, deviation_before = zero;
  auto told_before = hn::Eq(zero, hn::Set(d, 1.0F));
  for (int k = 0; k < count; ++k) {
    const AnySample& s = samples[k];
    const VF r = s.r.at(p), g = s.g.at(p), b = s.b.at(p), weight = s.weight.at(p);
    // Of the radiance x * scale the variance is scale² / weight: the weight of x is weight / scale.
    const VF inverse = hn::Set(d, c.inverse[k]), of_x = hn::Mul(weight, inverse);
    m.r = hn::MulAdd(of_x, r, m.r);
    m.g = hn::MulAdd(of_x, g, m.g);
    m.b = hn::MulAdd(of_x, b, m.b);
    m.weight = hn::MulAdd(of_x, inverse, m.weight);
    const auto dark = hn::Lt(g, hn::Set(d, c.hidden_until));
    m.bias = hn::IfThenElse(dark, hn::MulAdd(of_x, hn::Set(d, c.hidden), m.bias), m.bias);

    const VF light = hn::Mul(kQuads ? s.top.part[p] : hn::Max(r, hn::Max(g, b)), hn::Set(d, c.scale[k]));
    // 1 / sqrt(weight) to 4 %, and finite where the weight is zero (Lomont 2003).
    const VF root = hn::BitCast(d, hn::Sub(hn::Set(d32, 0x5F375A86), hn::ShiftRight<1>(hn::BitCast(d32, weight))));
    const VF deviation = hn::Mul(root, hn::Set(d, c.deviations[k]));
    const auto told = hn::Gt(weight, zero);
    if (k > 0) {
      const auto both = hn::And(told, told_before);
      VF differ = hn::Sub(light_before, light);
      VF doubt = hn::MulAdd(hn::Set(d, c.share), light, hn::Add(deviation_before, deviation));
      if (!hn::AllTrue(d, both)) {
        // Where one is saturated it says "at least": twice the deviations of the other keep a noisy pixel from being taken
        // for a dark one.
        const VF at_least = hn::IfThenElse(told, hn::Set(d, c.at_least[k - 1]), hn::Set(d, c.at_least[k]));
        const VF lone = hn::MulAdd(hn::Set(d, 2.0F), hn::IfThenElse(told, deviation, deviation_before),
                                   hn::IfThenElse(told, light, light_before));
        // What does not count because it shares its colour with something saturated says nothing.
        const auto bright = hn::Ge(hn::IfThenElse(told, light_before, light), hn::Mul(hn::Set(d, 0.99F), at_least));
        const auto contradicts = hn::And(hn::And(hn::Xor(told, told_before), bright),
                                         hn::Lt(lone, hn::Mul(hn::Set(d, kContradiction), at_least)));
        const VF bounded =
            hn::Sub(hn::IfThenElse(told_before, light_before, at_least), hn::IfThenElse(told, light, at_least));
        differ = hn::IfThenElse(both, differ, hn::IfThenElseZero(contradicts, bounded));
        doubt = hn::IfThenElseZero(both, doubt);
      }
      add_to(out.differ[static_cast<std::size_t>(k - 1)] + at, differ);
      add_to(out.doubt[static_cast<std::size_t>(k - 1)] + at, doubt);
    }
    told_before = told;
    light_before = light;
    deviation_before = deviation;
  }

  const auto clipped = hn::Eq(m.weight, zero);
  VF variance;
  if (HWY_UNLIKELY(!hn::AllFalse(d, clipped))) {
    m = bound_clipped(row, samples, p, m);
    variance = hn::IfThenZeroElse(clipped, hn::Div(hn::Set(d, 1.0F), m.weight));
    m.weight = hn::IfThenElse(clipped, hn::Set(d, 1.0F), m.weight);
    add_to(out.clipped + at, hn::IfThenElseZero(clipped, seen.solid_angle));
  } else {
    variance = hn::Div(hn::Set(d, 1.0F), m.weight);
  }
  const VF whole = hn::Or(variance, hn::IfThenElseZero(clipped, hn::Set(d, 1.0F)));
  const VF share = hn::Mul(seen.weight, whole);
  add_to(out.r + at, hn::Mul(m.r, share));
  add_to(out.g + at, hn::Mul(m.g, share));
  add_to(out.b + at, hn::Mul(m.b, share));
  const VF light = hn::MulAdd(hn::Set(d, c.luminance[0]), m.r,
                              hn::MulAdd(hn::Set(d, c.luminance[1]), m.g, hn::Mul(hn::Set(d, c.luminance[2]), m.b)));
  add_to(out.low + at, hn::Mul(hn::Mul(light, share), hn::Set(d, c.depth)));
  add_to(out.bias + at, hn::Mul(m.bias, share));
  // Each of a quad's pixels counts for itself.
  const VF square = hn::Mul(hn::Mul(seen.weight, seen.weight), variance);
  add_to(out.noise + at, kQuads ? hn::Mul(square, hn::Set(d, 0.25F)) : square);
  const VF bright = hn::IfThenElseZero(hn::Gt(seen.weight, zero), hn::Mul(hn::Mul(light, whole), seen.brighten));
  hn::StoreU(hn::Max(hn::LoadU(d, out.peak + at), bright), d, out.peak + at);
}

template <class Source, bool kQuads>
HWY_INLINE void merge_rows(const BracketRow& row, std::size_t begin, std::size_t end, std::size_t readable_end,
                           const BracketColumns& columns) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d), n = kParts * lanes;
  const Constants constants(row);
  const BracketColumns out = columns;
  const Source source(*row.worth);
  const int count = row.count;
  typename Source::Sample samples[kMaxBracket];
  for (std::size_t from = begin; from < end; from += n) {
    // The last strip is shifted back where there is nothing to be read beyond it.
    const std::size_t at = from + n <= readable_end ? from : readable_end - n;
    for (int k = 0; k < count; ++k) source.load(row.exposures[static_cast<std::size_t>(k)], at, samples[k]);
    for (std::size_t p = 0; p < kParts; ++p) {
      const std::size_t part = at + p * lanes;
      Seen seen = seen_at<kQuads>(row, part);
      for (std::size_t y = 0; y < (kQuads ? 2 : 1); ++y) {
        const std::size_t first = (kQuads ? 2 : 1) * part + y * row.next_row, bytes = (kQuads ? 2 : 1) * sizeof(float) * lanes;
        fetch(row.solid_angle + first, row.ahead, bytes);
        fetch(row.inverse_vignetting + first, row.ahead, bytes);
      }
      if (at < from || at + n > end) {
        const VF place = hn::Iota(d, static_cast<float>(part));
        const auto wanted = hn::And(hn::Ge(place, hn::Set(d, static_cast<float>(from))),
                                    hn::Lt(place, hn::Set(d, static_cast<float>(end))));
        seen.weight = hn::IfThenElseZero(wanted, seen.weight);
        seen.solid_angle = hn::IfThenElseZero(wanted, seen.solid_angle);
      }
      merge_part<kQuads>(row, constants, out, samples, count, p, part, seen);
    }
  }
}

void MergeRow(const BracketRow& row, std::size_t begin, std::size_t end, std::size_t readable_end,
              const BracketColumns& out) {
  switch (row.source) {
    case BracketSource::interleaved8: merge_rows<Interleaved8, false>(row, begin, end, readable_end, out); return;
    case BracketSource::linear8: merge_rows<Linear8, false>(row, begin, end, readable_end, out); return;
    case BracketSource::planes8: merge_rows<Planes8, false>(row, begin, end, readable_end, out); return;
    case BracketSource::mosaic8: merge_rows<Mosaic8, true>(row, begin, end, readable_end, out); return;
    case BracketSource::mosaic16: merge_rows<Mosaic16, true>(row, begin, end, readable_end, out); return;
  }
}

HWY_INLINE V8 top_of(const Planes& row, std::size_t at) {
  const D8 d;
  return hn::Max(hn::LoadU(d, row[0] + at), hn::Max(hn::LoadU(d, row[1] + at), hn::LoadU(d, row[2] + at)));
}

void SharedTops(const Planes& row, const Planes* below, std::size_t pixels, unsigned saturated_from, std::uint8_t* out,
                std::uint8_t* out_below) {
  const D8 d;
  const hn::RepartitionToWide<D8> d16;
  const std::size_t n = hn::Lanes(d);
  const V8 limit = hn::Set(d, static_cast<std::uint8_t>(saturated_from < 255 ? saturated_from : 255));
  for (std::size_t from = 0; from < pixels; from += n) {
    const std::size_t at = from + n <= pixels ? from : pixels - n;
    const V8 own = top_of(row, at), lower = below == nullptr ? own : top_of(*below, at);
    const V8 most = hn::Max(own, lower);
    const auto pair = hn::BitCast(d16, most);
    const V8 beside = hn::BitCast(d, hn::Or(hn::ShiftLeft<8>(pair), hn::ShiftRight<8>(pair)));
    const V8 shared = hn::Max(most, beside);
    const auto wrong = hn::Eq(hn::Max(shared, limit), shared);
    const V8 full = hn::Set(d, 255);
    hn::StoreU(hn::IfThenElse(wrong, full, own), d, out + at);
    if (below != nullptr) hn::StoreU(hn::IfThenElse(wrong, full, lower), d, out_below + at);
  }
}

/// Neighbours are added, and again, until a block is one column.
template <class Join>
HWY_INLINE void fold(float* columns, std::size_t count, std::size_t edge, Join&& join) {
  const DF d;
  for (std::size_t width = 1; width < edge; width *= 2) {
    count /= 2;
    for (std::size_t to = 0; to < count; to += hn::Lanes(d)) {
      VF even, odd;
      hn::LoadInterleaved2(d, columns + 2 * to, even, odd);
      hn::StoreU(join(even, odd), d, columns + to);
    }
  }
}

void FoldColumns(const BracketColumns& columns, int pairs, const std::array<float, 3>& luminance, std::size_t first,
                 int edge, std::size_t blocks, const FoldedColumns& out) {
  const DF d;
  const std::size_t width = static_cast<std::size_t>(edge), count = blocks * width;
  float* light = out.luminance + first;
  float* across = out.across + first;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const VF r = hn::LoadU(d, columns.r + first + i), g = hn::LoadU(d, columns.g + first + i), b = hn::LoadU(d, columns.b + first + i);
    hn::StoreU(hn::MulAdd(hn::Set(d, luminance[0]), r, hn::MulAdd(hn::Set(d, luminance[1]), g, hn::Mul(hn::Set(d, luminance[2]), b))),
               d, light + i);
    hn::StoreU(hn::Zero(d), d, across + i);
  }
  std::size_t left = count;
  for (std::size_t step = 1; step < width; step *= 2) {
    left /= 2;
    for (std::size_t to = 0; to < left; to += hn::Lanes(d)) {
      VF even, odd, light_even, light_odd;
      hn::LoadInterleaved2(d, across + 2 * to, even, odd);
      hn::LoadInterleaved2(d, light + 2 * to, light_even, light_odd);
      hn::StoreU(hn::MulAdd(hn::Set(d, static_cast<float>(step)), light_odd, hn::Add(even, odd)), d, across + to);
      hn::StoreU(hn::Add(light_even, light_odd), d, light + to);
    }
  }
  const auto add = [](VF a, VF b) HWY_ATTR { return hn::Add(a, b); };
  for (float* column : {columns.r, columns.g, columns.b, columns.low, columns.noise, columns.bias, columns.clipped})
    fold(column + first, count, width, add);
  for (std::size_t k = 0; k < static_cast<std::size_t>(pairs); ++k) {
    fold(columns.differ[k] + first, count, width, add);
    fold(columns.doubt[k] + first, count, width, add);
  }
  fold(columns.peak + first, count, width, [](VF a, VF b) HWY_ATTR { return hn::Max(a, b); });
}

}  // namespace HWY_NAMESPACE
}  // namespace lightwell::estimate
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lightwell::estimate {

HWY_EXPORT(MergeRow);
HWY_EXPORT(FoldColumns);
HWY_EXPORT(SharedTops);

void shared_tops(const Planes& row, const Planes* below, std::size_t pixels, unsigned saturated_from, std::uint8_t* out,
                 std::uint8_t* out_below) {
  HWY_DYNAMIC_DISPATCH(SharedTops)(row, below, pixels, saturated_from, out, out_below);
}

void fold_bracket_columns(const BracketColumns& columns, int pairs, const std::array<float, 3>& luminance,
                          std::size_t first, int edge, std::size_t blocks, const FoldedColumns& out) {
  HWY_DYNAMIC_DISPATCH(FoldColumns)(columns, pairs, luminance, first, edge, blocks, out);
}

void merge_bracket_row(const BracketRow& row, std::size_t begin, std::size_t end, std::size_t readable_end,
                       const BracketColumns& out) {
  HWY_DYNAMIC_DISPATCH(MergeRow)(row, begin, end, readable_end, out);
}

}  // namespace lightwell::estimate
#endif  // HWY_ONCE
