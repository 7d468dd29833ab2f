#include "tools/lightwell_calibrate/photometry_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>

#include "calibration/model/response.hpp"
#include "tools/lightwell_eval/drawing.hpp"

namespace lightwell::calibrate {
namespace {

using eval::Anchor;
using eval::Chart;
using eval::ChartPoint;
using eval::Ink;

constexpr Ink kBlack{30, 30, 30}, kGrey{215, 215, 215}, kText{90, 90, 90}, kCurve{31, 90, 180}, kData{220, 120, 20},
    kWrong{170, 170, 170};
constexpr double kPanel = 380, kGap = 100, kTop = 70, kLeft = 80, kBelow = 110;

std::string text(const char* format, double v) {
  std::array<char, 48> out{};
  std::snprintf(out.data(), out.size(), format, v);
  return out.data();
}

/// A step of 1, 2 or 5 times a power of ten that divides `range` into about four.
double nice_step(double range) {
  const double rough = range / 4, power = std::pow(10, std::floor(std::log10(rough)));
  const double share = rough / power;
  return power * (share < 1.5 ? 1 : share < 3.5 ? 2 : share < 7.5 ? 5 : 10);
}

/// One square panel with axes.
class Panel {
 public:
  Panel(Chart& chart, int column, const std::string& title, const std::string& across, const std::string& up,
        double x_end, double y_end)
      : chart_(chart), left_(kLeft + column * (kPanel + kGap)), x_end_(x_end), y_end_(y_end) {
    chart_.texts.push_back({title, {left_, kTop - 28}, 18, kBlack, Anchor::start, true});
    chart_.texts.push_back({across, {left_ + kPanel / 2, kTop + kPanel + 46}, 14, kText, Anchor::middle});
    eval::TextLabel upwards{up, {left_ - 58, kTop + kPanel / 2}, 14, kText, Anchor::middle};
    upwards.upwards = true;
    chart_.texts.push_back(upwards);
    const double dx = nice_step(x_end), dy = nice_step(y_end);
    for (double x = 0; x <= x_end * (1 + 1e-9); x += dx) {
      chart_.strokes.push_back({{at(x, 0), at(x, y_end)}, kGrey, 1});
      chart_.texts.push_back({text("%.4g", x), {at(x, 0).x, kTop + kPanel + 20}, 12.5, kText, Anchor::middle});
    }
    for (double y = 0; y <= y_end * (1 + 1e-9); y += dy) {
      chart_.strokes.push_back({{at(0, y), at(x_end, y)}, kGrey, 1});
      chart_.texts.push_back({text("%.4g", y), {left_ - 8, at(0, y).y + 4}, 12.5, kText, Anchor::end});
    }
    chart_.strokes.push_back({{at(0, 0), at(x_end, 0), at(x_end, y_end), at(0, y_end), at(0, 0)}, kBlack, 1.2});
  }

  void point(double x, double y, bool counted) {
    if (!(x >= 0 && x <= x_end_ && y >= 0 && y <= y_end_)) return;
    chart_.marks.push_back({at(x, y), counted ? 1.6 : 2.6, counted ? kData : kWrong, counted});
  }
  /// A mark with an error bar of one standard deviation in both directions.
  void level(double x, double y, double deviation) {
    const double low = std::clamp(y - deviation, 0.0, y_end_), high = std::clamp(y + deviation, 0.0, y_end_);
    chart_.strokes.push_back({{at(x, low), at(x, high)}, kData, 1.4});
    chart_.marks.push_back({at(x, std::clamp(y, 0.0, y_end_)), 3, kData});
  }
  void curve(const std::function<double(double)>& f, Ink ink, bool dashed = false) {
    eval::Stroke stroke;
    stroke.ink = ink;
    stroke.width = 1.8;
    for (int i = 0; i <= 200; ++i) {
      const double x = x_end_ * i / 200;
      stroke.points.push_back(at(x, std::clamp(f(x), 0.0, y_end_)));
    }
    if (dashed) {  // A dash needs a segment of at least its own length.
      std::vector<ChartPoint> some;
      for (std::size_t i = 0; i < stroke.points.size(); i += 10) some.push_back(stroke.points[i]);
      stroke.points = some;
      stroke.dashed = true;
    }
    chart_.strokes.push_back(stroke);
  }
  void line_of_words(int line, const std::string& words) {
    chart_.texts.push_back({words, {left_, kTop + kPanel + 72 + 19.0 * line}, 13, kBlack});
  }

 private:
  [[nodiscard]] ChartPoint at(double x, double y) const {
    return {left_ + kPanel * x / x_end_, kTop + kPanel * (1 - y / y_end_)};
  }

