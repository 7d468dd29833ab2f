#include <algorithm>
#include <cmath>
#include <cstddef>

#include <lightwell/light_estimate.hpp>

#include "core/planckian_locus.hpp"

namespace lightwell {
namespace {

struct Uv {
  double u, v;
};

constexpr std::size_t kEntries = core::kPlanckianLocus.size() / 2;

Uv entry(std::size_t i) { return {core::kPlanckianLocus[2 * i], core::kPlanckianLocus[2 * i + 1]}; }

double squared_distance(Uv a, Uv b) { return (a.u - b.u) * (a.u - b.u) + (a.v - b.v) * (a.v - b.v); }

/// A coordinate between entries k and k + 1: the cubic of Catmull and Rom 1974 through entries k - 1 to k + 2.
struct Cubic {
  double a, b, c, d;

  Cubic(double before, double from, double to, double after)
      : a(from),
        b((to - before) / 2),
        c(before - 2.5 * from + 2 * to - 0.5 * after),
        d((3 * (from - to) + after - before) / 2) {}
  [[nodiscard]] double at(double t) const { return a + t * (b + t * (c + t * d)); }
  [[nodiscard]] double slope(double t) const { return b + t * (2 * c + 3 * t * d); }
  [[nodiscard]] double curvature(double t) const { return 2 * c + 6 * t * d; }
};

struct NearestPoint {
  double squared_distance = 0, position = 0;  ///< Position in entries of the table.
  double above = 0;                           ///< v of the colour minus that of the point.
};

/// The point nearest to `at` between entries k and k + 1.
NearestPoint nearest_in(std::size_t k, Uv at) {
  const Uv p = entry(k - 1), q = entry(k), r = entry(k + 1), s = entry(k + 2);
  const Cubic u(p.u, q.u, r.u, s.u), v(p.v, q.v, r.v, s.v);
  double t = 0.5;
  // Newton's method converges to the last digit in four steps where a colour temperature has a meaning.
  constexpr int kSteps = 8;
  for (int i = 0; i < kSteps; ++i) {
    const double du = u.at(t) - at.u, dv = v.at(t) - at.v, su = u.slope(t), sv = v.slope(t);
    const double gradient = du * su + dv * sv;
    const double curvature = su * su + sv * sv + du * u.curvature(t) + dv * v.curvature(t);
    if (!(curvature > 0)) break;
    t = std::clamp(t - gradient / curvature, 0.0, 1.0);
  }
  const Uv point{u.at(t), v.at(t)};
  return {squared_distance(point, at), static_cast<double>(k) + t, at.v - point.v};
}

}  // namespace

std::optional<ColorTemperature> color_temperature(Chromaticity c) {
  const double denominator = -2 * c.x + 12 * c.y + 3;
  if (!(c.x > 0 && c.y > 0 && denominator > 0) || !std::isfinite(denominator)) return std::nullopt;
  const Uv at{4 * c.x / denominator, 6 * c.y / denominator};
  std::size_t closest = 0;
  for (std::size_t i = 1; i < kEntries; ++i)
    if (squared_distance(entry(i), at) < squared_distance(entry(closest), at)) closest = i;
  // The first and the last entry only give the cubic its direction.
  const std::size_t k = std::clamp<std::size_t>(closest, 2, kEntries - 3);
  const NearestPoint below = nearest_in(k - 1, at), above = nearest_in(k, at);
  const NearestPoint& nearest = below.squared_distance < above.squared_distance ? below : above;
  const ColorTemperature out{core::kLocusLowest * std::pow(core::kLocusStep, nearest.position - 1),
                             std::copysign(std::sqrt(nearest.squared_distance), nearest.above)};
  // A nearest point at the end of the table may be nearer to one beyond it.
  const bool within = nearest.position > 1 && out.kelvin <= core::kLocusHighest;
  if (!within || !(std::abs(out.duv) <= kMaxDuv)) return std::nullopt;
  return out;
}

std::optional<ColorTemperature> color_temperature(float r, float g, float b) {
  if (!(r != 0 || g != 0 || b != 0) || !std::isfinite(r + g + b)) return std::nullopt;
  return color_temperature(chromaticity_of(r, g, b));
}

}  // namespace lightwell
