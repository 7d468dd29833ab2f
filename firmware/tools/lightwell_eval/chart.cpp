#include "tools/lightwell_eval/chart.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <iterator>

#include "tools/lightwell_eval/labels.hpp"

namespace lightwell::eval {
namespace {

constexpr Ink kBlack{30, 30, 34}, kGrey{120, 120, 128}, kFaint{226, 226, 230}, kFront{170, 175, 190};
constexpr double kWidth = 1500, kLeft = 90, kRight = 30, kTop = 120;
/// Points nearer to each other than this share their label.
constexpr double kSame = 7;

/// Colours that differ for the colour-blind too (Okabe & Ito).
Ink ink_of(Knob knob) {
  switch (knob) {
    case Knob::setting: return {20, 20, 20};
    case Knob::block: return {0, 114, 178};
    case Knob::band: return {213, 94, 0};
    case Knob::lights: return {0, 158, 115};
    case Knob::epsilon: return {180, 60, 140};
    case Knob::map: return {150, 110, 0};
    case Knob::sensor: return {70, 130, 180};
  }
  return kBlack;
}

std::string short_number(double v) {
  std::array<char, 32> out{};
  std::snprintf(out.data(), out.size(), "%g", v);
  return out.data();
}

/// A logarithmic axis that holds all values with some room at its ends.
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
      for (const double m : to / from > 30 ? std::vector<double>{1, 2, 5} : std::vector<double>{1, 1.5, 2, 3, 4, 5, 6, 8})
        if (const double v = m * decade; v >= from && v <= to) out.push_back(v);
    return out;
  }
};

struct Panel {
  std::string title, unit;
  double height = 800;
  std::function<bool(const Row&)> shows;
  std::function<double(const Row&)> cost;
};

class Drawer {
 public:
  Drawer(std::span<const Row> rows, Chart& chart) : all_(rows), chart_(chart) {}

  void draw(const Panel& panel) {
    rows_.clear();
    std::copy_if(all_.begin(), all_.end(), std::back_inserter(rows_), panel.shows);
    if (rows_.empty()) return;
    const double top = chart_.height;
    chart_.height += panel.height;
    Axis x, y;
    std::vector<double> costs, errors;
    for (const Row& row : rows_) {
      costs.push_back(panel.cost(row));
      errors.push_back(100 * row.rms);
    }
    x.span(costs);
    y.span(errors);
    const Box box{kLeft, top + 46, kWidth - kLeft - kRight, panel.height - 46 - 62};
    x.begin_px = box.x;
    x.end_px = box.x + box.width;
    y.begin_px = box.y + box.height;
    y.end_px = box.y;
    chart_.words.push_back({panel.title, {box.x, top + 32}, 19, kBlack, Anchor::start, true});
    frame(x, y, box, panel.unit);
    points(panel, x, y, box, fronts(panel, x, y));
  }

 private:
  void line(std::vector<At> points, Ink ink, double width, bool dashed = false) {
    chart_.strokes.push_back({std::move(points), ink, width, dashed});
  }

  void frame(const Axis& x, const Axis& y, const Box& box, const std::string& unit) {
    for (const double v : x.ticks()) {
      line({{x.px(v), box.y}, {x.px(v), box.y + box.height}}, kFaint, 1);
      chart_.words.push_back({short_number(v), {x.px(v), box.y + box.height + 20}, 13, kGrey, Anchor::middle});
    }
    for (const double v : y.ticks()) {
      line({{box.x, y.px(v)}, {box.x + box.width, y.px(v)}}, kFaint, 1);
      chart_.words.push_back({short_number(v), {box.x - 8, y.px(v) + 5}, 13, kGrey, Anchor::end});
    }
    line({{box.x, box.y}, {box.x, box.y + box.height}, {box.x + box.width, box.y + box.height}}, kGrey, 1.2);
    chart_.words.push_back({unit, {box.x + box.width / 2, box.y + box.height + 46}, 14, kBlack, Anchor::middle});
    chart_.words.push_back({"error of the irradiance, RMS %, median of the scenes", {box.x - 52, box.y + box.height / 2}, 14,
                            kBlack, Anchor::middle, false, true});
  }

  /// Stairs, those of each camera: what can be had for a cost is the best of what costs no more.
  std::vector<Stroke> fronts(const Panel& panel, const Axis& x, const Axis& y) {
    std::vector<Stroke> drawn;
    std::vector<const Case*> told;
    for (const Row& first : rows_) {
      if (std::any_of(told.begin(), told.end(), [&](const Case* c) { return c->rivals(first.setup); })) continue;
      told.push_back(&first.setup);
      std::vector<At> rivals;
      for (const Row& row : rows_)
        if (row.setup.rivals(first.setup)) rivals.push_back({x.px(panel.cost(row)), y.px(100 * row.rms)});
      std::sort(rivals.begin(), rivals.end(), [](At a, At b) { return a.x < b.x; });
      std::vector<At> stairs;
      for (const At& p : rivals) {
        // Pixels are counted from the top: a larger y is a smaller error.
        if (!stairs.empty() && p.y <= stairs.back().y) continue;
        if (!stairs.empty()) stairs.push_back({p.x, stairs.back().y});
        stairs.push_back(p);
      }
      const bool main = first.setup.sensor == Sensor::ideal && first.setup.width == 640;
      line(std::move(stairs), kFront, main ? 3 : 1.6);
      drawn.push_back(chart_.strokes.back());
    }
    return drawn;
  }

