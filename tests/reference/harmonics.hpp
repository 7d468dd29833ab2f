// Real spherical harmonics of any band, and irradiance through the cosine lobe.
#pragma once

#include <vector>

#include "reference/panorama.hpp"
#include "reference/vector.hpp"

namespace lightwell::reference {

/// Index of Y_l^m in every list of coefficients: l (l + 1) + m, m = -l..l.
int harmonic_index(int l, int m);

/// The Legendre polynomial P_l(x), |x| <= 1, by Bonnet's recursion.
double legendre(int l, double x);

/// All Y_l^m(d) for l = 0..band at a unit direction: (band + 1)^2 real orthonormal functions
/// WITHOUT the Condon-Shortley phase, polar axis z, cos(m phi) for m > 0 and
/// sin(|m| phi) for m < 0 with phi from x towards y. Hence Y_1 = 0.488603 (y, z, x) and
/// Y_2 = 1.092548 xy, 1.092548 yz, 0.315392 (3zz - 1), 1.092548 xz, 0.546274 (xx - yy).
/// Fully normalised associated Legendre recursion, Holmes & Featherstone (2002), eq. 11-13, with
/// sin^m theta (cos m phi, sin m phi) = Re, Im of (x + iy)^m.
std::vector<double> harmonics(const V3& d, int band);

/// Coefficients of radiance, (band + 1)^2 of them: the sum over pixels of L Y(centre) d_omega.
/// Y is taken at the pixel's centre: relative error about (l pi / H)^2 / 24.
std::vector<Rgb> project(const Panorama& p, int band);

/// The value at the unit direction d of an expansion of any full number of bands.
Rgb evaluate(const std::vector<Rgb>& coefficients, const V3& d);

/// The factor A_l by which band l of radiance becomes band l of irradiance:
/// pi, 2 pi/3, pi/4, 0, -pi/24, 0, pi/64, ... Ramamoorthi & Hanrahan, "An efficient representation
/// for irradiance environment maps" (2001), eq. 8 (there written with a hat).
double cosine_lobe(int l);

/// The same by its definition: 2 pi times the integral of c P_l(c) over c = 0..1 (Funk-Hecke), by a
/// Gauss-Legendre rule of a degree that makes it exact.
double cosine_lobe_by_quadrature(int l);

/// The irradiance at unit normal n that the coefficients of radiance give: sum of A_l L_lm Y_lm(n)
/// (Ramamoorthi & Hanrahan 2001, eq. 7). Not divided by pi.
Rgb irradiance_from_sh(const std::vector<Rgb>& radiance_coefficients, const V3& n);

}  // namespace lightwell::reference
