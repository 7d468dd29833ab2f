// White balance from a grey card under the reference illuminant.
#pragma once

#include <array>

#include <lightwell/result.hpp>

#include "calibration/solve/photometry/patch.hpp"

namespace lightwell::photometry {

struct WhiteBalance {
  /// Factors on linear r, g, b. The factor of green is 1, because green contributes 72 % of luminance and has the
  /// strongest signal: luminance, absolute scale and saturation then hardly change when the balance is redone.
  std::array<double, 3> factors{1, 1, 1};
  std::array<double, 4> covariance{};  ///< Of the factors of red and blue, row-major; both depend on green's noise.
};

/// Linear Rec. 709 r, g, b of luminance 1 for a CIE 1931 chromaticity. invalid_argument outside the gamut.
[[nodiscard]] Result<std::array<double, 3>> rgb_of_chromaticity(double x, double y);

/// `illuminant`: linear Rec. 709 r, g, b of the light on the card; equal values are D65. Vignetting is the same for the
/// three channels of a pixel and cancels. invalid_argument if a mean is not positive.
[[nodiscard]] Result<WhiteBalance> solve_white_balance(const PatchMean& card,
                                                       const std::array<double, 3>& illuminant = {1, 1, 1});

}  // namespace lightwell::photometry
