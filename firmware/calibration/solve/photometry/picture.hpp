// Pictures of the photometric solvers, independent of the pixel format, and the samples of an exposure series for
// response_solver.hpp.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <lightwell/pixel.hpp>
#include <lightwell/result.hpp>

#include "imaging/frame.hpp"

namespace lightwell::photometry {

/// Picture values as fractions of full scale, r, g, b per site, rows from the top. In a Bayer mosaic a site is a 2 x 2
/// block with its red, its upper right green and its blue; the mean of both greens would have less noise than a pixel.
struct Picture {
  int width = 0, height = 0;  ///< Sites.
  int levels = 0;             ///< Number of codes, 256 for 8 bits; 0: not quantised.
  int pitch = 1;              ///< Distance of sites in pixels of the lens's picture, 2 for a mosaic.
  std::vector<float> rgb;

  [[nodiscard]] std::size_t sites() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
  [[nodiscard]] float at(int x, int y, int channel) const {
    return rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) +
               static_cast<std::size_t>(channel)];
  }
};

/// Accepts rgb8, Bayer formats, and rgb_f32 (converted raw files), whose values are fractions of full scale, too;
/// `float_levels` is the number of codes before the conversion. invalid_argument, with `name`: nv12 and yuyv, whose
/// values mix neighbours; data too small for the size; floats that are not finite.
[[nodiscard]] Result<Picture> picture_of(const View& view, const std::string& name, int float_levels = 0);

/// Standard deviation of rounding to a code, as a fraction of full scale.
[[nodiscard]] double rounding_deviation(int levels);

/// invalid_argument unless there are at least `least` pictures, all with the same size, kind and number of levels;
/// `what` names them in the message.
[[nodiscard]] Status check_alike(std::span<const Picture> pictures, std::size_t least, const std::string& what);

/// The values of one channel of a pixel over the series of exposures.
struct PixelSeries {
  int channel = 0;             ///< 0 red, 1 green, 2 blue.
  std::vector<double> values;  ///< Picture values as fractions of full scale, one per exposure.
};

struct ResponseSamples {
  std::vector<double> exposures;  ///< exposure_s * gain.
  std::vector<PixelSeries> pixels;
  int levels = 256;          ///< Number of codes; 0: not quantised.
  double dark_value = 0;     ///< Picture value without light, from dark frames.
  double saturation = 0.98;  ///< Values from here on are lower bounds.
  /// Relative standard deviation of each exposure: shutters count rows, and drivers round.
  double exposure_deviation = 0.001;
};

/// Chooses blocks spread first over brightness classes, then over the picture, preferring uniform ones; each gives a
/// series of one channel. `exposures`: exposure_s * gain, one per picture. Blocks that become darker in a longer
/// exposure (motion) are rejected; a block with a pixel well above saturation counts as saturated. invalid_argument:
/// pictures that differ in size or kind, a wrong number of exposures, pictures that are too small, fewer than 20 blocks
/// left.
[[nodiscard]] Result<ResponseSamples> choose_samples(std::span<const Picture> pictures,
                                                     std::span<const double> exposures, double dark_value,
                                                     double saturation);

}  // namespace lightwell::photometry
