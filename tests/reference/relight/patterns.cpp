#include "reference/relight/patterns.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lightwell::reference {
namespace {

constexpr int kSlats = 11;
constexpr double kCordHalfWidth = 0.012;
constexpr double kLeadHalfWidth = 0.02;

double smooth_step(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

Rgb blinds(double x, double y) {
  const double phase = 0.5 * kSlats * (y + 1), from_middle = std::abs(phase - std::floor(phase) - 0.5);
  // Half of the period is open; edges are soft over a tenth of it.
  const double open = 1 - smooth_step(0.2, 0.3, from_middle);
  const double cord = smooth_step(kCordHalfWidth, 2 * kCordHalfWidth, std::abs(std::abs(x) - 0.45));
  const double light = open * cord;
  return {light, 0.93 * light, 0.8 * light};
}

/// 0 to 1, of two integers.
double noise(int i, int j, int channel) {
  const double v = std::sin(12.9898 * i + 78.233 * j + 37.719 * channel) * 43758.5453;
  return v - std::floor(v);
}

/// Panes are the cells of jittered points (Worley 1996); lead lines are where two points are nearly as near.
Rgb stained_glass(double x, double y) {
  const double radius = std::hypot(x, y);
  if (radius > 0.98) return {};
  constexpr double kCell = 0.28;
  const double u = x / kCell, v = y / kCell;
  double nearest = std::numeric_limits<double>::infinity(), second = nearest;
  int pane_i = 0, pane_j = 0;
  for (int j = static_cast<int>(std::floor(v)) - 2; j <= static_cast<int>(std::floor(v)) + 2; ++j)
    for (int i = static_cast<int>(std::floor(u)) - 2; i <= static_cast<int>(std::floor(u)) + 2; ++i) {
      const double d = std::hypot(u - i - noise(i, j, 5), v - j - noise(i, j, 7));
      if (d < nearest) {
        second = nearest, nearest = d, pane_i = i, pane_j = j;
      } else {
        second = std::min(second, d);
      }
    }
  const double line = 0.5 * kCell * (second - nearest);
  const double light = smooth_step(0.5 * kLeadHalfWidth, kLeadHalfWidth, line) * smooth_step(0, 0.02, 0.96 - radius);
  // Saturated colours: one channel is strong.
  const int strong = static_cast<int>(3 * noise(pane_i, pane_j, 11));
  Rgb out{};
  for (int c = 0; c < 3; ++c)
    out[static_cast<std::size_t>(c)] = light * (c == strong ? 0.95 : 0.05 + 0.45 * noise(pane_i, pane_j, 13 + c));
  return out;
}

}  // namespace

Rgb transmittance(LightPattern pattern, double x, double y) {
  if (pattern == LightPattern::none) return {1, 1, 1};
  if (std::abs(x) > 1 || std::abs(y) > 1) return {};
  return pattern == LightPattern::blinds ? blinds(x, y) : stained_glass(x, y);
}

}  // namespace lightwell::reference
