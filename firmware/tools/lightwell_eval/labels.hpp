// Placement of point labels without overlaps between labels and points.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "tools/lightwell_eval/drawing.hpp"

namespace lightwell::eval {

struct Label {
  std::vector<std::string> lines;  ///< Names of all points at this position.
  ChartPoint point;
  double size = 13;
  bool bold = false;
};

struct LabelPlacement {
  Box box;                ///< Contains all lines; the height of a line is kLineHeight * size.
  ChartPoint leader_end;  ///< End of the leader line: the point of the box nearest to the labelled point.
};

inline constexpr double kLineHeight = 1.2;

/// Placements in the order of `labels`, inside `room`. Greedy: places each label as near to its point as possible given
/// the others, in a few rounds. Overlaps with labels and points have a high cost, crossings of `curves` a low one.
[[nodiscard]] std::vector<LabelPlacement> place_labels(std::span<const Label> labels, const Box& room,
                                                       std::span<const Stroke> curves);

}  // namespace lightwell::eval
