#include "estimate/panorama/kernels/float_rows.hpp"

#include <cstdint>

#include <lightwell/color.hpp>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "estimate/panorama/kernels/float_rows.cpp"
#include <hwy/foreach_target.h>
// Highway requires this include after foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lightwell::estimate {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

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

HWY_EXPORT(AddFloatRow);

bool add_float_row(const std::byte* rgb, const float* solid_angle, std::size_t pixels, float scale, float max_radiance,
                   float depth, const FloatColumns& out) {
  return HWY_DYNAMIC_DISPATCH(AddFloatRow)(rgb, solid_angle, pixels, scale, max_radiance, depth, out);
}

}  // namespace lightwell::estimate
#endif  // HWY_ONCE
