// A picture as numbers that the solvers understand, whatever its encoding was.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <lightwell/pixel.hpp>
#include <lightwell/result.hpp>

#include "camera/frame.hpp"

namespace lightwell::photometry {

/// Picture values as shares of full scale, r g b a site, rows from the top. Of a Bayer mosaic a site is a square of
/// four photosites with its red, its upper right green and its blue: the mean of both greens would have less noise than
/// a pixel.
struct Picture {
  int width = 0, height = 0;  ///< Sites.
  int levels = 0;             ///< Codes that a value can have, 256 of 8 bits; 0: not quantised.
  int pitch = 1;              ///< Pixels of the lens's picture from site to site, 2 of a mosaic.
  std::vector<float> rgb;

  [[nodiscard]] std::size_t sites() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
  [[nodiscard]] float at(int x, int y, int channel) const {
    return rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) +
               static_cast<std::size_t>(channel)];
  }
};

/// rgb8, Bayer, and rgb_f32, whose numbers count as shares of full scale too (raw files that were converted);
/// `float_levels` says how many codes these had. invalid_argument naming `name`: nv12 and yuyv, whose values are
/// mixtures of neighbours; data too small for its size; floats that are not finite.
[[nodiscard]] Result<Picture> picture_of(const View& view, const std::string& name, int float_levels = 0);

/// Standard deviation of rounding to a code, as a share of full scale.
[[nodiscard]] double rounding_deviation(int levels);

/// invalid_argument unless all have one size, kind and number of levels, and there are `least` of them; `what` names
/// them.
[[nodiscard]] Status check_alike(std::span<const Picture> pictures, std::size_t least, const std::string& what);

}  // namespace lightwell::photometry