  void points(const Panel& panel, const Axis& x, const Axis& y, const Box& box, const std::vector<Stroke>& curves) {
    std::vector<Label> labels;
    std::vector<std::vector<const Row*>> named_by;
    for (const Row& row : rows_) {
      const At at{x.px(panel.cost(row)), y.px(100 * row.rms)};
      const bool named = row.setup.named;
      chart_.marks.push_back({at, named ? 6.0 : 4.5, ink_of(row.setup.knob), row.on_front, row.setup.sensor == Sensor::eight_bit});
      std::size_t k = 0;
      while (k < labels.size() && std::hypot(labels[k].point.x - at.x, labels[k].point.y - at.y) > kSame) ++k;
      if (k == labels.size()) {
        labels.push_back({{}, at, 13, false});
        named_by.emplace_back();
      }
      labels[k].lines.push_back(row.setup.label);
      labels[k].bold = labels[k].bold || prominent(row);
      named_by[k].push_back(&row);
    }
    const std::vector<Placed> placed = place_labels(labels, {box.x + 4, box.y + 2, box.width - 6, box.height - 6}, curves);
    for (std::size_t k = 0; k < labels.size(); ++k) {
      const Ink ink = ink_of(named_by[k].front()->setup.knob);
      const Placed& p = placed[k];
      const At at = labels[k].point;
      if (std::hypot(at.x - p.leader_end.x, at.y - p.leader_end.y) > 14)
        line({at, p.leader_end}, {(ink.r + 255) / 2, (ink.g + 255) / 2, (ink.b + 255) / 2}, 0.9);
      // Towards the point, so that a leader ends at letters.
      const bool to_left = p.box.x + p.box.width < at.x;
      for (std::size_t n = 0; n < named_by[k].size(); ++n)
        chart_.words.push_back({labels[k].lines[n],
                                {to_left ? p.box.x + p.box.width - 1 : p.box.x + 1,
                                 p.box.y + (0.9 + kLineHeight * static_cast<double>(n)) * labels[k].size},
                                labels[k].size, ink_of(named_by[k][n]->setup.knob), to_left ? Anchor::end : Anchor::start,
                                prominent(*named_by[k][n])});
    }
  }

  static bool prominent(const Row& row) { return row.setup.named && row.setup.width == 640; }

  std::span<const Row> all_;
  std::vector<Row> rows_;  ///< Of the panel.
  Chart& chart_;
};

void legend(Chart& chart) {
  constexpr std::array<std::pair<Knob, const char*>, 7> kEntries = {
      {{Knob::setting, "named settings (@ width)"}, {Knob::block, "block size"}, {Knob::band, "band limit"},
       {Knob::lights, "most lights"}, {Knob::epsilon, "epsilon"}, {Knob::map, "environment map"}, {Knob::sensor, "8-bit sensor"}}};
  double x = kLeft;
  for (const auto& [knob, text] : kEntries) {
    chart.marks.push_back({{x + 5, 94}, 5, ink_of(knob), true, knob == Knob::sensor});
    chart.words.push_back({text, {x + 16, 99}, 13.5, ink_of(knob)});
    x += width_of(text, 13.5, false) + 48;
  }
  chart.words.push_back({"filled: on the front", {x, 99}, 13.5, kGrey});
}

}  // namespace

Chart pareto_chart(std::span<const Row> rows, const Run& run) {
  Chart chart{kWidth, kTop, {}, {}, {}};
  chart.words.push_back({"Lightwell: what accuracy costs", {kLeft, 44}, 26, kBlack, Anchor::start, true});
  std::array<char, 220> subtitle{};
  std::snprintf(subtitle.data(), subtitle.size(),
                "%zu scenes through a pair of lenses, 2 x 640x480 unless said otherwise. One thread; memcpy here %.1f GB/s. "
                "Front: time, bytes, error and bound, of one camera. Lines: the best for the cost.",
                run.scenes.size(), run.memcpy_gb_per_s);
  chart.words.push_back({subtitle.data(), {kLeft, 70}, 14, kGrey});
  legend(chart);
  Drawer drawer(rows, chart);
  const auto ideal = [](const Row& r) { return r.setup.sensor == Sensor::ideal; };
  const auto eight_bit = [](const Row& r) { return r.setup.sensor == Sensor::eight_bit; };
  const auto ms = [](const Row& r) { return r.ms; };
  drawer.draw({"Error and time", "from frame to encoded descriptor, ms", 820, ideal, ms});
  drawer.draw({"Error and size", "encoded descriptor, bytes", 820, ideal, [](const Row& r) { return r.bytes; }});
  drawer.draw({"Through an 8-bit sensor with noise: one exposure, three exposures", "from frames to encoded descriptor, ms", 420,
               eight_bit, ms});
  chart.height += 10;
  return chart;
}

}  // namespace lightwell::eval
