// Response curve from a series of exposures of a static scene: Debevec & Malik 1997, eq. 3.
//   g(Z_ij) = ln E_i + ln t_j        g = ln of the linear value, E_i the light at pixel i, t_j exposure * gain
// with hat weights over the values and a smoothness term. Differences from the paper beside those in README.md: the
// smoothing parameter is estimated (restricted maximum likelihood, Wahba 1985); the hat has its maximum near white;
// outliers, such as moving objects, are downweighted (Tukey's biweight).
#pragma once

#include <string_view>
#include <vector>

#include <lightwell/calibration.hpp>
#include <lightwell/result.hpp>

#include "calibration/solve/photometry/picture.hpp"

namespace lightwell::photometry {

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
  /// Knots of the free curve: picture values, linear values x (0 at dark, 1 at full scale), their row-major covariance.
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
