// Equirectangular images of radiance: mapping, solid angles, analytic scenes, rotation.
#pragma once

#include <functional>
#include <vector>

#include "reference/rotation.hpp"
#include "reference/vector.hpp"

namespace lightwell::reference {

/// Radiance over all directions. `rgb` holds 3 * width * height doubles, row-major, R G B a pixel.
/// Pixel centres: u = (i + 0.5) / W, v = (j + 0.5) / H, phi = 2 pi (u - 0.5),
/// theta = pi (0.5 - v), d = (cos theta sin phi, sin theta, -cos theta cos phi).
/// So the centre is -Z, to the right is +X, the top row is +Y. Each pixel is one uniform patch.
struct Panorama {
  int width = 0;
  int height = 0;
  std::vector<double> rgb;
};

/// A scene: radiance as a function of the unit direction from which it comes.
using RadianceFunction = std::function<Rgb(const V3&)>;

/// The radiance of column i, row j.
Rgb pixel(const Panorama& p, int i, int j);
void set_pixel(Panorama& p, int i, int j, const Rgb& radiance);

/// The unit direction of image position (i, j); whole numbers are pixel centres.
V3 pixel_direction(double i, double j, int width, int height);

/// The inverse of pixel_direction for any vector but zero: x in [-0.5, W - 0.5], y in
/// [-0.5, H - 0.5].
V2 direction_to_pixel(const V3& direction, int width, int height);

/// The solid angle in sr of any pixel of row j: (2 pi / W)(sin theta_top - sin theta_bottom), with
/// the difference of sines written as a product, which loses no digits at the poles.
double pixel_solid_angle(int j, int width, int height);

/// A valid image for all functions of this folder: NaN and negative values (also -Inf) become 0;
/// +Inf becomes the largest finite value of the image over all channels (0 if there is none).
Panorama cleaned(const Panorama& p);

/// (1 / 4 pi) times the integral of radiance over the sphere.
Rgb mean_radiance(const Panorama& p);

/// The radiance from `direction`, bilinear between pixel centres. Columns wrap around at the seam;
/// beyond row 0 and row H - 1 the same row is continued on the opposite meridian.
Rgb sample(const Panorama& p, const V3& direction);

/// The same radiance everywhere.
Panorama constant(int width, int height, const Rgb& radiance);

/// The mean of `f` over each pixel: samples_per_axis^2 midpoints of equal steps in u and v, each
/// weighted with its own cell's solid angle, so that f = constant is reproduced exactly.
Panorama from_function(int width, int height, const RadianceFunction& f, int samples_per_axis);

/// A uniform disc of `radiance` around `direction` on black. Pixels at the rim have the covered
/// fraction from rim_samples^2 samples, each of which treats the rim as a ramp as wide as the cell's
/// height (a hard step would cause errors of up to half a cell where the rim is parallel to a row);
/// all other pixels are exact.
Panorama disc_lamp(int width, int height, const V3& direction, double angular_radius_rad, const Rgb& radiance,
                   int rim_samples = 32);

/// The sum of two images of the same size.
Panorama sum(const Panorama& a, const Panorama& b);

/// The rotated scene: radiance from d comes from `rotation` d afterwards. The output may have any
/// size; each pixel is the mean of samples_per_axis^2 bilinear samples of p.
Panorama turned(const Panorama& p, const M3& rotation, int width, int height, int samples_per_axis);

}  // namespace lightwell::reference
