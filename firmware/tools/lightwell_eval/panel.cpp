#include "tools/lightwell_eval/panel.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

#include "tools/lightwell_eval/labels.hpp"

namespace lightwell::eval {
namespace {

constexpr Ink kFaint{226, 226, 230}, kFront{170, 175, 190};
/// Points closer than this share a label, px.
constexpr double kSame = 7;

std::string short_number(double v) {
  std::array<char, 32> out{};
  std::snprintf(out.data(), out.size(), "%g", v);
  return out.data();
}

/// A logarithmic axis that spans all values with a margin at both ends.
struct Axis {
  double from = 1, to = 10;
  double begin_px = 0, end_px = 0;

  void span(const std::vector<double>& values) {
    const auto [least, most] = std::minmax_element(values.begin(), values.end());
    const double room = std::max(0.06 * std::log(*most / *least), 0.05);
    from = *least * std::exp(-room);
    to = *most * std::exp(room);
  }
  [[nodiscard]] double px(double v) const {
    return begin_px + (end_px - begin_px) * std::log(v / from) / std::log(to / from);
  }
  [[nodiscard]] std::vector<double> ticks() const {
    std::vector<double> out;
    for (double decade = std::pow(10, std::floor(std::log10(from))); decade <= to; decade *= 10)
      for (const double m :
           to / from > 30 ? std::vector<double>{1, 2, 5} : std::vector<double>{1, 1.5, 2, 3, 4, 5, 6, 8})
        if (const double v = m * decade; v >= from && v <= to) out.push_back(v);
    return out;
  }
};

class Drawer {
 public:
  Drawer(std::span<const PanelPoint> points, Chart& chart) : points_(points), chart_(chart) {}

  void draw(const Panel& panel) {
    const double top = chart_.height;
    chart_.height += panel.height;
    Axis x, y;
    std::vector<double> costs, errors;
    for (const PanelPoint& p : points_) {
      costs.push_back(p.cost);
      errors.push_back(p.error);
    }
    x.span(costs);
    y.span(errors);
    const Box box{kPanelLeft, top + 46, chart_.width - kPanelLeft - kPanelRight, panel.height - 46 - 62};
    x.begin_px = box.x;
    x.end_px = box.x + box.width;
    y.begin_px = box.y + box.height;
    y.end_px = box.y;
    chart_.texts.push_back({panel.title, {box.x, top + 32}, 19, kBlack, Anchor::start, true});
    draw_legend(panel.legend, {box.x + width_of(panel.title, 19, true) + 44, top + 31}, chart_);
    frame(x, y, box, panel);
    points(x, y, box, fronts(x, y));
  }

 private:
  void line(std::vector<ChartPoint> points, Ink ink, double width, bool dashed = false) {
    chart_.strokes.push_back({std::move(points), ink, width, dashed});
  }

  void frame(const Axis& x, const Axis& y, const Box& box, const Panel& panel) {
    for (const double v : x.ticks()) {
      line({{x.px(v), box.y}, {x.px(v), box.y + box.height}}, kFaint, 1);
      chart_.texts.push_back({short_number(v), {x.px(v), box.y + box.height + 20}, 13, kGrey, Anchor::middle});
    }
    for (const double v : y.ticks()) {
      line({{box.x, y.px(v)}, {box.x + box.width, y.px(v)}}, kFaint, 1);
      chart_.texts.push_back({short_number(v), {box.x - 8, y.px(v) + 5}, 13, kGrey, Anchor::end});
    }
    line({{box.x, box.y}, {box.x, box.y + box.height}, {box.x + box.width, box.y + box.height}}, kGrey, 1.2);
    chart_.texts.push_back({panel.cost, {box.x + box.width / 2, box.y + box.height + 46}, 14, kBlack, Anchor::middle});
    chart_.texts.push_back(
        {panel.error, {box.x - 52, box.y + box.height / 2}, 14, kBlack, Anchor::middle, false, true});
  }

