// Irradiance of a uniform spherical cap, clipped at the receiver's horizon.
#pragma once

namespace lightwell::reference {

/// The irradiance at a receiver whose normal is `normal_to_axis_rad` (0..pi) away from the axis of
/// a uniform cap of angular radius `radius_rad` (0..pi/2), for radiance 1 (so its unit is sr; times
/// L): the integral of max(0, n.d) over the cap. The ring at angle a from the axis is integrated in
/// closed form, the rings by adaptive quadrature split where a ring first meets the horizon.
/// Error below 1e-9 of the unclipped value pi sin^2 radius.
double cap_irradiance(double radius_rad, double normal_to_axis_rad);

/// The vector irradiance of the cap for radiance 1, pi sin^2 radius: what a receiver that faces the
/// cap gets. While the whole cap is above the horizon, cap_irradiance is this times the cosine.
double cap_vector_irradiance(double radius_rad);

/// The solid angle of the cap, 2 pi (1 - cos radius), in sr.
double cap_solid_angle(double radius_rad);

/// The radius in rad of the uniform cap over which the mean of 1 - cos(angle to the axis) is
/// `mean_versine`: cos radius = 1 - 2 <1 - cos>, computed as 2 asin sqrt<1 - cos>, 0..pi.
double cap_radius_from_mean_versine(double mean_versine);

}  // namespace lightwell::reference
