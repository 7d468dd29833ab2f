// Real spherical harmonics: orthonormal, no Condon-Shortley phase, index l(l+1)+m, band 1 in the order y, z, x.
#pragma once

#include <array>
#include <span>

#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>

namespace lightwell {

/// Highest band of a descriptor.
inline constexpr int kMaxBand = 6;
/// Highest band of sh_basis; the estimators compute more bands than they send.
inline constexpr int kMaxBasisBand = 16;

[[nodiscard]] constexpr int sh_count(int band) { return (band + 1) * (band + 1); }
[[nodiscard]] constexpr int sh_index(int l, int m) { return l * (l + 1) + m; }

/// Fills out[0 .. sh_count(band)) with the functions at the unit vector d. band: 0 to kMaxBasisBand.
/// Normalised associated Legendre recursion without the sine factor (Sloan 2013, "Efficient Spherical Harmonic
/// Evaluation"): no pole, no division by zero.
void sh_basis(int band, Vec3d d, std::span<double> out);
void sh_basis(int band, Vec3f d, std::span<float> out);

/// Factors of that recursion in l at fixed m, for SIMD implementations over several directions. A function is Q_l^m(z)
/// times the real part (order m) or the imaginary part (order -m) of (x + iy)^m, with
///   Q_m^m     = start[m]  (times sqrt 2 for m > 0, the normalisation of real functions)
///   Q_l^m     = a[l][m] (z Q_{l-1}^m - b[l][m] Q_{l-2}^m), where the second term is 0 for l = m + 1
struct ShRecursion {
  std::array<double, kMaxBasisBand + 1> start{};
  std::array<std::array<double, kMaxBasisBand + 1>, kMaxBasisBand + 1> a{}, b{};
};
[[nodiscard]] const ShRecursion& sh_recursion();

/// SH coefficients of a quantity, three channels.
template <class Quantity>
struct Sh {
  int band = 0;
  std::array<Rgb<Quantity>, sh_count(kMaxBand)> c{};

  [[nodiscard]] int count() const { return sh_count(band); }
  friend bool operator==(const Sh&, const Sh&) = default;
};

/// Radiance as a function of direction.
using RadianceSh = Sh<RadianceTag>;
/// Irradiance as a function of the normal.
using IrradianceSh = Sh<IrradianceTag>;

/// The value at the unit vector d.
[[nodiscard]] Radiance evaluate(const RadianceSh& sh, Vec3f d);
[[nodiscard]] Irradiance evaluate(const IrradianceSh& sh, Vec3f normal);

/// The function rotated by q: rotated(f)(q d) = f(d). Exact up to rounding, about 20 µs.
[[nodiscard]] RadianceSh rotated(const RadianceSh& sh, Quat q);

/// Convolution with the clamped cosine: E_lm = A_l L_lm (Ramamoorthi & Hanrahan 2001, eq. 7).
[[nodiscard]] IrradianceSh irradiance_of(const RadianceSh& sh);

}  // namespace lightwell
