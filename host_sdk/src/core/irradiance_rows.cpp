#include "core/irradiance_rows.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <lightwell/cap.hpp>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/irradiance_rows.cpp"
#include <hwy/foreach_target.h>
// Highway requires this after foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lightwell::core {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Range of squared lengths that a float represents with full precision; others are computed in double.
constexpr float kMinLength2 = 1e-30F, kMaxLength2 = 1e30F;
/// Float cosines this close to the transition of a cap at the horizon are recomputed in double.
constexpr float kCosineError = 1e-6F;

/// Accumulators of r, g, b.
template <class V>
struct Sums {
  V r, g, b;
};

/// Adds the values of `sh` in the unit directions (x, y, z), one per lane, to `sum`, by the recursion of harmonics.hpp
/// (Sloan 2013).
template <class D, class V = hn::Vec<D>>
HWY_INLINE void add_harmonics(D d, const IrradianceSh& sh, V x, V y, V z, Sums<V>& sum) {
  const ShRecursion& k = sh_recursion();
  const auto add = [&](std::size_t i, V basis) HWY_ATTR {
    sum.r = hn::MulAdd(basis, hn::Set(d, sh.c[i].r), sum.r);
    sum.g = hn::MulAdd(basis, hn::Set(d, sh.c[i].g), sum.g);
    sum.b = hn::MulAdd(basis, hn::Set(d, sh.c[i].b), sum.b);
  };
  V re = hn::Set(d, 1), im = hn::Zero(d);
  for (int m = 0; m <= sh.band; ++m) {
    const auto order = static_cast<std::size_t>(m);
    V previous = hn::Zero(d), current = hn::Set(d, static_cast<float>(k.start[order]));
    for (int l = m;; ++l) {
      const auto at = static_cast<std::size_t>(l * (l + 1));
      add(at + order, hn::Mul(current, re));
      if (m > 0) add(at - order, hn::Mul(current, im));
      if (l == sh.band) break;
      const auto above = static_cast<std::size_t>(l + 1);
      const V a = hn::Set(d, static_cast<float>(k.a[above][order])),
              b = hn::Set(d, static_cast<float>(k.b[above][order]));
      const V next = hn::Mul(a, hn::NegMulAdd(b, previous, hn::Mul(z, current)));
      previous = current;
      current = next;
    }
    const V turned = hn::NegMulAdd(im, y, hn::Mul(re, x));
    im = hn::MulAdd(re, y, hn::Mul(im, x));
    re = turned;
  }
}

/// Bands 0 to 2, the most frequent case, without the recursion: polynomials in x, y, z on the unit sphere (Ramamoorthi
/// & Hanrahan 2001, eq. 12, in the basis of harmonics.hpp).
struct Quadratic {
  float one[3], x[3], y[3], z[3], xy[3], yz[3], xz[3], zz[3], xx_yy[3];
};

Quadratic quadratic_of(const IrradianceSh& sh) {
  Quadratic q;
  for (int c = 0; c < 3; ++c) {
    const auto k = [&](std::size_t i) { return static_cast<double>(sh.c[i][c]); };
    const double c0 = 0.28209479177387814, c1 = 0.4886025119029199, c2 = 1.0925484305920792, c3 = 0.31539156525252005,
                 c4 = 0.5462742152960396;
    q.one[c] = static_cast<float>(c0 * k(0) - c3 * k(6));
    q.y[c] = static_cast<float>(c1 * k(1));
    q.z[c] = static_cast<float>(c1 * k(2));
    q.x[c] = static_cast<float>(c1 * k(3));
    q.xy[c] = static_cast<float>(c2 * k(4));
    q.yz[c] = static_cast<float>(c2 * k(5));
    q.zz[c] = static_cast<float>(3 * c3 * k(6));
    q.xz[c] = static_cast<float>(c2 * k(7));
    q.xx_yy[c] = static_cast<float>(c4 * k(8));
  }
  return q;
}

template <class D, class V = hn::Vec<D>>
HWY_INLINE V quadratic(D d, const Quadratic& q, int c, V x, V y, V z, V xx_yy) {
  // Horner's scheme in z, then y.
  const V of_z = hn::MulAdd(hn::Set(d, q.zz[c]), z,
                            hn::MulAdd(hn::Set(d, q.yz[c]), y, hn::MulAdd(hn::Set(d, q.xz[c]), x, hn::Set(d, q.z[c]))));
  const V of_y = hn::MulAdd(hn::Set(d, q.xy[c]), x, hn::Set(d, q.y[c]));
  const V rest = hn::MulAdd(hn::Set(d, q.xx_yy[c]), xx_yy, hn::MulAdd(hn::Set(d, q.x[c]), x, hn::Set(d, q.one[c])));
  return hn::MulAdd(of_z, z, hn::MulAdd(of_y, y, rest));
}

/// Caps that the horizon intersects: closed form, one lane at a time.
template <class D, class M, class V = hn::Vec<D>>
HWY_NOINLINE V shares_at_horizon(D d, M cut, V share, const ReceiverLight& light, const Vec3f* normals) {
  HWY_ALIGN float shares[hn::MaxLanes(d)];
  HWY_ALIGN float cuts[hn::MaxLanes(d)];
  hn::Store(share, d, shares);
  hn::Store(hn::IfThenElseZero(cut, hn::Set(d, 1)), d, cuts);
  for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
    if (cuts[i] == 0) continue;
    const double c = dot(light.direction, normalized(vec_cast<double>(normals[i])));
    shares[i] = static_cast<float>(cap_irradiance(c, light.radius_rad));
  }
  return hn::Load(d, shares);
}

