#include "estimate/panorama/kernels/bracket_rows.hpp"

#include <type_traits>

#include <lightwell/color.hpp>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "estimate/panorama/kernels/bracket_rows.cpp"
#include <hwy/foreach_target.h>
// Highway requires this include after foreach_target.h.
#include <hwy/highway.h>

#include "estimate/panorama/kernels/bracket_sources_inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace lightwell::estimate {
namespace HWY_NAMESPACE {

/// A saturated value is a lower bound. Another exposure with less than this share of it indicates motion.
constexpr float kMinSaturatedRatio = 0.5F;

/// Weights of a vector of pixels.
struct PixelWeights {
  VF weight;  ///< Solid angle times inverse vignetting.
  VF solid_angle;
  VF inverse_vignetting;
};

template <bool kQuads>
HWY_INLINE PixelWeights pixel_weights_at(const BracketRow& row, std::size_t at) {
  const DF d;
  if constexpr (!kQuads) {
    const VF sr = hn::LoadU(d, row.solid_angle + at), inverse_vignetting = hn::LoadU(d, row.inverse_vignetting + at);
    return {hn::Mul(sr, inverse_vignetting), sr, inverse_vignetting};
  } else {
    PixelWeights sum{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
    for (std::size_t y = 0; y < 2; ++y) {
      VF sr0, sr1, b0, b1;
      hn::LoadInterleaved2(d, row.solid_angle + y * row.next_row + 2 * at, sr0, sr1);
      hn::LoadInterleaved2(d, row.inverse_vignetting + y * row.next_row + 2 * at, b0, b1);
      sum.weight = hn::MulAdd(sr1, b1, hn::MulAdd(sr0, b0, sum.weight));
      sum.solid_angle = hn::Add(sum.solid_angle, hn::Add(sr0, sr1));
    }
    // Mean over the pixels with solid angle.
    sum.inverse_vignetting = hn::Div(sum.weight, hn::Max(sum.solid_angle, hn::Set(d, 1e-30F)));
    return sum;
  }
}

HWY_INLINE void add_to(float* to, VF v) { hn::StoreU(hn::Add(hn::LoadU(DF(), to), v), DF(), to); }

/// Copies of a row's constants, so that the compiler need not reload them after each store.
struct Constants {
  float scale[kMaxBracket], inverse[kMaxBracket], scaled_sigmas[kMaxBracket], lower_bound[kMaxBracket];
  float near_black_bias, near_black_limit, depth, relative_tolerance, luminance[3];

  explicit Constants(const BracketRow& row)
      : near_black_bias(row.lut->near_black_bias),
        near_black_limit(row.lut->near_black_limit),
        depth(row.depth),
        relative_tolerance(row.relative_tolerance),
        luminance{row.luminance[0], row.luminance[1], row.luminance[2]} {
    for (int k = 0; k < row.count; ++k) {
      scale[k] = row.exposures[static_cast<std::size_t>(k)].scale;
      inverse[k] = 1 / scale[k];
      scaled_sigmas[k] = row.noise_sigmas * scale[k];
      lower_bound[k] = row.lut->saturated_linear * scale[k];
    }
  }
};

/// Weighted sums of a vector of pixels, to be divided by `weight`.
struct Merged {
  VF r, g, b, weight, bias;
};

/// For pixels that are saturated in every exposure, sets the highest lower bound.
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

/// `count`: an int, or an integral_constant, of which the compiler unrolls the loop.
template <bool kQuads, class AnySample, class Count>
HWY_INLINE void merge_part(const BracketRow& row, const Constants& c, const BracketColumns& out,
                           const AnySample* samples, Count count, std::size_t p, std::size_t at,
                           const PixelWeights& pixel_weights) {
  const DF d;
  const D32 d32;
  const VF zero = hn::Zero(d);
  Merged m{zero, zero, zero, zero, zero};
  VF previous_light = zero, previous_sigma = zero;
  auto previous_valid = hn::Eq(zero, hn::Set(d, 1.0F));
  for (int k = 0; k < count; ++k) {
    const AnySample& s = samples[k];
    const VF r = s.r.at(p), g = s.g.at(p), b = s.b.at(p), weight = s.weight.at(p);
    // The radiance x * scale has a variance of scale² / weight, so that the factor of x in the sum is weight / scale.
    const VF inverse = hn::Set(d, c.inverse[k]), of_x = hn::Mul(weight, inverse);
    m.r = hn::MulAdd(of_x, r, m.r);
    m.g = hn::MulAdd(of_x, g, m.g);
    m.b = hn::MulAdd(of_x, b, m.b);
    m.weight = hn::MulAdd(of_x, inverse, m.weight);
    const auto dark = hn::Lt(g, hn::Set(d, c.near_black_limit));
    m.bias = hn::IfThenElse(dark, hn::MulAdd(of_x, hn::Set(d, c.near_black_bias), m.bias), m.bias);

    const VF light = hn::Mul(kQuads ? s.top.part[p] : hn::Max(r, hn::Max(g, b)), hn::Set(d, c.scale[k]));
    // 1 / sqrt(weight) to 4 %, and finite where the weight is zero (Lomont 2003).
    const VF root = hn::BitCast(d, hn::Sub(hn::Set(d32, 0x5F375A86), hn::ShiftRight<1>(hn::BitCast(d32, weight))));
    const VF sigma = hn::Mul(root, hn::Set(d, c.scaled_sigmas[k]));
    const auto valid = hn::Gt(weight, zero);
    if (k > 0) {
      const auto both = hn::And(valid, previous_valid);
      VF difference = hn::Sub(previous_light, light);
      VF noise_allowance = hn::MulAdd(hn::Set(d, c.relative_tolerance), light, hn::Add(previous_sigma, sigma));
      if (!hn::AllTrue(d, both)) {
        // A saturated exposure gives a lower bound; the other gets a margin of two (scaled) sigmas against noise.
        const VF lower_bound = hn::IfThenElse(valid, hn::Set(d, c.lower_bound[k - 1]), hn::Set(d, c.lower_bound[k]));
        const VF upper_bound = hn::MulAdd(hn::Set(d, 2.0F), hn::IfThenElse(valid, sigma, previous_sigma),
                                          hn::IfThenElse(valid, light, previous_light));
        // Pixels that are invalid only because they share chroma with a saturated one give no bound.
        const auto bright =
            hn::Ge(hn::IfThenElse(valid, previous_light, light), hn::Mul(hn::Set(d, 0.99F), lower_bound));
        const auto contradicts = hn::And(hn::And(hn::Xor(valid, previous_valid), bright),
                                         hn::Lt(upper_bound, hn::Mul(hn::Set(d, kMinSaturatedRatio), lower_bound)));
        const VF bounded = hn::Sub(hn::IfThenElse(previous_valid, previous_light, lower_bound),
                                   hn::IfThenElse(valid, light, lower_bound));
        difference = hn::IfThenElse(both, difference, hn::IfThenElseZero(contradicts, bounded));
        noise_allowance = hn::IfThenElseZero(both, noise_allowance);
      }
      add_to(out.difference[static_cast<std::size_t>(k - 1)] + at, difference);
      add_to(out.noise_allowance[static_cast<std::size_t>(k - 1)] + at, noise_allowance);
    }
    previous_valid = valid;
    previous_light = light;
    previous_sigma = sigma;
  }

  const auto clipped = hn::Eq(m.weight, zero);
  VF variance;
  if (HWY_UNLIKELY(!hn::AllFalse(d, clipped))) {
    m = bound_clipped(row, samples, p, m);
    variance = hn::IfThenZeroElse(clipped, hn::Div(hn::Set(d, 1.0F), m.weight));
    m.weight = hn::IfThenElse(clipped, hn::Set(d, 1.0F), m.weight);
    add_to(out.clipped + at, hn::IfThenElseZero(clipped, pixel_weights.solid_angle));
  } else {
    variance = hn::Div(hn::Set(d, 1.0F), m.weight);
  }
  const VF inverse_weight = hn::Or(variance, hn::IfThenElseZero(clipped, hn::Set(d, 1.0F)));
  const VF share = hn::Mul(pixel_weights.weight, inverse_weight);
  add_to(out.r + at, hn::Mul(m.r, share));
  add_to(out.g + at, hn::Mul(m.g, share));
  add_to(out.b + at, hn::Mul(m.b, share));
  const VF light = hn::MulAdd(hn::Set(d, c.luminance[0]), m.r,
                              hn::MulAdd(hn::Set(d, c.luminance[1]), m.g, hn::Mul(hn::Set(d, c.luminance[2]), m.b)));
  add_to(out.low + at, hn::Mul(hn::Mul(light, share), hn::Set(d, c.depth)));
  add_to(out.bias + at, hn::Mul(m.bias, share));
  // The noise of the four pixels of a quad is independent.
  const VF square = hn::Mul(hn::Mul(pixel_weights.weight, pixel_weights.weight), variance);
  add_to(out.noise + at, kQuads ? hn::Mul(square, hn::Set(d, 0.25F)) : square);
  const VF bright = hn::IfThenElseZero(hn::Gt(pixel_weights.weight, zero),
                                       hn::Mul(hn::Mul(light, inverse_weight), pixel_weights.inverse_vignetting));
  hn::StoreU(hn::Max(hn::LoadU(d, out.peak + at), bright), d, out.peak + at);
}

template <class Source, bool kQuads, class Count>
HWY_INLINE void merge_rows_of(const BracketRow& row, Count count, std::size_t begin, std::size_t end,
                              std::size_t readable_end, const BracketColumns& columns) {
  const DF d;
  const std::size_t lanes = hn::Lanes(d), n = kParts * lanes;
  const Constants constants(row);
  const BracketColumns out = columns;
  const Source source(*row.lut);
  typename Source::Sample samples[kMaxBracket];
  for (std::size_t from = begin; from < end; from += n) {
    // The last strip is shifted back so that it ends at readable_end.
    const std::size_t at = from + n <= readable_end ? from : readable_end - n;
    for (int k = 0; k < count; ++k) source.load(row.exposures[static_cast<std::size_t>(k)], at, samples[k]);
    for (std::size_t p = 0; p < kParts; ++p) {
      const std::size_t part = at + p * lanes;
      PixelWeights pixel_weights = pixel_weights_at<kQuads>(row, part);
      for (std::size_t y = 0; y < (kQuads ? 2 : 1); ++y) {
        const std::size_t first = (kQuads ? 2 : 1) * part + y * row.next_row,
                          bytes = (kQuads ? 2 : 1) * sizeof(float) * lanes;
        prefetch(row.solid_angle + first, row.ahead, bytes);
        prefetch(row.inverse_vignetting + first, row.ahead, bytes);
      }
      if (at < from || at + n > end) {
        const VF place = hn::Iota(d, static_cast<float>(part));
        const auto wanted = hn::And(hn::Ge(place, hn::Set(d, static_cast<float>(from))),
                                    hn::Lt(place, hn::Set(d, static_cast<float>(end))));
        pixel_weights.weight = hn::IfThenElseZero(wanted, pixel_weights.weight);
        pixel_weights.solid_angle = hn::IfThenElseZero(wanted, pixel_weights.solid_angle);
      }
      merge_part<kQuads>(row, constants, out, samples, count, p, part, pixel_weights);
    }
  }
}

template <class Source, bool kQuads>
HWY_INLINE void merge_rows(const BracketRow& row, std::size_t begin, std::size_t end, std::size_t readable_end,
                           const BracketColumns& columns) {
  if (row.count == 3)
    merge_rows_of<Source, kQuads>(row, std::integral_constant<int, 3>(), begin, end, readable_end, columns);
  else
    merge_rows_of<Source, kQuads>(row, row.count, begin, end, readable_end, columns);
}

void MergeRow(const BracketRow& row, std::size_t begin, std::size_t end, std::size_t readable_end,
              const BracketColumns& out) {
  switch (row.source) {
    case BracketSource::interleaved8:
      return merge_rows<Interleaved8, false>(row, begin, end, readable_end, out);
    case BracketSource::linear8:
      return merge_rows<Linear8, false>(row, begin, end, readable_end, out);
    case BracketSource::planes8:
      return merge_rows<Planes8, false>(row, begin, end, readable_end, out);
    case BracketSource::mosaic8:
      return merge_rows<Mosaic8, true>(row, begin, end, readable_end, out);
    case BracketSource::mosaic16:
      return merge_rows<Mosaic16, true>(row, begin, end, readable_end, out);
  }
}

HWY_INLINE V8 top_of(const PlaneRow& row, std::size_t at) {
  const D8 d;
  return hn::Max(hn::LoadU(d, row.r + at), hn::Max(hn::LoadU(d, row.g + at), hn::LoadU(d, row.b + at)));
}

void SharedTops(const PlaneRow& row, const PlaneRow* below, std::size_t pixels, unsigned saturated_from,
                std::uint8_t* out, std::uint8_t* out_below) {
  const D8 d;
  const hn::RepartitionToWide<D8> d16;
  const V8 limit = hn::Set(d, static_cast<std::uint8_t>(saturated_from < 255 ? saturated_from : 255));
  for_strips(pixels, [&](std::size_t at) HWY_ATTR {
    const V8 own = top_of(row, at), lower = below == nullptr ? own : top_of(*below, at);
    const V8 most = hn::Max(own, lower);
    const auto pair = hn::BitCast(d16, most);
    const V8 neighbour = hn::BitCast(d, hn::Or(hn::ShiftLeft<8>(pair), hn::ShiftRight<8>(pair)));
    const V8 shared = hn::Max(most, neighbour);
    const auto saturated = hn::Eq(hn::Max(shared, limit), shared);
    const V8 full = hn::Set(d, 255);
    hn::StoreU(hn::IfThenElse(saturated, full, own), d, out + at);
    if (below != nullptr) hn::StoreU(hn::IfThenElse(saturated, full, lower), d, out_below + at);
  });
}

/// Writes the sum of each block over its first column, in order: no column is read after it was written.
template <std::size_t kWidth>
HWY_INLINE void fold(float* columns, std::size_t blocks) {
  const hn::CappedTag<float, kWidth % 4 == 0 ? 4 : 1> d;
  for (std::size_t k = 0; k < blocks; ++k) {
    auto sum = hn::LoadU(d, columns + k * kWidth);
    for (std::size_t x = hn::Lanes(d); x < kWidth; x += hn::Lanes(d))
      sum = hn::Add(sum, hn::LoadU(d, columns + k * kWidth + x));
    columns[k] = hn::GetLane(hn::SumOfLanes(d, sum));
  }
}

template <std::size_t kWidth>
HWY_INLINE void fold_blocks(const BracketColumns& columns, int pairs, const std::array<float, 3>& luminance,
                            std::size_t first, std::size_t blocks, const FoldedColumns& out) {
  const hn::CappedTag<float, kWidth % 4 == 0 ? 4 : 1> d;
  for (std::size_t k = 0; k < blocks; ++k) {
    auto across = hn::Zero(d), peak = across, column = hn::Iota(d, 0);
    for (std::size_t x = 0; x < kWidth; x += hn::Lanes(d)) {
      const std::size_t at = first + k * kWidth + x;
      const auto light = hn::MulAdd(hn::Set(d, luminance[0]), hn::LoadU(d, columns.r + at),
                                    hn::MulAdd(hn::Set(d, luminance[1]), hn::LoadU(d, columns.g + at),
                                               hn::Mul(hn::Set(d, luminance[2]), hn::LoadU(d, columns.b + at))));
      across = hn::MulAdd(column, light, across);
      column = hn::Add(column, hn::Set(d, static_cast<float>(hn::Lanes(d))));
      peak = hn::Max(peak, hn::LoadU(d, columns.peak + at));
    }
    out.across[first + k] = hn::GetLane(hn::SumOfLanes(d, across));
    columns.peak[first + k] = hn::GetLane(hn::MaxOfLanes(d, peak));
  }
  for (float* column : {columns.r, columns.g, columns.b, columns.low, columns.noise, columns.bias, columns.clipped})
    fold<kWidth>(column + first, blocks);
  for (std::size_t k = 0; k < static_cast<std::size_t>(pairs); ++k) {
    fold<kWidth>(columns.difference[k] + first, blocks);
    fold<kWidth>(columns.noise_allowance[k] + first, blocks);
  }
  for (std::size_t k = first; k < first + blocks; ++k)
    out.luminance[k] = luminance[0] * columns.r[k] + luminance[1] * columns.g[k] + luminance[2] * columns.b[k];
}

void FoldColumns(const BracketColumns& columns, int pairs, const std::array<float, 3>& luminance, std::size_t first,
                 int edge, std::size_t blocks, const FoldedColumns& out) {
  switch (edge) {
    case 16:
      return fold_blocks<16>(columns, pairs, luminance, first, blocks, out);
    case 8:
      return fold_blocks<8>(columns, pairs, luminance, first, blocks, out);
    case 4:
      return fold_blocks<4>(columns, pairs, luminance, first, blocks, out);
    case 2:
      return fold_blocks<2>(columns, pairs, luminance, first, blocks, out);
    default:
      return fold_blocks<1>(columns, pairs, luminance, first, blocks, out);
  }
}

/// Loads as bytes, which need no alignment.
template <class D>
HWY_INLINE hn::Vec<D> load(D d, const std::byte* at) {
  const hn::Repartition<std::uint8_t, D> bytes;
  return hn::BitCast(d, hn::LoadU(bytes, reinterpret_cast<const std::uint8_t*>(at)));
}

template <class D>
HWY_INLINE bool all_in_range(D d, const std::byte* rgb, std::size_t floats, float scale, float max_radiance) {
  const auto k = hn::Set(d, scale), limit = hn::Set(d, max_radiance), zero = hn::Zero(d);
  auto valid = hn::Eq(zero, zero);
  for (std::size_t i = 0; i < floats; i += hn::Lanes(d)) {
    const auto v = hn::Mul(load(d, rgb + 4 * i), k);
    valid = hn::And(valid, hn::And(hn::Ge(v, zero), hn::Le(v, limit)));
  }
  return hn::AllTrue(d, valid);
}

template <class D, class V = hn::Vec<D>>
HWY_INLINE void add(D d, V r, V g, V b, const float* solid_angle, float depth, const FloatColumns& out,
                    std::size_t at) {
  const V sr = hn::LoadU(d, solid_angle + at);
  const V luminance =
      hn::MulAdd(r, hn::Set(d, kLuminanceWeights[0]),
                 hn::MulAdd(g, hn::Set(d, kLuminanceWeights[1]), hn::Mul(b, hn::Set(d, kLuminanceWeights[2]))));
  hn::StoreU(hn::MulAdd(r, sr, hn::LoadU(d, out.r + at)), d, out.r + at);
  hn::StoreU(hn::MulAdd(g, sr, hn::LoadU(d, out.g + at)), d, out.g + at);
  hn::StoreU(hn::MulAdd(b, sr, hn::LoadU(d, out.b + at)), d, out.b + at);
  hn::StoreU(hn::MulAdd(hn::Mul(luminance, sr), hn::Set(d, depth), hn::LoadU(d, out.low + at)), d, out.low + at);
  const V visible = hn::IfThenElseZero(hn::Gt(sr, hn::Zero(d)), luminance);
  hn::StoreU(hn::Max(visible, hn::LoadU(d, out.peak + at)), d, out.peak + at);
}

bool AddFloatRow(const std::byte* rgb, const float* solid_angle, std::size_t pixels, float scale, float max_radiance,
                 float depth, const FloatColumns& out) {
  const hn::ScalableTag<float> d;
  const hn::CappedTag<float, 1> one;
  const std::size_t lanes = hn::Lanes(d), whole = pixels - pixels % lanes;
  if (!all_in_range(d, rgb, 3 * whole, scale, max_radiance) ||
      !all_in_range(one, rgb + 12 * whole, 3 * (pixels - whole), scale, max_radiance))
    return false;
  const auto k = hn::Set(d, scale);
  for (std::size_t at = 0; at < whole; at += lanes) {
    hn::Vec<decltype(d)> r, g, b;
    hn::LoadInterleaved3(d, reinterpret_cast<const float*>(rgb + 12 * at), r, g, b);
    add(d, hn::Mul(r, k), hn::Mul(g, k), hn::Mul(b, k), solid_angle, depth, out, at);
  }
  const auto k1 = hn::Set(one, scale);
  for (std::size_t at = whole; at < pixels; ++at) {
    const std::byte* pixel = rgb + 12 * at;
    add(one, hn::Mul(load(one, pixel), k1), hn::Mul(load(one, pixel + 4), k1), hn::Mul(load(one, pixel + 8), k1),
        solid_angle, depth, out, at);
  }
  return true;
}

}  // namespace HWY_NAMESPACE
}  // namespace lightwell::estimate
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lightwell::estimate {

HWY_EXPORT(MergeRow);
HWY_EXPORT(FoldColumns);
HWY_EXPORT(SharedTops);
HWY_EXPORT(AddFloatRow);

bool add_float_row(const std::byte* rgb, const float* solid_angle, std::size_t pixels, float scale, float max_radiance,
                   float depth, const FloatColumns& out) {
  return HWY_DYNAMIC_DISPATCH(AddFloatRow)(rgb, solid_angle, pixels, scale, max_radiance, depth, out);
}

void shared_tops(const PlaneRow& row, const PlaneRow* below, std::size_t pixels, unsigned saturated_from,
                 std::uint8_t* out, std::uint8_t* out_below) {
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