  Chart& chart_;
  double left_, x_end_, y_end_;
};

void draw_response(const PhotometryRun& run, const PhotometricCalibration& p, Chart& chart) {
  Panel panel(chart, 0, "Response", "linear light x, share of full scale", "picture value, share of full scale", 1, 1);
  panel.curve([&](double x) { return encoded(p.response, p.black_level + (1 - p.black_level) * x); }, kCurve);
  if (!run.response) return panel.line_of_words(0, "not measured: the calibration's curve");
  // Only some of the inliers, so that the curve stays visible; all outliers.
  const auto& points = run.response->points;
  const std::size_t step = std::max<std::size_t>(1, points.size() / 150);
  for (std::size_t k = 0; k < points.size(); k += step)
    if (points[k].counted) panel.point(points[k].linear, points[k].value, true);
  for (const auto& point : points)
    if (!point.counted) panel.point(point.linear, point.value, false);
  panel.line_of_words(0, "curve: " + std::string(photometry::to_string(p.response.kind)) +
                             (p.response.kind == ResponseCurve::Kind::gamma ? text(" %.3f", p.response.gamma) : "") +
                             text("; typical residual %.2f %% of full scale", 100 * run.response->residual));
  panel.line_of_words(1, std::to_string(run.response->samples) + " samples; " + std::to_string(run.response->outliers) +
                             " outliers (hollow, grey); some of the others are drawn");
}

void draw_vignetting(const PhotometryRun& run, const LensParameters& lens, Chart& chart) {
  constexpr double kDegree = std::numbers::pi / 180;
  Panel panel(chart, 1, "Vignetting", "angle from the axis, degrees", "relative illumination",
              lens.max_angle_rad / kDegree, 1.1);
  const auto curve = [&](double degrees) { return vignetting(lens.photometry, degrees * kDegree); };
  panel.curve(curve, kCurve);
  if (!run.vignetting) return panel.line_of_words(0, "not measured: the calibration's curve");
  const photometry::VignettingEstimate& v = *run.vignetting;
  for (const double side : {-3.0, 3.0})
    panel.curve([&](double d) { return curve(d) + side * vignetting_deviation(v, d * kDegree); }, kCurve, true);
  for (std::size_t k = 0; k < run.observations.size(); ++k) {
    const double y = run.observations[k].value / v.level, x = run.observations[k].angle_rad / kDegree;
    if (v.weight[k] > 0)
      panel.level(x, y, run.observations[k].deviation / v.level);
    else
      panel.point(x, y, false);
  }
  panel.line_of_words(0, text("v1 %.4f", v.vignetting[0]) + text(", v2 %.4f", v.vignetting[1]) +
                             text(", v3 %.4f", v.vignetting[2]) + text("; typical residual %.2f %%", 100 * v.residual));
  panel.line_of_words(1, "dashed: 3 sigma; " + std::to_string(run.observations.size()) + " observations, " +
                             std::to_string(v.outliers) + " outliers");
}

void draw_noise(const PhotometryRun& run, const PhotometricCalibration& p, Chart& chart) {
  double x_end = 1, y_end = 0;
  const auto normalised = [](const photometry::NoiseLevel& l) { return l.mean / l.gain; };
  for (const auto& l : run.levels) y_end = std::max(y_end, l.variance / (l.gain * l.gain));
  if (!run.levels.empty()) {
    x_end = 0;
    for (const auto& l : run.levels) x_end = std::max(x_end, 1.08 * normalised(l));
  }
  const auto curve = [&](double x) { return p.read_noise * p.read_noise + p.shot_noise * x; };
  y_end = 1e6 * std::max({y_end, curve(x_end), 1e-9}) * 1.08;
  Panel panel(chart, 2, "Photon transfer", "mean linear light x, by gain", "variance of x, millionths", x_end, y_end);
  panel.curve([&](double x) { return 1e6 * curve(x); }, kCurve);
  if (!run.noise)
    return panel.line_of_words(
        0, run.dark ? "no flats: the line of dark and calibration" : "not measured: the calibration's line");
  for (const auto& l : run.levels)
    panel.level(normalised(l), 1e6 * l.variance / (l.gain * l.gain),
                1e6 * (l.variance + l.rounding) * std::sqrt(2 / l.count) / (l.gain * l.gain));
  if (run.dark && run.dark->resolved)
    panel.level(0, 1e6 * run.dark->read_noise * run.dark->read_noise,
                2e6 * run.dark->read_noise * run.dark->read_deviation);
  panel.line_of_words(0, text("read noise %.4g", run.noise->read_noise) + text(" +- %.1g", run.noise->read_deviation) +
                             text("; shot noise %.4g", run.noise->shot_noise) +
                             text(" +- %.1g", run.noise->shot_deviation));
  panel.line_of_words(1, "rounding noise subtracted; " + std::to_string(run.levels.size()) + " levels" +
                             (run.dark ? " and the dark" : ""));
}

}  // namespace

Status write_report(const PhotometryRun& run, const std::string& path) {
  const LensParameters& lens = run.rig.lenses[static_cast<std::size_t>(run.lens)];
  Chart chart;
  chart.width = kLeft + 3 * kPanel + 2 * kGap + 40;
  chart.height = kTop + kPanel + kBelow + 40;
  draw_response(run, lens.photometry, chart);
  draw_vignetting(run, lens, chart);
  draw_noise(run, lens.photometry, chart);
  const auto& p = lens.photometry;
  chart.texts.push_back(
      {"Lens " + std::to_string(run.lens) + text(": black level %.5f", p.black_level) +
           text("; white balance %.4f", p.white_balance[0]) + text(", %.4f", p.white_balance[1]) +
           text(", %.4f", p.white_balance[2]) +
           (run.rig.nits_per_unit > 0 ? text("; %.5g cd/m2 per unit", run.rig.nits_per_unit) : "; relative units"),
       {kLeft, chart.height - 22},
       14,
       kBlack});
  return eval::write_png(chart, path);
}

}  // namespace lightwell::calibrate
