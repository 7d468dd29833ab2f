// White balance from a grey card in the light that shall count as white.
#pragma once

#include <array>

#include <lightwell/result.hpp>

#include "calibration/photometry/patch.hpp"

namespace lightwell::photometry {

struct WhiteBalance {
  /// Multiply linear r, g, b. Green's is 1: it carries 72 % of luminance and is where a sensor has most signal, so a
  /// luminance, and with it the absolute scale and the exposure that saturates, stay about as they are when the balance
  /// is made anew.
  std::array<double, 3> factors{1, 1, 1};
  std::array<double, 4> covariance{};  ///< Of red's and blue's, row by row; both share green's noise.
};

/// Linear Rec. 709 of a light by its CIE 1931 chromaticity, luminance 1. invalid_argument outside the gamut.
[[nodiscard]] Result<std::array<double, 3>> rgb_of_chromaticity(double x, double y);

/// `illuminant`: linear Rec. 709 of the light on the card; equal numbers are D65. Vignetting is the same for the three
/// channels of a pixel and cancels. invalid_argument where a mean is not positive.
[[nodiscard]] Result<WhiteBalance> solve_white_balance(const PatchMean& card,
                                                       const std::array<double, 3>& illuminant = {1, 1, 1});

}  // namespace lightwell::photometry
