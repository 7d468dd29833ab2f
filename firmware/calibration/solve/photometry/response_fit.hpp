// Implementation of response_solver: fits curves to ln x(Z) = ln E + ln t, with each pixel's ln E eliminated.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace lightwell::photometry {

/// A usable value. The samples of one pixel are consecutive.
struct ResponseSample {
  std::size_t pixel = 0, exposure = 0;
  double value = 0, log_exposure = 0;
  double hat = 0;  ///< Hat weight of the residual (Debevec & Malik): 0 at both ends of the scale.
  /// The value predicted by the previous iteration; initially `value`. Curves are linearised there: zero-mean noise of
  /// the value then remains zero-mean in the logarithm, unlike through the curve itself.
  double expected = 0;
};

/// Maps a picture value to ln of the linear value (x = 1 at full scale).
using LogCurve = std::function<double(double)>;

/// Residuals of a curve with the best-fit light of each pixel.
struct ResponseFit {
  std::vector<double> residual;   ///< In ln x, by sample.
  std::vector<double> weight;     ///< By sample: hat² times Tukey's weight.
  std::vector<double> log_light;  ///< ln E by pixel.
  double scale = 0;               ///< Standard deviation of hat * residual.
  double loss = 0;                ///< Sum of 2 * Tukey's loss: chi² without outliers.
};

/// `scale` 0: estimated from the residuals, at least `min_scale`.
[[nodiscard]] ResponseFit fit_light(std::span<const ResponseSample> samples, std::size_t pixels, const LogCurve& curve,
                                    double scale, double min_scale);

/// Sum of absolute residuals, the criterion of the initial search.
[[nodiscard]] double absolute_loss(std::span<const ResponseSample> samples, std::size_t pixels, const LogCurve& curve);

struct GammaFit {
  double gamma = 1, variance = 0;
  ResponseFit fit;
};

/// Fits x = (v^gamma - dark^gamma) / (1 - dark^gamma), gamma from 0.2 to 6. `exposure_deviation`: relative sigma.
[[nodiscard]] GammaFit fit_gamma(std::span<const ResponseSample> samples, std::size_t pixels, double dark,
                                 double min_scale, double exposure_deviation);

struct DepartureFit {
  std::vector<double> knots;   ///< Picture values, evenly spaced from dark to 1.
  Eigen::VectorXd departure;   ///< Departure of ln x from the base curve at each knot; 0 at the last.
  Eigen::MatrixXd covariance;  ///< Of the departure.
  double freedom = 0;          ///< Effective number of parameters.
  ResponseFit fit;
};

/// Fits `base` plus a smooth departure that is linear between knots. `start`: initial departure.
[[nodiscard]] DepartureFit fit_departure(std::span<const ResponseSample> samples, std::size_t pixels,
                                         const LogCurve& base, double dark, int knots, double min_scale,
                                         double exposure_deviation, const Eigen::VectorXd& start = {});

[[nodiscard]] double departure_at(const DepartureFit& fit, double value);

[[nodiscard]] LogCurve gamma_curve(double gamma, double dark);

}  // namespace lightwell::photometry
