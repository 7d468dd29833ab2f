// Inside of response_solver: curves fitted to ln g(Z) = ln E + ln t with the light of each pixel eliminated.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace lightwell::photometry {

/// A usable value. Those of one pixel follow each other.
struct ResponseSample {
  std::size_t pixel = 0, exposure = 0;
  double value = 0, log_exposure = 0;
  double hat = 0;  ///< Weight of the residual: 0 at both ends of the scale.
  /// What the fit so far expects the value to be; `value` to begin with. Curves are taken on their tangent there: noise
  /// in the value is then noise in the logarithm, of mean zero, which through the curve itself it is not.
  double expected = 0;
};

/// ln of the linear value (x = 1 at full scale) of a picture value.
using LogCurve = std::function<double(double)>;

/// A curve's residuals once each pixel has the light that fits it best.
struct ResponseFit {
  std::vector<double> residual;   ///< ln, a sample.
  std::vector<double> weight;     ///< hat² times Tukey's.
  std::vector<double> log_light;  ///< A pixel.
  double scale = 0;               ///< Standard deviation of hat * residual.
  double loss = 0;                ///< Sum of 2 * Tukey's loss: chi² where nothing is wrong.
};

/// `scale` 0: from the residuals, at least `min_scale`.
[[nodiscard]] ResponseFit fit_light(std::span<const ResponseSample> samples, std::size_t pixels, const LogCurve& curve,
                                    double scale, double min_scale);

/// The same with the sum of absolute residuals as `loss`: what a search starts from.
[[nodiscard]] double absolute_loss(std::span<const ResponseSample> samples, std::size_t pixels, const LogCurve& curve);

struct GammaFit {
  double gamma = 1, variance = 0;
  ResponseFit fit;
};

/// x = (v^gamma - dark^gamma) / (1 - dark^gamma), gamma from 0.2 to 6. `exposure_deviation`: relative, of each
/// exposure.
[[nodiscard]] GammaFit fit_gamma(std::span<const ResponseSample> samples, std::size_t pixels, double dark,
                                 double min_scale, double exposure_deviation);

struct DepartureFit {
  std::vector<double> knots;   ///< Picture values, evenly spaced from dark to 1.
  Eigen::VectorXd departure;   ///< Of ln x at each knot; 0 at the last.
  Eigen::MatrixXd covariance;  ///< Of the same.
  double freedom = 0;          ///< Effective number of parameters.
  ResponseFit fit;
};

/// `base` plus a smooth departure, linear between knots. `start`: a departure that is near already.
[[nodiscard]] DepartureFit fit_departure(std::span<const ResponseSample> samples, std::size_t pixels,
                                         const LogCurve& base, double dark, int knots, double min_scale,
                                         double exposure_deviation, const Eigen::VectorXd& start = {});

[[nodiscard]] double departure_at(const DepartureFit& fit, double value);

[[nodiscard]] LogCurve gamma_curve(double gamma, double dark);

}  // namespace lightwell::photometry