  /// One staircase per group: the smallest error of all points of at most that cost.
  std::vector<Stroke> fronts(const Axis& x, const Axis& y) {
    std::vector<Stroke> drawn;
    std::vector<int> done;
    for (const PanelPoint& first : points_) {
      if (std::find(done.begin(), done.end(), first.group) != done.end()) continue;
      done.push_back(first.group);
      std::vector<ChartPoint> group;
      for (const PanelPoint& p : points_)
        if (p.group == first.group) group.push_back({x.px(p.cost), y.px(p.error)});
      std::sort(group.begin(), group.end(), [](ChartPoint a, ChartPoint b) { return a.x < b.x; });
      std::vector<ChartPoint> stairs;
      for (const ChartPoint& p : group) {
        // y increases downwards: a larger y is a smaller error.
        if (!stairs.empty() && p.y <= stairs.back().y) continue;
        if (!stairs.empty()) stairs.push_back({p.x, stairs.back().y});
        stairs.push_back(p);
      }
      line(std::move(stairs), kFront, first.main ? 3 : 1.6);
      drawn.push_back(chart_.strokes.back());
    }
    return drawn;
  }

  void points(const Axis& x, const Axis& y, const Box& box, const std::vector<Stroke>& curves) {
    std::vector<Label> labels;
    std::vector<std::vector<const PanelPoint*>> named_by;
    for (const PanelPoint& point : points_) {
      const ChartPoint at{x.px(point.cost), y.px(point.error)};
      chart_.marks.push_back({at, point.named ? 6.0 : 4.5, point.ink, point.on_front, point.square});
      std::size_t k = 0;
      while (k < labels.size() && std::hypot(labels[k].point.x - at.x, labels[k].point.y - at.y) > kSame) ++k;
      if (k == labels.size()) {
        labels.push_back({{}, at, 13, false});
        named_by.emplace_back();
      }
      labels[k].lines.push_back(point.label);
      labels[k].bold = labels[k].bold || point.prominent;
      named_by[k].push_back(&point);
    }
    const std::vector<LabelPlacement> placed =
        place_labels(labels, {box.x + 4, box.y + 2, box.width - 6, box.height - 6}, curves);
    for (std::size_t k = 0; k < labels.size(); ++k) {
      const Ink ink = named_by[k].front()->ink;
      const LabelPlacement& p = placed[k];
      const ChartPoint at = labels[k].point;
      if (std::hypot(at.x - p.leader_end.x, at.y - p.leader_end.y) > 14)
        line({at, p.leader_end}, {(ink.r + 255) / 2, (ink.g + 255) / 2, (ink.b + 255) / 2}, 0.9);
      // Aligned towards the point, so that the leader line ends at the text.
      const bool to_left = p.box.x + p.box.width < at.x;
      for (std::size_t n = 0; n < named_by[k].size(); ++n)
        chart_.texts.push_back({labels[k].lines[n],
                                {to_left ? p.box.x + p.box.width - 1 : p.box.x + 1,
                                 p.box.y + (0.9 + kLineHeight * static_cast<double>(n)) * labels[k].size},
                                labels[k].size,
                                named_by[k][n]->ink,
                                to_left ? Anchor::end : Anchor::start,
                                named_by[k][n]->prominent});
    }
  }

  std::span<const PanelPoint> points_;
  Chart& chart_;
};

}  // namespace

void draw_panel(const Panel& panel, std::span<const PanelPoint> points, Chart& chart) {
  if (!points.empty()) Drawer(points, chart).draw(panel);
}

double draw_legend(std::span<const LegendEntry> entries, ChartPoint at, Chart& chart) {
  for (const LegendEntry& entry : entries) {
    chart.marks.push_back({{at.x + 5, at.y - 5}, 5, entry.ink, true, entry.square});
    chart.texts.push_back({entry.text, {at.x + 16, at.y}, 13.5, entry.ink});
    at.x += width_of(entry.text, 13.5, false) + 48;
  }
  return at.x;
}

}  // namespace lightwell::eval
