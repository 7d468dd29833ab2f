// The definition of a panorama's bright region.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "reference/panorama.hpp"
#include "reference/vector.hpp"

namespace lightwell::reference {

/// DEFINITION. The image is `cleaned` (NaN and negative to 0, +Inf to the largest finite value). The
/// peak is the pixel of largest luminance, the first in row-major order among equals. The region is
/// all pixels 8-connected to the peak whose luminance is at or above half the peak's. Columns wrap
/// around at the seam. A step beyond row 0 or row H - 1 leads to the same row across the pole: column
/// i + W/2 and its two neighbours (for odd W, the two columns that touch the opposite meridian).
struct BrightRegion {
  /// Unit vector: the normalised sum of luminance * solid angle * direction. Where that sum is
  /// zero (a constant image), the peak's direction.
  V3 direction;
  /// Sum of L (d . direction) d_omega per channel: the irradiance by the region at a receiver that
  /// faces it. For a uniform cap this is pi sin^2 rho L.
  Rgb vector_irradiance{};
  /// Sum of L d_omega per channel; for small regions about equal to the vector irradiance.
  Rgb radiance_integral{};
  double solid_angle_sr = 0;
  /// Radius of the uniform cap with the same second moment: cos rho = 1 - 2 <1 - cos>, the mean
  /// weighted by luminance * solid angle and taken about `direction`.
  double angular_radius_rad = 0;
  /// Radius of the cap with the same solid angle.
  double solid_angle_radius_rad = 0;
  /// In the image's unit (cd/m2 if absolute).
  double peak_luminance = 0;
  /// Peak luminance divided by the mean luminance of the whole (cleaned) image over the sphere.
  double peak_to_mean = 0;
  /// Row-major indices of the region's pixels, ascending.
  std::vector<std::size_t> pixels;
};

/// The brightest region; none if no pixel is above zero.
std::optional<BrightRegion> bright_region(const Panorama& p);

/// Up to `count` regions by descending peak: each region is set to zero before the next is searched.
/// peak_to_mean refers to the whole image for all of them.
std::vector<BrightRegion> bright_regions(const Panorama& p, int count);

}  // namespace lightwell::reference
