// Where the names of points go, so that none hides another, nor a point.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "tools/lightwell_eval/drawing.hpp"

namespace lightwell::eval {

struct Label {
  std::vector<std::string> lines;  ///< Names of all points that lie there.
  ChartPoint point;
  double size = 13;
  bool bold = false;
};

struct LabelPlacement {
  Box box;        ///< Of all lines, each kLineHeight times the size high.
  ChartPoint leader_end;  ///< On the box's edge, towards the point.
};

inline constexpr double kLineHeight = 1.2;

/// In the order of `labels`. Inside `room`; as near as there is place, all others being where they are, improved in a
/// few rounds. Other labels and points are kept free, `curves` where it costs little.
[[nodiscard]] std::vector<LabelPlacement> place_labels(std::span<const Label> labels, const Box& room,
                                               std::span<const Stroke> curves);

}  // namespace lightwell::eval
