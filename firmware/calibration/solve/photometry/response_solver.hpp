// Response curve from a series of exposures of a static scene: Debevec & Malik 1997, eq. 3.
//   g(Z_ij) = ln E_i + ln t_j        g = ln of the linear value, E_i the light at pixel i, t_j exposure * gain
// with hat weights over the values and a smoothness term. Differences from the paper (README.md): only the departure of
// g from the nearest parametric curve is smoothed; the smoothing parameter is estimated (restricted maximum likelihood,
// Wahba 1985); the hat has its maximum near white and is evaluated at the predicted values; outliers, such as moving
// objects, are downweighted (Tukey's biweight).
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "calibration/solve/photometry/picture.hpp"

namespace lightwell::photometry {

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

/// Goodness of fit of one kind of curve.
struct ResponseScore {
  ResponseCurve::Kind kind = ResponseCurve::Kind::linear;
  double criterion = 0;   ///< BIC (Schwarz 1978); smaller is better.
  double from_table = 0;  ///< Largest difference from the free curve, fraction of full scale.
};

/// A sample after the fit: its picture value, and the linear value from its pixel's light and its exposure.
struct ResponsePoint {
  double value = 0, linear = 0;
  bool counted = true;  ///< False: an outlier without weight.
};

struct ResponseEstimate {
  ResponseCurve response;
  double black_level = 0;  ///< Linear value of `dark_value` on this curve, at which x is 0.
  /// Standard deviation of the exponent of a gamma curve.
  double gamma_deviation = 0;
  /// Knots of the free curve: picture values, linear values x (0 at dark, 1 at full scale), and the covariance of the
  /// latter, row-major.
  std::vector<double> knot_value, knot_linear, knot_covariance;
  /// Typical difference of a sample from the curve, fraction of full scale.
  double residual = 0;
  int samples = 0, outliers = 0;
  std::vector<ResponseScore> scores;
  std::vector<ResponsePoint> points;
};

/// The curve of one channel, or of all (-1) as in a calibration. invalid_argument, with the remedy, for: fewer than
/// three different exposures, exposures that span less than a factor of four, fewer than 20 usable pixels, values that
/// do not follow the exposures (automatic exposure) or cover too small a part of the scale.
[[nodiscard]] Result<ResponseEstimate> solve_response(const ResponseSamples& samples, int channel = -1);

/// Linear value x of a picture value on the free curve of an estimate, black level subtracted.
[[nodiscard]] double free_curve(const ResponseEstimate& estimate, double value);

[[nodiscard]] std::string_view to_string(ResponseCurve::Kind kind);

}  // namespace lightwell::photometry
