// A chart of lines, marks and texts, written as SVG or PNG.
#pragma once

#include <string>
#include <vector>

#include <lightwell/result.hpp>

namespace lightwell::eval {

/// Pixels; y grows downwards.
struct ChartPoint {
  double x = 0, y = 0;
};

struct Box {
  double x = 0, y = 0, width = 0, height = 0;
};

struct Ink {
  int r = 0, g = 0, b = 0;
};

enum class Anchor { start, middle, end };

struct Stroke {
  std::vector<ChartPoint> points;
  Ink ink;
  double width = 1;
  bool dashed = false;
};

struct Mark {
  ChartPoint at;
  double radius = 5;
  Ink ink;
  bool filled = true;
  bool square = false;
};

struct TextLabel {
  std::string text;  ///< ASCII.
  ChartPoint at;     ///< The point of the baseline that `anchor` selects.
  double size = 14;  ///< Font size (em), px.
  Ink ink;
  Anchor anchor = Anchor::start;
  bool bold = false;
  bool upwards = false;  ///< Rotated by 90 degrees, reading upwards.
};

struct Chart {
  double width = 0, height = 0;
  std::vector<Stroke> strokes;   ///< Drawn first.
  std::vector<Mark> marks;       ///< Drawn second.
  std::vector<TextLabel> texts;  ///< Drawn last.
};

/// Approximate width of a text in Helvetica, px.
[[nodiscard]] double width_of(const std::string& text, double size, bool bold);

[[nodiscard]] Status write_svg(const Chart& chart, const std::string& path);
[[nodiscard]] Status write_png(const Chart& chart, const std::string& path);

}  // namespace lightwell::eval
