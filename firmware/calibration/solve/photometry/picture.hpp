// Pictures of the photometric solvers, independent of the pixel format, and the samples of an exposure series for
// response_solver.hpp. A uniform patch of a picture, such as a grey card: its mean linear values, the white balance
// under the reference illuminant, and the absolute radiometric scale from one reading of a luminance or lux meter.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <lightwell/calibration.hpp>
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

/// invalid_argument, with `what`, unless there are `least` pictures or more, of the same size, kind and levels.
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
/// pictures that are not alike or too small, a wrong number of exposures, fewer than 20 blocks left.
[[nodiscard]] Result<ResponseSamples> choose_samples(std::span<const Picture> pictures,
                                                     std::span<const double> exposures, double dark_value,
                                                     double saturation);

/// Rectangle in pixels of the lens's picture; (x, y) is the top left pixel.
struct PatchRect {
  int x = 0, y = 0, width = 0, height = 0;
};

struct PatchMean {
  std::array<double, 3> mean{};       ///< Linear value x, black level subtracted.
  std::array<double, 3> deviation{};  ///< Standard deviation of the means.
  double count = 0;                   ///< Number of sites.
};

/// Means without sites more than five standard deviations off (specks). invalid_argument, with `name` and remedy: a
/// patch of fewer than 16 sites or outside the picture, more than 0.1 % saturated, darker than 0.02 of full scale in a
/// channel, or not uniform (standard deviation above a fifth of the mean).
[[nodiscard]] Result<PatchMean> patch_mean(const Picture& picture, const PatchRect& patch,
                                           const PhotometricCalibration& photometry, const std::string& name);

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

/// Luminance of the patch, cd/m², with its relative standard deviation.
struct MeterReading {
  double nits = 0;
  double deviation = 0;
};

/// Reading of a luminance meter. DIN 5032-7 allows 7.5 % for class B, about two standard deviations: 0.04.
[[nodiscard]] Result<MeterReading> luminance_reading(double nits, double deviation = 0.04);
/// Reading of a lux meter that lies on a matte surface of known albedo: nits = lux * albedo / pi.
[[nodiscard]] Result<MeterReading> illuminance_reading(double lux, double albedo, double deviation = 0.04,
                                                       double albedo_deviation = 0.02);

/// Exposure of the picture of the patch.
struct PatchExposure {
  double exposure_s = 0, gain = 1;
  double vignetting = 1;  ///< Mean relative illumination over the patch.
};

struct AbsoluteScale {
  double nits_per_unit = 0;  ///< RigParameters::nits_per_unit.
  double deviation = 0;      ///< Standard deviation, cd/m².
};

/// nits_per_unit = nits / (luminance of white_balance * x / (exposure_s * gain * vignetting)).
[[nodiscard]] Result<AbsoluteScale> solve_absolute_scale(const PatchMean& patch,
                                                         const std::array<double, 3>& white_balance,
                                                         const PatchExposure& exposure, const MeterReading& reading);

}  // namespace lightwell::photometry
