#include "tools/lightwell_calibrate/geometry_report.hpp"

#include <algorithm>

#include "tools/lightwell_eval/drawing.hpp"

namespace lightwell::calibrate {
namespace {

constexpr double kPanel = 640, kMargin = 40, kEnlarged = 100;
constexpr eval::Ink kFrame{60, 60, 60}, kPoint{60, 110, 190}, kMiss{200, 60, 40}, kLack{230, 150, 150},
    kText{30, 30, 30};

}  // namespace

Status draw_lenses(const calibration::BoardObservations& s, std::span<const calibration::Coverage> coverage,
                   std::span<const calibration::Residual> residuals, const std::string& title,
                   const std::string& path) {
  eval::Chart chart;
  chart.width = kMargin + static_cast<double>(s.lenses.size()) * (kPanel + kMargin);
  chart.texts.push_back({title, {kMargin, 28}, 16, kText, eval::Anchor::start, true});
  double lowest = 0;
  for (std::size_t lens = 0; lens < s.lenses.size(); ++lens) {
    const calibration::LensSize& size = s.lenses[lens];
    const double scale = kPanel / size.width, left = kMargin + static_cast<double>(lens) * (kPanel + kMargin), top = 64;
    const auto at = [&](double x, double y) {
      return eval::ChartPoint{left + (x + 0.5) * scale, top + (y + 0.5) * scale};
    };
    const double right = left + kPanel, bottom = top + size.height * scale;
    lowest = std::max(lowest, bottom);
    const calibration::Coverage& c = coverage[lens];
    for (int row = 0; row < c.rows; ++row) {
      for (int column = 0; column < c.columns; ++column) {
        if (!c.needs_views(column, row)) continue;
        // A cross, which is visible in black and white, too.
        const double x0 = left + kPanel * column / c.columns, x1 = left + kPanel * (column + 1) / c.columns;
        const double y0 = top + (bottom - top) * row / c.rows, y1 = top + (bottom - top) * (row + 1) / c.rows;
        chart.strokes.push_back({{{x0 + 4, y0 + 4}, {x1 - 4, y1 - 4}}, kLack, 3, false});
        chart.strokes.push_back({{{x0 + 4, y1 - 4}, {x1 - 4, y0 + 4}}, kLack, 3, false});
      }
    }
    chart.strokes.push_back(
        {{{left, top}, {right, top}, {right, bottom}, {left, bottom}, {left, top}}, kFrame, 1.5, false});
    std::size_t points = 0;
    for (const calibration::Picture& p : s.pictures) {
      if (static_cast<std::size_t>(p.lens) != lens) continue;
      for (const calibration::PointObservation& k : p.observations) {
        chart.marks.push_back({at(k.pixel.x, k.pixel.y), 1.2, kPoint, true, false});
        ++points;
      }
    }
    for (const calibration::Residual& r : residuals) {
      const calibration::Picture& p = s.pictures[static_cast<std::size_t>(r.picture)];
      if (static_cast<std::size_t>(p.lens) != lens) continue;
      const PixelPosition& from = p.observations[static_cast<std::size_t>(r.observation)].pixel;
      chart.strokes.push_back(
          {{at(from.x, from.y), at(from.x + kEnlarged * r.x_px, from.y + kEnlarged * r.y_px)}, kMiss, 0.8, false});
    }
    chart.texts.push_back({"lens " + std::to_string(lens) + ": " + std::to_string(c.with_board) + " pictures, " +
                               std::to_string(points) + " points, " +
                               std::to_string(static_cast<int>(100 * c.share())) + " % of the cells known",
                           {left, top - 10},
                           13,
                           kText,
                           eval::Anchor::start,
                           false});
  }
  chart.height = lowest + 50;
  chart.texts.push_back({std::string("points in blue; crosses: cells that fewer than ") +
                             std::to_string(calibration::Coverage::kMinViewsPerCell) + " pictures show a point in" +
                             (residuals.empty() ? "" : "; red lines: residuals, 100 times enlarged"),
                         {kMargin, lowest + 28},
                         13,
                         kText,
                         eval::Anchor::start,
                         false});
  return path.ends_with(".svg") ? eval::write_svg(chart, path) : eval::write_png(chart, path);
}

}  // namespace lightwell::calibrate
