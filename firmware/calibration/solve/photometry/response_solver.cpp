#include "calibration/solve/photometry/response_solver.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>

#include <lightwell/quantile.hpp>
#include <lightwell/text.hpp>

#include "calibration/model/response.hpp"
#include "calibration/solve/photometry/response_fit.hpp"
#include "calibration/solve/photometry/robust.hpp"

namespace lightwell::photometry {
namespace {

constexpr double kMinExposureRange = 4;
constexpr std::size_t kMinPixels = 20;
/// Distance from dark below which values are rejected: their logarithm is mostly noise.
constexpr double kFoot = 0.005;
/// Margins of the hat above dark and below saturation, so that noise carries no weighted value out of the range.
constexpr double kHatFoot = 0.02, kHatEnd = 0.007;
/// Fraction of the scale over which the weight falls to zero towards saturation.
constexpr double kShoulder = 0.03;
constexpr int kRounds = 2;
/// Number of knots of the free curve; time is proportional to the cube.
constexpr int kKnots = 33;
/// Size of the resulting table, which is interpolated.
constexpr int kEntries = 256;
/// Largest difference from the table at which a parametric curve is preferred: half a level of 8 bits.
constexpr double kTolerance = 0.002;

Status invalid(const std::string& what) { return invalid_argument("response: " + what); }

std::string text(double v) { return formatted("%.3g", v); }

Status check_exposures(const ResponseSamples& in) {
  std::vector<double> sorted = in.exposures;
  for (const double e : sorted)
    if (!(e > 0) || !std::isfinite(e))
      return invalid("an exposure of " + text(e) + "; exposure times gain must be positive");
  std::sort(sorted.begin(), sorted.end());
  std::size_t different = sorted.empty() ? 0 : 1;
  for (std::size_t i = 1; i < sorted.size(); ++i) different += sorted[i] > 1.01 * sorted[i - 1] ? 1 : 0;
  if (different < 3)
    return invalid(std::to_string(different) +
                   " different exposures; take three or more, each twice as long as the one before");
  if (sorted.back() < kMinExposureRange * sorted.front())
    return invalid("the exposures span a factor of " + text(sorted.back() / sorted.front()) +
                   " only; let the longest be at least four times the shortest, 64 times or more is better");
  return {};
}

struct Usable {
  std::vector<ResponseSample> samples;
  std::size_t pixels = 0;
  double low = 0, high = 1;        ///< Support of the hat.
  double lowest = 1, highest = 0;  ///< Range of all samples.

