// One picture of error over cost: every point named, the best for each cost drawn through as stairs.
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
  int rivals = 0;     ///< Points of the same number compete: they share stairs.
  bool main = false;  ///< Whether their stairs are the panel's main ones.
  bool named = false, prominent = false, on_front = false, square = false;
};

struct LegendEntry {
  std::string text;
  Ink ink;
  bool square = false;
};

struct Panel {
  std::string title;
  std::string cost, error;  ///< What the axes show, with units.
  double height = 800;
  std::vector<LegendEntry> legend;  ///< Beside the title, where a panel's colours are its own.
};

/// As wide as the chart, which grows downwards. Nothing where there are no points.
void draw_panel(const Panel& panel, std::span<const PanelPoint> points, Chart& chart);

/// A row of marks and words from `at` on, the words' baseline; where it ends.
double draw_legend(std::span<const LegendEntry> entries, ChartPoint at, Chart& chart);

/// Where panels begin and end, px from the chart's sides.
inline constexpr double kPanelLeft = 90, kPanelRight = 30;

}  // namespace lightwell::eval
