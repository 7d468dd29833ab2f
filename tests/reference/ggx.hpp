// The GGX-weighted mean of radiance with N = V = R, its zonal kernel and the kernel's bands.
#pragma once

#include <vector>

#include "reference/panorama.hpp"
#include "reference/vector.hpp"

namespace lightwell::reference {

/// The weight of light direction l in the prefiltered radiance of direction d, as a density over
/// solid angle (1/sr) that integrates to 1.
///
/// Half vectors are drawn with density D(h)(n.h); the density over l is D(h)(n.h) / (4 v.h)
/// (Walter et al. 2007, eq. 14 and 24), which is D(h)/4 as n = v. Samples are weighted by n.l and
/// divided by the sum of n.l (Karis, "Real Shading in Unreal Engine 4", 2013), so k is D(h)(n.l)
/// for n.l > 0, normalised; 0 for n.l <= 0.
/// D(h) = a2 / (pi ((n.h)^2 (a2 - 1) + 1)^2), a2 = alpha^2, alpha = roughness^2 (Walter et al.
/// 2007, eq. 33 rewritten; glTF 2.0, appendix B.3.2). With s = 1 - cos theta, theta the angle
/// between d and l: (n.h)^2 = 1 - s/2, so D = a2 / (pi (a2 + s (1 - a2) / 2)^2).
class GgxKernel {
 public:
  /// Perceptual roughness, 0 < r <= 1; throws std::domain_error otherwise (at 0 it is a delta).
  explicit GgxKernel(double perceptual_roughness);

  /// k at s = 1 - cos theta, 0..2: accurate for narrow lobes, for which the cosine lacks digits.
  [[nodiscard]] double at_versine(double s) const;
  /// k at cos theta, -1..1.
  [[nodiscard]] double at_cosine(double cosine) const;
  /// D(h)(n.l) at s, not normalised.
  [[nodiscard]] double weight(double s) const;
  /// The integral of D(h)(n.l) over the sphere (without unit), by adaptive quadrature.
  [[nodiscard]] double weight_integral() const { return integral_; }
  /// K_l, l = 0..band: 2 pi times the integral of k(c) P_l(c) dc. Band l of radiance becomes K_l
  /// times itself (Funk-Hecke); K_0 = 1. Absolute error below 1e-10 for r >= 0.02.
  [[nodiscard]] std::vector<double> legendre_coefficients(int band) const;

 private:
  double a2_ = 1;
  double integral_ = 1;
};

/// K_l for l = 0..band, see GgxKernel::legendre_coefficients.
std::vector<double> ggx_legendre(double perceptual_roughness, int band);

/// sum L(l) D(h)(n.l) d_omega / sum D(h)(n.l) d_omega over all pixels with n.l > 0: the radiance
/// seen from direction d by a mirror of that roughness with N = V = R = d. Unit of the image.
/// The kernel is taken at samples_per_axis^2 points of each (uniform) pixel; one is enough while
/// the lobe (alpha rad) is wider than a few pixels. Roughness 0 is the bilinear sample from d.
Rgb radiance_ggx(const Panorama& p, const V3& d, double perceptual_roughness, int samples_per_axis = 1);

}  // namespace lightwell::reference
