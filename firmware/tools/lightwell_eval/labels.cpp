#include "tools/lightwell_eval/labels.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

namespace lightwell::eval {
namespace {

constexpr double kMarkRadius = 8, kGap = 3;
constexpr int kDirections = 32, kRounds = 4;

double overlap(const Box& a, const Box& b) {
  const double w = std::min(a.x + a.width, b.x + b.width) - std::max(a.x, b.x),
               h = std::min(a.y + a.height, b.y + b.height) - std::max(a.y, b.y);
  return w > 0 && h > 0 ? w * h : 0;
}

Box grown(const Box& b, double by) { return {b.x - by, b.y - by, b.width + 2 * by, b.height + 2 * by}; }

ChartPoint nearest_in(const Box& b, ChartPoint p) {
  return {std::clamp(p.x, b.x, b.x + b.width), std::clamp(p.y, b.y, b.y + b.height)};
}

double turn(ChartPoint a, ChartPoint b, ChartPoint c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); }

bool cross(ChartPoint a, ChartPoint b, ChartPoint c, ChartPoint d) {
  return (turn(a, b, c) > 0) != (turn(a, b, d) > 0) && (turn(c, d, a) > 0) != (turn(c, d, b) > 0);
}

bool crosses(ChartPoint a, ChartPoint b, const Box& box) {
  const ChartPoint p{box.x, box.y}, q{box.x + box.width, box.y}, r{box.x + box.width, box.y + box.height},
      s{box.x, box.y + box.height};
  return cross(a, b, p, q) || cross(a, b, q, r) || cross(a, b, r, s) || cross(a, b, s, p);
}

double distance(ChartPoint p, ChartPoint a, ChartPoint b) {
  const double length2 = (b.x - a.x) * (b.x - a.x) + (b.y - a.y) * (b.y - a.y);
  const double t =
      length2 > 0 ? std::clamp(((p.x - a.x) * (b.x - a.x) + (p.y - a.y) * (b.y - a.y)) / length2, 0.0, 1.0) : 0;
  return std::hypot(p.x - a.x - t * (b.x - a.x), p.y - a.y - t * (b.y - a.y));
}

class Placer {
 public:
  Placer(std::span<const Label> labels, const Box& room, std::span<const Stroke> curves)
      : labels_(labels), room_(room), curves_(curves), placed_(labels.size()), done_(labels.size()) {}

  std::vector<LabelPlacement> run() {
    std::vector<std::size_t> order(labels_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    // Labels in dense regions first, because they have the fewest free places.
    std::vector<double> crowd(labels_.size());
    for (std::size_t i = 0; i < labels_.size(); ++i)
      for (const Label& other : labels_)
        crowd[i] += std::exp(-std::hypot(other.point.x - labels_[i].point.x, other.point.y - labels_[i].point.y) / 60);
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return crowd[a] > crowd[b]; });
    for (int round = 0; round < kRounds; ++round)
      for (const std::size_t i : order) place(i);
    return placed_;
  }

 private:
  void place(std::size_t i) {
    done_[i] = false;
    const Label& label = labels_[i];
    double width = 0;
    for (const std::string& line : label.lines) width = std::max(width, width_of(line, label.size, label.bold) + 2);
    const double height = label.size * kLineHeight * static_cast<double>(label.lines.size());
    double best = std::numeric_limits<double>::infinity();
    LabelPlacement choice;
    for (const double radius :
         {11.0, 16.0, 24.0, 34.0, 46.0, 60.0, 76.0, 94.0, 114.0, 136.0, 160.0, 190.0, 225.0, 265.0}) {
      for (int k = 0; k < kDirections; ++k) {
        const double angle = 2 * std::numbers::pi * k / kDirections;
        const double x = label.point.x + radius * std::cos(angle), y = label.point.y + radius * std::sin(angle);
        // The box touches the circle with its point nearest to the mark.
        const Box box{x - width * 0.5 * (1 - std::cos(angle)), y - height * 0.5 * (1 - std::sin(angle)), width, height};
        const LabelPlacement candidate{box, nearest_in(box, label.point)};
        const double cost = cost_of(i, candidate);
        if (cost < best) {
          best = cost;
          choice = candidate;
        }
      }
      if (best < radius) break;
    }
    placed_[i] = choice;
    done_[i] = true;
  }

  double cost_of(std::size_t i, const LabelPlacement& c) const {
    const ChartPoint from = labels_[i].point;
    const Box wide = grown(c.box, kGap);
    double cost = std::hypot(from.x - c.leader_end.x, from.y - c.leader_end.y);
    if (c.box.x < room_.x || c.box.y < room_.y || c.box.x + c.box.width > room_.x + room_.width ||
        c.box.y + c.box.height > room_.y + room_.height)
      cost += 1e6;
    for (const Stroke& curve : curves_)
      for (std::size_t s = 0; s + 1 < curve.points.size(); ++s)
        if (crosses(curve.points[s], curve.points[s + 1], c.box)) cost += 45;
    for (std::size_t k = 0; k < labels_.size(); ++k) {
      const ChartPoint p = labels_[k].point;
      cost += 40 * overlap(wide, {p.x - kMarkRadius, p.y - kMarkRadius, 2 * kMarkRadius, 2 * kMarkRadius});
      if (k == i) continue;
      if (std::hypot(p.x - from.x, p.y - from.y) > 2 && distance(p, from, c.leader_end) < kMarkRadius) cost += 60;
      if (!done_[k]) continue;
      const LabelPlacement& other = placed_[k];
      cost += 60 * overlap(wide, other.box);
      if (crosses(from, c.leader_end, grown(other.box, 1))) cost += 400;
      if (crosses(p, other.leader_end, wide)) cost += 400;
      if (cross(from, c.leader_end, p, other.leader_end)) cost += 80;
    }
    return cost;
  }

  std::span<const Label> labels_;
  Box room_;
  std::span<const Stroke> curves_;
  std::vector<LabelPlacement> placed_;
  std::vector<bool> done_;
};

}  // namespace

std::vector<LabelPlacement> place_labels(std::span<const Label> labels, const Box& room,
                                         std::span<const Stroke> curves) {
  return Placer(labels, room, curves).run();
}

}  // namespace lightwell::eval
