// Radiance of the square blocks of a lens image, computed pixel by pixel, and the spherical harmonics that such blocks
// give.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "reference/vector.hpp"

namespace lightwell::reference {

/// Geometry of each pixel of a lens; rows from the top. A pixel without solid angle sees nothing; its value is ignored.
struct LensPixels {
  int width = 0, height = 0;
  std::vector<V3> direction;
  std::vector<double> solid_angle;         ///< sr
  std::vector<double> inverse_vignetting;  ///< 1 / relative illumination.
};

/// Response, noise and white balance of a sensor.
struct Sensor {
  enum class Curve { linear, srgb, gamma, table };
  Curve curve = Curve::linear;
  double gamma = 1;
  std::vector<double> table;  ///< Linear values at evenly spaced encoded values from 0 to 1.
  double black = 0;           ///< Linear value without light.
  double saturation = 1;      ///< Encoded values from here on are saturated: lower bounds.
  double read_noise = 0;      ///< Standard deviation relative to full scale.
  double shot_noise = 0;      ///< Variance per linear value.
  Rgb white{1, 1, 1};
};

/// Linear value of an encoded value of 0 to 1, 0 without light and 1 at full scale: (curve(v) - black) / (1 - black).
double linear_value(const Sensor& sensor, double value);

/// Codes of a pixel: red, two greens, blue. In a mosaic, the four photosites of its quad; for formats with one green,
/// both are equal.
struct Codes {
  unsigned red = 0, green1 = 0, green2 = 0, blue = 0;
  unsigned beside = 0;  ///< The largest code of the pixels that share its chroma, if any.
};

/// One image with codes 0 to `levels` - 1.
struct CodePicture {
  unsigned levels = 256;
  double exposure = 1;  ///< Seconds times gain.
  std::vector<Codes> codes;
};

/// Radiance of one pixel.
struct PixelLight {
  Rgb radiance{};
  double variance = 0;   ///< Variance of the radiance by noise and rounding; the same for all channels.
  bool clipped = false;  ///< Saturated in every exposure: the radiance is a lower bound.
};

/// With linear sensor values x: radiance = x / (exposure * vignetting) * white; green is the mean of the two. The
/// variance of x is read² + shot * x + step² / 12, where x is green for a single image and the brightest channel for a
/// bracket, and step is the difference between the brightest code and the one below (from 0 to 1 for code 0). A pixel
/// with a code of at least saturation * (levels - 1) is saturated; in a bracket also one that shares its chroma with
/// such a pixel. The images of a bracket are averaged with the inverse variance of their radiance, without saturated
/// ones; if all are saturated, the largest bound of each channel is used.
std::vector<PixelLight> light_of(const LensPixels& lens, const Sensor& sensor, std::span<const CodePicture> bracket);

/// Blocks of a lens, row by row from the top left; the last of a row or column may be smaller.
struct BlockLight {
  Rgb sum{};        ///< Integral of radiance over the block's solid angle.
  double peak = 0;  ///< Largest luminance of a pixel with solid angle.
  V2 offset;        ///< Luminance centroid minus solid-angle centroid, in pixels. Zero for a dark block.
  double luminance = 0, solid_angle = 0;
};
struct LensLight {
  std::vector<BlockLight> blocks;
  double clipped_sr = 0;
  double noise = 0;  ///< Sum of solid_angle² times variance.
};
LensLight block_light(const LensPixels& lens, std::span<const PixelLight> pixels, int edge);

/// Mean of each harmonic of bands 0 to `band` over each block, weighted by solid angle: (band + 1)² values per block.
/// Zeros for a block without solid angle.
std::vector<double> block_harmonics(const LensPixels& lens, int edge, int band);

/// Coefficients from cells: c_k = sum over cells i of sum_i times mean harmonic k of cell i. With `fitted_band` of 0 or
/// more, the bands up to it are a least-squares fit instead: minimize (mean radiance of a cell - sum of c_k mean
/// harmonic k)², weighted by solid angle, by the Cholesky factorization of the normal equations. `means`:
/// block_harmonics() of all lenses, concatenated.
std::vector<Rgb> cell_coefficients(std::span<const double> means, int band, std::span<const double> solid_angle,
                                   std::span<const Rgb> sums, int fitted_band);

}  // namespace lightwell::reference
