// The response curve from a series of exposures of a scene that stands still: Debevec & Malik 1997, eq. 3.
//   g(Z_ij) = ln E_i + ln t_j        g = ln of the linear value, E_i the light at pixel i, t_j exposure * gain
// weighed by a hat over the values, with a smoothness term. What differs from the paper: g is looked for as a departure
// from the closed curve that comes nearest, and the smoothness is that of the departure, so that a curve which is
// closed is not bent; how smooth is decided by the data (restricted maximum likelihood, Wahba 1985); the hat's top is
// near white, and it goes by the values that the fit expects; observations that disagree, such as things that moved,
// lose their weight (Tukey's biweight).
#pragma once

#include <string_view>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

namespace lightwell::photometry {

/// One pixel's channel through the series.
struct PixelSeries {
  int channel = 0;             ///< 0 red, 1 green, 2 blue.
  std::vector<double> values;  ///< Picture values as shares of full scale, one for each exposure.
};

struct ResponseSamples {
  std::vector<double> exposures;  ///< exposure_s * gain.
  std::vector<PixelSeries> pixels;
  int levels = 256;          ///< 0: not quantised.
  double dark_value = 0;     ///< Picture value of no light, from pictures with the lens covered.
  double saturation = 0.98;  ///< Values from here on mean "at least".
  /// Relative standard deviation of each exposure: a shutter counts rows, and drivers round.
  double exposure_deviation = 0.001;
};

struct ResponseOptions {
  int channel = -1;   ///< Of which channel; -1: one curve for all, which is what a calibration holds.
  int knots = 33;     ///< Where the departure is free; time grows with the cube.
  int entries = 256;  ///< Of the table; between them values are interpolated.
  /// A closed curve is preferred where it is so near to the table everywhere: half a level of 8 bits.
  double tolerance = 0.002;
  [[nodiscard]] Status validate() const;
};

/// How well one kind of curve explains the series.
struct ResponseScore {
  ResponseCurve::Kind kind = ResponseCurve::Kind::linear;
  double criterion = 0;   ///< Schwarz 1978 (BIC): less is better.
  double from_table = 0;  ///< Largest difference from the free curve, share of full scale.
};

/// A sample as the fit sees it: the linear value it stands for by its pixel's light and its exposure.
struct ResponsePoint {
  double value = 0, linear = 0;
  bool counted = true;  ///< false: it disagreed and has no weight.
};

struct ResponseEstimate {
  ResponseCurve response;
  double black_level = 0;  ///< Linear value of `dark_value` on this curve, where x is 0.
  /// Of a gamma.
  double gamma_deviation = 0;
  /// The free curve's knots: picture values, linear values x (0 at dark, 1 at full scale), and their covariance row by
  /// row.
  std::vector<double> knot_value, knot_linear, knot_covariance;
  /// Typical difference of a sample from the curve, share of full scale.
  double residual = 0;
  int samples = 0, outliers = 0;
  std::vector<ResponseScore> scores;
  std::vector<ResponsePoint> points;
};

/// invalid_argument, with what to do, for: fewer than three different exposures, exposures that span less than a factor
/// of four, fewer than 20 pixels of use, values that do not follow the exposures (an automatic exposure) or cover too
/// small a part of the scale.
[[nodiscard]] Result<ResponseEstimate> solve_response(const ResponseSamples& samples,
                                                      const ResponseOptions& options = {});

/// The linear value x of a picture value on the free curve of an estimate, black taken off.
[[nodiscard]] double free_curve(const ResponseEstimate& estimate, double value);

[[nodiscard]] std::string_view to_string(ResponseCurve::Kind kind);

}  // namespace lightwell::photometry
