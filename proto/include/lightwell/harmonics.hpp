// Real spherical harmonics: orthonormal, no Condon-Shortley phase, index l(l+1)+m, band 1 in the order y, z, x.
//   sh_basis      values of all functions up to a band at a direction; sh_recursion: how they are made
//   Sh<Quantity>  coefficients per channel: RadianceSh, IrradianceSh
//   evaluate, rotated, irradiance_of
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>

namespace lightwell {

/// Highest band of a descriptor.
inline constexpr int kMaxBand = 6;
/// Highest band that sh_basis knows; the estimators look at more than they send.
inline constexpr int kMaxBasisBand = 16;

[[nodiscard]] constexpr int sh_count(int band) { return (band + 1) * (band + 1); }
[[nodiscard]] constexpr int sh_index(int l, int m) { return l * (l + 1) + m; }

/// Fills out[0 .. sh_count(band)) with the functions at the unit vector d. band: 0 to kMaxBasisBand.
/// Normalised associated Legendre recursion without the sine factor (Sloan 2013, "Efficient Spherical Harmonic
/// Evaluation"): no pole, no division by zero.
void sh_basis(int band, Vec3d d, std::span<double> out);
void sh_basis(int band, Vec3f d, std::span<float> out);

/// Factors of that recursion, in l at fixed m, for those who run it on vectors of directions. With Q the part that
/// depends on z, and (x + iy)^m, whose real part belongs to m and whose imaginary part to -m:
///   Q_m^m     = start[m]  (times sqrt 2 for m > 0, which real functions need)
///   Q_l^m     = a[l][m] (z Q_{l-1}^m - b[l][m] Q_{l-2}^m), of which the second is 0 for l = m + 1
struct ShRecursion {
  std::array<double, kMaxBasisBand + 1> start{};
  std::array<std::array<double, kMaxBasisBand + 1>, kMaxBasisBand + 1> a{}, b{};
};
[[nodiscard]] const ShRecursion& sh_recursion();

/// Coefficients of one quantity over directions.
template <class Quantity>
struct Sh {
  int band = 0;
  std::array<Rgb<Quantity>, sh_count(kMaxBand)> c{};

  [[nodiscard]] int count() const { return sh_count(band); }
  friend bool operator==(const Sh&, const Sh&) = default;
};

/// Radiance from each direction.
using RadianceSh = Sh<RadianceTag>;
/// Irradiance at each normal.
using IrradianceSh = Sh<IrradianceTag>;

/// The value at the unit vector d.
[[nodiscard]] Radiance evaluate(const RadianceSh& sh, Vec3f d);
[[nodiscard]] Irradiance evaluate(const IrradianceSh& sh, Vec3f normal);

/// The same light seen from a frame turned by q: rotated(f)(q d) = f(d). Exact up to rounding, about 20 µs.
[[nodiscard]] RadianceSh rotated(const RadianceSh& sh, Quat q);

/// Convolution with the clipped cosine: E_lm = A_l L_lm (Ramamoorthi & Hanrahan 2001, eq. 7).
[[nodiscard]] IrradianceSh irradiance_of(const RadianceSh& sh);

}  // namespace lightwell
