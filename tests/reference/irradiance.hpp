// Irradiance of a panorama by brute force, and the error of an estimate of it.
#pragma once

#include <vector>

#include "reference/panorama.hpp"
#include "reference/vector.hpp"

namespace lightwell::reference {

/// The irradiance at the unit normal n: the sum over all pixels of max(0, n.d) L d_omega, d the
/// pixel's centre. Lux where radiance is in cd/m2; not divided by pi. The image must be finite
/// (see cleaned).
Rgb irradiance(const Panorama& p, const V3& n);

/// The same at many normals, in their order; arranged so that 2,048 normals over 1024x512 pixels
/// take seconds. Every pixel counts for every normal.
std::vector<Rgb> irradiance_at(const Panorama& p, const std::vector<V3>& normals);

/// Relative error of an estimate.
struct IrradianceError {
  /// RMS of the difference over normals and three channels, divided by the RMS of the truth. With
  /// fibonacci_normals(2048) it is proto/README.md's error of irradiance.
  double rms = 0;
  /// The same with squared difference and squared truth weighted 0.2126, 0.7152, 0.0722 by
  /// channel.
  double luminance_weighted = 0;
  /// The largest absolute difference of any normal and channel, divided by the (unweighted) RMS of
  /// the truth.
  double largest = 0;
};

/// Truth and estimate at the same normals. A truth of zero gives 0 when the estimate is zero too,
/// infinity otherwise.
IrradianceError irradiance_error(const std::vector<Rgb>& truth, const std::vector<Rgb>& estimate);

}  // namespace lightwell::reference
