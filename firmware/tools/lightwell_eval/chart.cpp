#include "tools/lightwell_eval/chart.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <functional>
#include <initializer_list>
#include <utility>
#include <vector>

#include "tools/lightwell_eval/panel.hpp"

namespace lightwell::eval {
namespace {

constexpr double kWidth = 1500, kTop = 120;
constexpr const char* kError = "error of the irradiance, RMS %, median of the scenes";

/// Colours that are distinguishable with colour blindness (Okabe & Ito 2008).
Ink ink_of(SweepParameter parameter) {
  switch (parameter) {
    case SweepParameter::setting:
      return {20, 20, 20};
    case SweepParameter::block:
      return {0, 114, 178};
    case SweepParameter::band:
      return {213, 94, 0};
    case SweepParameter::lights:
      return {0, 158, 115};
    case SweepParameter::epsilon:
      return {180, 60, 140};
    case SweepParameter::map:
      return {150, 110, 0};
    case SweepParameter::sensor:
      return {70, 130, 180};
  }
  return kBlack;
}

Ink ink_of(MarkerSweepParameter parameter) {
  switch (parameter) {
    case MarkerSweepParameter::setting:
      return {20, 20, 20};
    case MarkerSweepParameter::decimation:
      return {0, 114, 178};
    case MarkerSweepParameter::search:
      return {180, 60, 140};
    case MarkerSweepParameter::faces:
      return {213, 94, 0};
    case MarkerSweepParameter::order:
      return {0, 158, 115};
  }
  return kBlack;
}

/// The points of all cases of one sensor, with `cost` as their x coordinate.
std::vector<PanelPoint> points_of(std::span<const Row> rows, Sensor sensor,
                                  const std::function<double(const Row&)>& cost) {
  std::vector<PanelPoint> out;
  std::vector<const Case*> cameras;  // One case of each group that competes.
  for (const Row& row : rows) {
    const Case& c = row.setup;
    if (c.sensor != sensor) continue;
    std::size_t group = 0;
    while (group < cameras.size() && !cameras[group]->competes_with(c)) ++group;
    if (group == cameras.size()) cameras.push_back(&c);
    const bool default_width = c.width == 640;
    out.push_back({c.label, cost(row), 100 * row.rms, ink_of(c.parameter), static_cast<int>(group),
                   sensor == Sensor::ideal && default_width, c.named, c.named && default_width, row.on_front,
                   sensor == Sensor::eight_bit});
  }
  return out;
}

void legend(Chart& chart) {
  std::vector<LegendEntry> entries;
  for (const auto& [parameter, text] : std::initializer_list<std::pair<SweepParameter, const char*>>{
           {SweepParameter::setting, "named settings (@ width)"},
           {SweepParameter::block, "block size"},
           {SweepParameter::band, "band limit"},
           {SweepParameter::lights, "most lights"},
           {SweepParameter::epsilon, "epsilon"},
           {SweepParameter::map, "environment map"},
           {SweepParameter::sensor, "8-bit sensor"}})
    entries.push_back({text, ink_of(parameter), parameter == SweepParameter::sensor});
  const double end = draw_legend(entries, {kPanelLeft, 99}, chart);
  chart.texts.push_back({"filled: on the front", {end, 99}, 13.5, kGrey});
}

/// The panel of the marker estimator. Rows without time or error (no frame was answered) are left out.
void draw_marker(std::span<const MarkerRow> rows, Chart& chart) {
  std::vector<PanelPoint> points;
  for (const MarkerRow& row : rows) {
    if (!row.ms || !row.rms) continue;
    const bool named = row.parameter == MarkerSweepParameter::setting;
    points.push_back(
        {row.what, *row.ms, 100 * *row.rms, ink_of(row.parameter), 0, true, named, named, row.on_front, true});
  }
  if (points.empty()) return;
  // The default is drawn last, on top of cases with the same result.
  std::stable_partition(points.begin(), points.end(), [](const PanelPoint& p) { return !p.named; });
  std::array<char, 120> title{};
  std::snprintf(title.data(), title.size(), "Light from a marker, one picture of %dx%d, 8 bits", rows.front().width,
                rows.front().height);
  Panel panel{title.data(),
              "a followed frame, from the camera's bytes to the descriptor, ms",
              "error of the irradiance, RMS %, median of the frames",
              620,
              {}};
  for (const auto& [parameter, text] : std::initializer_list<std::pair<MarkerSweepParameter, const char*>>{
           {MarkerSweepParameter::setting, "default"},
           {MarkerSweepParameter::decimation, "decimation, followed"},
           {MarkerSweepParameter::search, "decimation, searched"},
           {MarkerSweepParameter::faces, "most faces"},
           {MarkerSweepParameter::order, "most lamps; the table"}})
    panel.legend.push_back({text, ink_of(parameter), true});
  draw_panel(panel, points, chart);
}

}  // namespace

Chart pareto_chart(std::span<const Row> rows, const Run& run, std::span<const MarkerRow> marker) {
  Chart chart{kWidth, kTop, {}, {}, {}};
  chart.texts.push_back({"Lightwell: what accuracy costs", {kPanelLeft, 44}, 26, kBlack, Anchor::start, true});
  std::array<char, 220> subtitle{};
  std::snprintf(
      subtitle.data(), subtitle.size(),
      "%zu scenes through a pair of lenses, 2 x 640x480 unless said otherwise. One thread; memcpy here %.1f GB/s. "
      "Front: time, bytes, error and bound, of one camera. Lines: the best for the cost.",
      run.scenes.size(), run.memcpy_gb_per_s);
  chart.texts.push_back({subtitle.data(), {kPanelLeft, 70}, 14, kGrey});
  legend(chart);
  const auto ms = [](const Row& r) { return r.ms; };
  const auto bytes = [](const Row& r) { return r.bytes; };
  draw_panel({"Error and time", "from frame to encoded descriptor, ms", kError, 820, {}},
             points_of(rows, Sensor::ideal, ms), chart);
  draw_panel({"Error and size", "encoded descriptor, bytes", kError, 820, {}}, points_of(rows, Sensor::ideal, bytes),
             chart);
  draw_panel({"Through an 8-bit sensor with noise: one exposure, three exposures",
              "from frames to encoded descriptor, ms",
              kError,
              420,
              {}},
             points_of(rows, Sensor::eight_bit, ms), chart);
  draw_marker(marker, chart);
  chart.height += 10;
  return chart;
}

}  // namespace lightwell::eval