  /// Maximum near white: the precision of the logarithm is proportional to the value.
  [[nodiscard]] double hat(double value) const {
    const double top = high - kShoulder * (high - low);
    return std::max(0.0, std::min((value - low) / (top - low), (high - value) / (high - top)));
  }
};

Result<Usable> usable_of(const ResponseSamples& in, int channel) {
  const double low = in.dark_value + kFoot * (1 - in.dark_value), high = in.saturation;
  Usable out;
  out.low = in.dark_value + kHatFoot * (1 - in.dark_value);
  out.high = high - kHatEnd;
  std::vector<double> increases;  // One entry per pixel with two comparable values.
  for (const PixelSeries& pixel : in.pixels) {
    if (channel >= 0 && pixel.channel != channel) continue;
    if (pixel.values.size() != in.exposures.size())
      return invalid(formatted("a pixel has %zu values for %zu exposures", pixel.values.size(), in.exposures.size()));
    std::vector<ResponseSample> own;
    for (std::size_t j = 0; j < pixel.values.size(); ++j) {
      const double v = pixel.values[j];
      if (!std::isfinite(v)) return invalid("a picture value is not finite");
      if (!(v > low && v < high)) continue;
      own.push_back({out.pixels, j, v, std::log(in.exposures[j]), out.hat(v), v});
    }
    if (own.size() < 2) continue;
    const auto [first, last] = std::minmax_element(
        own.begin(), own.end(), [](const auto& a, const auto& b) { return a.log_exposure < b.log_exposure; });
    if (last->log_exposure - first->log_exposure > 0.5) increases.push_back(last->value - first->value);
    ++out.pixels;
    for (const ResponseSample& s : own) {
      out.lowest = std::min(out.lowest, s.value);
      out.highest = std::max(out.highest, s.value);
      out.samples.push_back(s);
    }
  }
  if (out.pixels < kMinPixels)
    return invalid(std::to_string(out.pixels) + " pixels are neither dark nor saturated in two exposures or more, " +
                   std::to_string(kMinPixels) +
                   " are needed; choose exposures closer to each other, or a scene with more shades");
  if (increases.empty() || median(increases) < 0.02)
    return invalid(
        "the picture values do not follow the exposures; turn off automatic exposure and gain, and see that each "
        "exposure was in force when its picture was taken");
  // Compare with a quarter of the scale, since the hat has small weights at both ends.
  const double span = high - low;
  if (out.lowest > low + 0.25 * span || out.highest < high - 0.25 * span)
    return invalid("values of pixels seen in several exposures cover " + text(out.lowest) + " to " + text(out.highest) +
                   " of full scale only; take shorter and longer exposures, or a scene with more shades");
  return out;
}

/// Linear value x of a picture value on a parametric curve: 0 at dark, 1 at full scale.
double parametric_x(const ResponseCurve& curve, double dark, double value) {
  const double black = linearized(curve, dark);
  return (linearized(curve, value) - black) / (1 - black);
}

LogCurve log_curve(const ResponseCurve& curve, double dark) {
  return [curve, dark](double v) { return std::log(std::max(1e-12, parametric_x(curve, dark, v))); };
}

/// Isotonic regression by pooling adjacent violators (Ayer et al. 1955).
void make_increasing(std::vector<double>& values) {
  struct Run {
    double mean;
    std::size_t count;
  };
  std::vector<Run> runs;
  for (const double v : values) {
    runs.push_back({v, 1});
    while (runs.size() > 1 && runs[runs.size() - 2].mean > runs.back().mean) {
      const Run last = runs.back();
      runs.pop_back();
      Run& before = runs.back();
      const auto count = before.count + last.count;
      before.mean = (before.mean * static_cast<double>(before.count) + last.mean * static_cast<double>(last.count)) /
                    static_cast<double>(count);
      before.count = count;
    }
  }
  std::size_t i = 0;
  for (const Run& run : runs)
    for (std::size_t k = 0; k < run.count; ++k) values[i++] = run.mean;
}

struct Table {
  ResponseCurve curve;
  double black_level = 0;
};

/// Table of response^-1 = b + (1 - b) x. Below dark x is extrapolated linearly; with b the table begins at 0.
Table table_of(const std::function<double(double)>& x, double dark) {
  constexpr double kStep = 1.0 / 512;
  const double slope = dark > 0 ? x(dark + kStep) / kStep : 0;
  Table out;
  out.black_level = slope * dark / (1 + slope * dark);
  out.curve.kind = ResponseCurve::Kind::table;
  for (int i = 0; i < kEntries; ++i) {
    const double v = static_cast<double>(i) / (kEntries - 1);
    const double light = v < dark ? slope * (v - dark) : x(v);
    out.curve.inverse.push_back(std::clamp(out.black_level + (1 - out.black_level) * light, 0.0, 1.0));
  }
  make_increasing(out.curve.inverse);
  out.curve.inverse.front() = 0;
  out.curve.inverse.back() = 1;
  return out;
}

/// Updates each sample's prediction, and its hat weight: its own noise would bias it. `x`: the fitted curve.
void update_predictions(const Usable& usable, const std::function<double(double)>& x, const ResponseFit& fit,
                        double dark, std::vector<ResponseSample>& samples) {
  constexpr int kSteps = 2048;
  std::vector<double> logs;
  for (int i = 0; i <= kSteps; ++i) logs.push_back(std::log(std::max(1e-12, x(dark + (1 - dark) * i / kSteps))));
  make_increasing(logs);
  for (ResponseSample& s : samples) {
    const double log_linear = fit.log_light[s.pixel] + s.log_exposure;
    const auto above =
        std::clamp<std::ptrdiff_t>(std::lower_bound(logs.begin(), logs.end(), log_linear) - logs.begin(), 1, kSteps);
    const auto k = static_cast<std::size_t>(above);
    const double share =
        logs[k] > logs[k - 1] ? std::clamp((log_linear - logs[k - 1]) / (logs[k] - logs[k - 1]), 0.0, 1.0) : 0;
    s.expected = dark + (1 - dark) * (static_cast<double>(above) - 1 + share) / kSteps;
    s.hat = usable.hat(s.expected);
  }
}

/// Fits of all kinds of curves, each linearised at its own predictions: another curve's would add its errors.
struct Fits {
  std::vector<ResponseCurve> parametric;  ///< Parametric curves, the simplest first.
  GammaFit gamma;
  ResponseCurve base;  ///< The best parametric curve: base of the free one.
  DepartureFit free;
  std::vector<ResponseSample> samples;  ///< With predictions of the free curve, for the comparison of all curves.

