// A panel of a chart: error over cost with labelled points; a staircase shows the smallest error for each cost.
//   PanelPoint, Panel, draw_panel
#pragma once

#include <span>
#include <string>
#include <vector>

#include "tools/lightwell_eval/drawing.hpp"

namespace lightwell::eval {

inline constexpr Ink kBlack{30, 30, 34}, kGrey{120, 120, 128};

struct PanelPoint {
  std::string label;
  double cost = 0, error = 0;  ///< In the axes' units, above 0.
  Ink ink;
  int group = 0;      ///< Points of the same group share a staircase.
  bool main = false;  ///< Whether theirs is the panel's main staircase.
  bool named = false, prominent = false, on_front = false, square = false;
};

struct LegendEntry {
  std::string text;
  Ink ink;
  bool square = false;
};

struct Panel {
  std::string title;
  std::string cost, error;  ///< Titles of the axes, with units.
  double height = 800;
  std::vector<LegendEntry> legend;  ///< Next to the title, if the panel has its own colours.
};

/// Appends a panel below the chart, with the chart's width. Does nothing without points.
void draw_panel(const Panel& panel, std::span<const PanelPoint> points, Chart& chart);

/// Draws a row of marks and texts from `at` (on the baseline) on; returns the x coordinate of its end.
double draw_legend(std::span<const LegendEntry> entries, ChartPoint at, Chart& chart);

/// Margins of the panels, px.
inline constexpr double kPanelLeft = 90, kPanelRight = 30;

}  // namespace lightwell::eval
