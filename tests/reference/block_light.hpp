// Light of square blocks of a lens's picture, pixel by pixel, and the harmonics that such blocks give.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "reference/vector.hpp"

namespace lightwell::reference {

/// What each pixel of a lens sees; rows from the top. No solid angle: it sees nothing, and whatever it holds is no
/// light.
struct LensPixels {
  int width = 0, height = 0;
  std::vector<V3> direction;
  std::vector<double> solid_angle;         ///< sr
  std::vector<double> inverse_vignetting;  ///< 1 / relative illumination.
};

/// From numbers of a sensor to light.
struct Sensor {
  enum class Curve { linear, srgb, gamma, table };
  Curve curve = Curve::linear;
  double gamma = 1;
  std::vector<double> table;  ///< Linear values at evenly spaced picture values from 0 to 1.
  double black = 0;           ///< Linear value of no light.
  double saturation = 1;      ///< Picture values from here on mean "at least".
  double read_noise = 0;      ///< Deviation, share of full scale.
  double shot_noise = 0;      ///< Variance per linear value.
  Rgb white{1, 1, 1};
};

/// Linear value of a picture value of 0 to 1, no light at 0 and full scale at 1: (curve(v) - black) / (1 - black).
double linear_value(const Sensor& sensor, double value);

/// What a pixel's colour is made of: red, two greens, blue. In a mosaic the four photosites of its quad; where a pixel
/// has one green both are that.
struct Codes {
  unsigned red = 0, green1 = 0, green2 = 0, blue = 0;
  unsigned beside = 0;  ///< The largest code of the pixels that share its colour, where some do.
};

/// One picture of codes 0 to `levels` - 1.
struct CodePicture {
  unsigned levels = 256;
  double exposure = 1;  ///< Seconds times gain.
  std::vector<Codes> codes;
};

/// Light from where one pixel looks.
struct PixelLight {
  Rgb radiance{};
  double variance = 0;   ///< Of the radiance by noise and rounding; one number for all channels.
  bool clipped = false;  ///< Saturated in every exposure: the radiance is a lower bound.
};

/// With linear values x of the sensor: radiance = x / (exposure * vignetting) * white, green the mean of the two. The
/// variance of x is read² + shot * x + step² / 12, with x of green light in a picture that is alone and of the
/// brightest channel in a bracket, and the step to the brightest code from the one below (from 0 to 1 for code 0).
/// Saturated is a pixel with a code of at least saturation * (levels - 1), in a bracket one that shares its colour with
/// such a pixel, too. Of several pictures each weighs by the inverse variance of its radiance, saturated ones not at
/// all; saturated in all, the largest bound of each channel counts.
std::vector<PixelLight> light_of(const LensPixels& lens, const Sensor& sensor, std::span<const CodePicture> bracket);

/// Blocks of a lens, row by row from the top left; the last of a row or column may be smaller.
struct BlockLight {
  Rgb sum{};        ///< Integral of radiance over the block's solid angle.
  double peak = 0;  ///< Largest luminance of a pixel with solid angle.
  V2 offset;        ///< Mean position of the luminance less that of the solid angle, in pixels. Zero in the dark.
  double luminance = 0, solid_angle = 0;
};
struct LensLight {
  std::vector<BlockLight> blocks;
  double clipped_sr = 0;
  double noise = 0;  ///< Sum of solid_angle² times variance.
};
LensLight block_light(const LensPixels& lens, std::span<const PixelLight> pixels, int edge);

/// Mean of each harmonic of bands 0 to `band` over each block by its pixels' solid angles, (band + 1)² numbers a block.
/// A block that sees nothing has zeros.
std::vector<double> block_harmonics(const LensPixels& lens, int edge, int band);

/// Coefficients of light that came through cells: c_k = sum over cells of sum_i times mean harmonic k of cell i. With
/// `fitted_band` of 0 or more, the bands up to it are those that explain the cells best instead: the least squares of
/// (mean radiance of a cell - sum of c_k mean harmonic k), weighted by solid angle, by Cholesky's factors of the normal
/// equations. `means` as of block_harmonics, of all lenses one after another.
std::vector<Rgb> cell_coefficients(std::span<const double> means, int band, std::span<const double> solid_angle,
                                   std::span<const Rgb> sums, int fitted_band);

}  // namespace lightwell::reference