std::size_t IrradianceRows(const IrradianceSh& sh, std::span<const ReceiverLight> lights,
                           std::span<const Vec3f> normals, std::span<Irradiance> out) {
  const hn::ScalableTag<float> d;
  using V = hn::Vec<decltype(d)>;
  const std::size_t lanes = hn::Lanes(d);
  const Quadratic q = sh.band == 2 ? quadratic_of(sh) : Quadratic{};
  std::size_t at = 0, none = 0;
  const auto slowly = [&](std::size_t i) {
    out[i] = {};
    if (!irradiance_one(sh, lights, normals[i], out[i])) ++none;
  };
  for (; at + lanes <= normals.size(); at += lanes) {
    V x, y, z;
    hn::LoadInterleaved3(d, reinterpret_cast<const float*>(normals.data() + at), x, y, z);
    const V length2 = hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Mul(z, z)));
    if (!hn::AllTrue(d, hn::And(hn::Ge(length2, hn::Set(d, kMinLength2)), hn::Le(length2, hn::Set(d, kMaxLength2))))) {
      for (std::size_t i = at; i < at + lanes; ++i) slowly(i);
      continue;
    }
    const V scale = hn::Div(hn::Set(d, 1), hn::Sqrt(length2));
    x = hn::Mul(x, scale);
    y = hn::Mul(y, scale);
    z = hn::Mul(z, scale);
    Sums<V> sum{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
    if (sh.band == 2) {
      const V xx_yy = hn::NegMulAdd(y, y, hn::Mul(x, x));
      sum = {quadratic(d, q, 0, x, y, z, xx_yy), quadratic(d, q, 1, x, y, z, xx_yy),
             quadratic(d, q, 2, x, y, z, xx_yy)};
    } else {
      add_harmonics(d, sh, x, y, z, sum);
    }
    for (const ReceiverLight& light : lights) {
      const V c = hn::MulAdd(x, hn::Set(d, static_cast<float>(light.direction.x)),
                             hn::MulAdd(y, hn::Set(d, static_cast<float>(light.direction.y)),
                                        hn::Mul(z, hn::Set(d, static_cast<float>(light.direction.z)))));
      V share = hn::Max(c, hn::Zero(d));
      const auto cut = hn::Le(hn::Abs(c), hn::Set(d, static_cast<float>(light.sin_radius) + kCosineError));
      if (!hn::AllFalse(d, cut)) share = shares_at_horizon(d, cut, share, light, normals.data() + at);
      sum.r = hn::MulAdd(share, hn::Set(d, light.irradiance.r), sum.r);
      sum.g = hn::MulAdd(share, hn::Set(d, light.irradiance.g), sum.g);
      sum.b = hn::MulAdd(share, hn::Set(d, light.irradiance.b), sum.b);
    }
    hn::StoreInterleaved3(sum.r, sum.g, sum.b, d, reinterpret_cast<float*>(out.data() + at));
  }
  for (; at < normals.size(); ++at) slowly(at);
  return none;
}

}  // namespace HWY_NAMESPACE
}  // namespace lightwell::core
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lightwell::core {

HWY_EXPORT(IrradianceRows);

std::vector<ReceiverLight> receiver_lights(std::span<const Light> lights) {
  std::vector<ReceiverLight> out;
  out.reserve(lights.size());
  for (const Light& light : lights) {
    const Vec3d direction = normalized(vec_cast<double>(light.direction));
    if (direction == Vec3d{}) continue;
    const double radius = light.angular_radius_rad;
    out.push_back({direction, std::sin(std::clamp(radius, 0.0, std::numbers::pi / 2)), radius, light.irradiance});
  }
  return out;
}

Irradiance irradiance_on(std::span<const ReceiverLight> lights, Vec3d normal) {
  Irradiance sum;
  for (const ReceiverLight& light : lights) {
    const double cosine = dot(light.direction, normal);
    if (cosine <= -light.sin_radius) continue;
    // Where the whole cap is above the horizon, the ratio is the cosine.
    const double ratio = cosine >= light.sin_radius ? cosine : cap_irradiance(cosine, light.radius_rad);
    sum += light.irradiance * static_cast<float>(ratio);
  }
  return sum;
}

std::size_t irradiance_rows(const IrradianceSh& harmonics, std::span<const ReceiverLight> lights,
                            std::span<const Vec3f> normals, std::span<Irradiance> out) {
  return HWY_DYNAMIC_DISPATCH(IrradianceRows)(harmonics, lights, normals, out);
}

bool irradiance_one(const IrradianceSh& harmonics, std::span<const ReceiverLight> lights, Vec3f normal,
                    Irradiance& out) {
  const auto given = vec_cast<double>(normal);
  // The square of any float is within the range of double.
  const double length2 = dot(given, given);
  if (!(length2 > 0) || !std::isfinite(length2)) return false;
  const Vec3d n = given * (1 / std::sqrt(length2));
  out = evaluate(harmonics, vec_cast<float>(n)) + irradiance_on(lights, n);
  return true;
}

}  // namespace lightwell::core
#endif
