// Light from a spherical cap of uniform radiance: the model of a descriptor's lights. All factors are per vector
// irradiance E = pi sin²(rho) L of the cap, so that rho -> 0 is a directional light.
#pragma once

#include <lightwell/geometry.hpp>
#include <lightwell/lobes.hpp>

namespace lightwell {

/// Irradiance of a flat receiver per vector irradiance of the cap, clipped at the receiver's horizon.
/// cos_angle: between the normal and the cap's axis. rho: angular radius, rad, 0 to pi/2.
/// Closed form of Snyder 1996 ("Area Light Sources for Real-Time Graphics", eq. for a spherical light).
[[nodiscard]] double cap_irradiance(double cos_angle, double rho);

/// SH coefficient of the cap: c_lm = cap_zonal(l, rho) Y_lm(axis), per vector irradiance. 1 for rho = 0.
[[nodiscard]] double cap_zonal(int l, double rho);

/// radiance(d, r) of the cap per vector irradiance, sr⁻¹: the GGX lobe around d integrated over the cap.
[[nodiscard]] double cap_radiance(double cos_angle, double rho, const GgxLobe& lobe);

/// Vector irradiance of a cap with unit radiance: pi sin²(rho).
[[nodiscard]] double cap_vector_irradiance(double rho);

/// Angular radius of the uniform cap whose mean of 1 - cos(angle to the axis) is m: cos(rho) = 1 - 2 m. Clamped to
/// [0, pi/2], rad.
[[nodiscard]] double cap_radius(double mean_one_minus_cos);

}  // namespace lightwell