  [[nodiscard]] double free_x(double dark, double v) const {
    return parametric_x(base, dark, v) * std::exp(departure_at(free, v));
  }
};

Fits fit_all(const Usable& usable, const ResponseSamples& in, double least) {
  const double dark = in.dark_value;
  Fits out;
  out.parametric.resize(3);
  out.parametric[1].kind = ResponseCurve::Kind::srgb;
  out.parametric[2].kind = ResponseCurve::Kind::gamma;
  out.samples = usable.samples;
  out.gamma = fit_gamma(out.samples, usable.pixels, dark, least, in.exposure_deviation);
  for (int round = 0; round < kRounds; ++round) {
    const LogCurve curve = gamma_curve(out.gamma.gamma, dark);
    update_predictions(
        usable, [&](double v) { return std::exp(curve(v)); }, out.gamma.fit, dark, out.samples);
    out.gamma = fit_gamma(out.samples, usable.pixels, dark, least, in.exposure_deviation);
  }
  out.parametric[2].gamma = out.gamma.gamma;

  out.samples = usable.samples;
  double nearest = -1;
  for (const ResponseCurve& c : out.parametric) {
    const double loss = absolute_loss(out.samples, usable.pixels, log_curve(c, dark));
    if (nearest >= 0 && loss >= nearest) continue;
    nearest = loss;
    out.base = c;
  }
  const LogCurve base = log_curve(out.base, dark);
  out.free = fit_departure(out.samples, usable.pixels, base, dark, kKnots, least, in.exposure_deviation);
  for (int round = 0; round < kRounds; ++round) {
    update_predictions(
        usable, [&](double v) { return out.free_x(dark, v); }, out.free.fit, dark, out.samples);
    out.free =
        fit_departure(out.samples, usable.pixels, base, dark, kKnots, least, in.exposure_deviation, out.free.departure);
  }
  return out;
}

}  // namespace

std::string_view to_string(ResponseCurve::Kind kind) {
  using Kind = ResponseCurve::Kind;
  return kind == Kind::linear ? "linear" : kind == Kind::srgb ? "srgb" : kind == Kind::table ? "table" : "gamma";
}

double free_curve(const ResponseEstimate& estimate, double value) {
  const auto& at = estimate.knot_value;
  if (at.size() < 2) return 0;
  const auto above = std::clamp<std::ptrdiff_t>(std::lower_bound(at.begin(), at.end(), value) - at.begin(), 1,
                                                static_cast<std::ptrdiff_t>(at.size()) - 1);
  const auto k = static_cast<std::size_t>(above);
  const double share = (value - at[k - 1]) / (at[k] - at[k - 1]);
  return estimate.knot_linear[k - 1] * (1 - share) + estimate.knot_linear[k] * share;
}

Result<ResponseEstimate> solve_response(const ResponseSamples& in, int channel) {
  if (const Status s = check_exposures(in); !s.ok()) return s;
  if (!(in.dark_value >= 0 && in.dark_value < 0.5 && in.saturation > in.dark_value + 0.2 && in.saturation <= 1))
    return invalid("dark value " + text(in.dark_value) + " and saturation " + text(in.saturation) +
                   " leave no range between them; check the dark pictures");
  const Result<Usable> usable = usable_of(in, channel);
  if (!usable) return usable.status();
  // Lower limit of the residuals' scale: the standard deviation of rounding.
  const double least = std::max(1e-6, rounding_deviation(in.levels));
  const Fits fits = fit_all(*usable, in, least);
  const std::vector<ResponseSample>& samples = fits.samples;
  const DepartureFit& free = fits.free;
  const auto free_x = [&](double v) { return fits.free_x(in.dark_value, v); };
  const Table table = table_of(free_x, in.dark_value);

  ResponseEstimate out;
  const double count = std::max(2.0, static_cast<double>(samples.size() - usable->pixels));
  const auto score = [&](ResponseCurve::Kind kind, double loss, double parameters, double from_table) {
    out.scores.push_back({kind, loss + parameters * std::log(count), from_table});
    return out.scores.back();
  };
  struct Choice {
    ResponseScore score;
    ResponseCurve curve;
    ResponseFit fit;
    bool near_enough = false;
  };
  Choice choice;
  for (const ResponseCurve& c : fits.parametric) {
    ResponseFit fit = fit_light(samples, usable->pixels, log_curve(c, in.dark_value), free.fit.scale, least);
    double from_table = 0;
    for (int i = 0; i <= 256; ++i) {
      const double v = in.dark_value + (1 - in.dark_value) * i / 256;
      from_table = std::max(from_table, std::abs(parametric_x(c, in.dark_value, v) - free_x(v)));
    }
    const bool first = out.scores.empty(), near_enough = from_table <= kTolerance;
    const ResponseScore s = score(c.kind, fit.loss, c.kind == ResponseCurve::Kind::gamma ? 1 : 0, from_table);
    // Choose the simplest curve within the tolerance, otherwise the one with the best criterion.
    if (choice.near_enough || !(first || near_enough || s.criterion < choice.score.criterion)) continue;
    choice = {s, c, std::move(fit), near_enough};
  }
  const double of_near = fits.base.kind == ResponseCurve::Kind::gamma ? 1 : 0;
  const ResponseScore of_table = score(ResponseCurve::Kind::table, free.fit.loss, free.freedom + of_near, 0);
  const bool is_free = !choice.near_enough && of_table.criterion < choice.score.criterion;
  const ResponseFit& fit = is_free ? free.fit : choice.fit;
  out.response = is_free ? table.curve : choice.curve;
  out.black_level = is_free ? table.black_level : linearized(choice.curve, in.dark_value);
  if (out.response.kind == ResponseCurve::Kind::gamma) out.gamma_deviation = std::sqrt(fits.gamma.variance);

  for (std::size_t i = 0; i < free.knots.size(); ++i) {
    out.knot_value.push_back(free.knots[i]);
    out.knot_linear.push_back(i == 0 ? 0 : free_x(free.knots[i]));
  }
  for (std::size_t i = 0; i < free.knots.size(); ++i)
    for (std::size_t k = 0; k < free.knots.size(); ++k)
      out.knot_covariance.push_back(out.knot_linear[i] * out.knot_linear[k] *
                                    free.covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)));

  std::vector<double> differences;
  const PhotometricCalibration shown{.response = out.response, .black_level = out.black_level};
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const double linear = std::exp(fit.log_light[samples[k].pixel] + samples[k].log_exposure);
    const bool counted = fit.weight[k] > 0 || samples[k].hat == 0;
    out.points.push_back({samples[k].value, linear, counted});
    out.outliers += counted ? 0 : 1;
    if (counted)
      differences.push_back(encoded(shown.response, shown.black_level + (1 - shown.black_level) * linear) -
                            samples[k].value);
  }
  out.samples = static_cast<int>(samples.size());
  out.residual = scale_about_zero(differences);
  return out;
}

}  // namespace lightwell::photometry
