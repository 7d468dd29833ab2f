#include "pose/corner_refiner.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Dense>

namespace lightwell {

namespace {

using Eigen::Vector2d;
using Parameters = Eigen::Matrix<double, 8, 1>;
using Normal = Eigen::Matrix<double, 8, 8>;

/// How much of an edge counts, px: more would only be a longer way for the parabola to go wrong.
constexpr double kReach = 40;
/// Blur rounds a corner; so far from both edges it is gone for a sigma of 1 px.
constexpr double kMargin = 2.5;
constexpr double kLeastContrast = 5;  ///< Of 255.
/// Rounding to whole values, as a standard deviation.
constexpr double kRounding = 0.29;
/// What no model of an edge is better than, px.
constexpr double kFloor = 0.005;
/// How much light changes, a share per pixel: 1 % is a falloff to half over fifty.
constexpr double kUnevenness = 0.01;
constexpr double kUnevennessAcross = 0.003;  // Less, as much of it would be taken for blur.
constexpr double kUnknown = 6;  ///< Numbers that each edge's pixels have to tell; two more are nearly known.

class LinearPicture {
 public:
  LinearPicture(const GreyPicture& picture, std::span<const float> linear) : picture_(picture) {
    for (std::size_t i = 0; i < values_.size(); ++i)
      values_[i] = linear.empty() ? static_cast<double>(i) : 255.0 * static_cast<double>(linear[i]);
  }
  [[nodiscard]] double at(int x, int y) const { return values_[picture_.at(x, y)]; }
  [[nodiscard]] bool holds(int x, int y) const { return x >= 0 && y >= 0 && x < picture_.width && y < picture_.height; }
  /// Between pixels; nothing outside.
  [[nodiscard]] std::optional<double> between(Vector2d p) const {
    const double fx = std::floor(p.x()), fy = std::floor(p.y());
    if (!(fx >= 0 && fy >= 0 && fx < picture_.width - 1 && fy < picture_.height - 1)) return std::nullopt;
    const int x = static_cast<int>(fx), y = static_cast<int>(fy);
    const double u = p.x() - fx, v = p.y() - fy;
    return (1 - v) * ((1 - u) * at(x, y) + u * at(x + 1, y)) + v * ((1 - u) * at(x, y + 1) + u * at(x + 1, y + 1));
  }
  [[nodiscard]] int sides() const { return picture_.width + picture_.height; }

 private:
  GreyPicture picture_;
  std::array<double, 256> values_{};
};

/// The part of an edge next to a corner, in axes of its own: s along the edge away from the corner, d outwards.
struct Edge {
  Vector2d origin, along, out;
  double begin = 0, end = 0;                        ///< Of s.
  double cell = 0;                                  ///< Width of the tag's cells across the edge, px.
  Eigen::Vector3d curve = Eigen::Vector3d::Zero();  ///< d = c0 + c1 t + c2 t², t = s / end.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();

  [[nodiscard]] double offset(double s) const {
    const double t = s / end;
    return curve[0] + t * (curve[1] + t * curve[2]);
  }
  [[nodiscard]] double slope(double s) const { return (curve[1] + 2 * curve[2] * s / end) / end; }
  [[nodiscard]] Vector2d at(double s) const { return origin + along * s + out * offset(s); }
  [[nodiscard]] Vector2d tangent(double s) const { return (along + out * slope(s)).normalized(); }
};

/// Standard deviation of the parabola's bend at its end, px. Straight edges have bends of the picture's own size
/// through any lens; a weak hold on short edges, where noise could bend them further.
double bend_deviation(const LinearPicture& picture, double end) { return 0.5 * (8.0 / picture.sides()) * end * end; }

/// Where along `p0 + out * d` the picture grows fastest outwards (times `sign`), |d| <= reach.
std::optional<double> steepest(const LinearPicture& picture, Vector2d p0, Vector2d out, double reach, double sign) {
  constexpr double kStep = 0.5;
  const int half = static_cast<int>(std::ceil(reach / kStep));
  constexpr int kAside = 2;  // Differences over 2 px: less is noise, more is the next cell.
  std::vector<double> values;
  values.reserve(static_cast<std::size_t>(2 * (half + kAside) + 1));
  for (int i = -half - kAside; i <= half + kAside; ++i) {
    const auto v = picture.between(p0 + out * (i * kStep));
    if (!v) return std::nullopt;
    values.push_back(sign * *v);
  }
  double best = 0;
  std::size_t where = 0;
  const auto growth = [&](std::size_t i) { return values[i + kAside] - values[i - kAside]; };
  for (std::size_t i = kAside; i + kAside < values.size(); ++i)
    if (growth(i) > best) {
      best = growth(i);
      where = i;
    }
  if (best < kLeastContrast) return std::nullopt;
  double fine = 0;
  if (where > kAside && where + kAside + 1 < values.size()) {
    const double before = growth(where - 1), after = growth(where + 1), bend = before - 2 * best + after;
    if (bend < 0) fine = std::clamp(0.5 * (before - after) / bend, -0.5, 0.5);
  }
  return (static_cast<double>(where) + fine - half - kAside) * kStep;
}

/// A first parabola through the steepest places, against outliers.
bool follow(const LinearPicture& picture, Edge& edge, double reach, double sign) {
  std::vector<std::pair<double, double>> points;  // t, d
  const int steps = std::max(4, static_cast<int>(edge.end - edge.begin));
  for (int i = 0; i <= steps; ++i) {
    const double s = edge.begin + (edge.end - edge.begin) * i / steps;
    if (const auto d = steepest(picture, edge.origin + edge.along * s, edge.out, reach, sign))
      points.emplace_back(s / edge.end, *d);
  }
  if (points.size() < 4 || 2 * points.size() < static_cast<std::size_t>(steps)) return false;
  const double bend = bend_deviation(picture, edge.end);
  Eigen::Vector3d curve = Eigen::Vector3d::Zero();
  double scale = reach;
  for (int pass = 0; pass < 6; ++pass) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    normal(2, 2) = 0.25 / (bend * bend);
    double sum = 0, weights = 0;
    for (const auto& [t, d] : points) {
      const Eigen::Vector3d row(1, t, t * t);
      const double r = d - row.dot(curve);
      const double w = pass == 0 ? 1 : 1 / (1 + (r / scale) * (r / scale));
      normal += w * row * row.transpose();
      right += w * row * d;
      sum += w * std::abs(r);
      weights += w;
    }
    curve = normal.ldlt().solve(right);
    if (pass > 0) scale = std::max(0.25, 1.5 * sum / weights);
  }
  if (!curve.allFinite()) return false;
  edge.curve = curve;
  return true;
}

struct Sample {
  double t, d, value;
};

std::vector<Sample> band(const LinearPicture& picture, const Edge& edge, double half) {
  Vector2d low = edge.at(edge.begin), high = low;
  for (const double s : {edge.begin, (edge.begin + edge.end) / 2, edge.end})
    for (const double aside : {-half, half}) {
      const Vector2d p = edge.at(s) + edge.out * aside;
      low = low.cwiseMin(p).eval();
      high = high.cwiseMax(p).eval();
    }
  std::vector<Sample> out;
  for (int y = static_cast<int>(std::floor(low.y())) - 1; y <= static_cast<int>(std::ceil(high.y())) + 1; ++y)
    for (int x = static_cast<int>(std::floor(low.x())) - 1; x <= static_cast<int>(std::ceil(high.x())) + 1; ++x) {
      if (!picture.holds(x, y)) continue;
      const Vector2d p = Vector2d(x, y) - edge.origin;
      const double s = p.dot(edge.along), d = p.dot(edge.out);
      if (s >= edge.begin && s <= edge.end && std::abs(d - edge.offset(s)) <= half)
        out.push_back({s / edge.end, d, picture.at(x, y)});
    }
  return out;
}

double normal_density(double x) { return std::exp(-x * x / 2) / std::sqrt(2 * std::numbers::pi); }
double normal_integral(double x) { return 0.5 * std::erfc(-x / std::numbers::sqrt2); }

/// The share of light at a distance from an edge, and its derivatives: a step behind a normal blur and a square pixel.
/// A pixel whose sides are not along the edge sees it through a trapezium; its longer side is kept as it is, the
/// shorter one goes into the blur by its variance.
class BlurredStep {
 public:
  BlurredStep(double sigma, Vector2d across)
      : width_(across.cwiseAbs().maxCoeff()), own_(sigma), sigma_(std::sqrt(sigma * sigma + small(across))) {}

  struct Value {
    double share, by_distance, by_sigma;
  };
  [[nodiscard]] Value at(double distance) const {
    const double a = (distance + width_ / 2) / sigma_, b = (distance - width_ / 2) / sigma_;
    const double fa = normal_integral(a), fb = normal_integral(b), da = normal_density(a), db = normal_density(b);
    return {sigma_ * (a * fa + da - b * fb - db) / width_, (fa - fb) / width_, (da - db) / width_ * own_ / sigma_};
  }

 private:
  static double small(Vector2d across) {
    const double w = across.cwiseAbs().minCoeff();
    return w * w / 12;
  }
  double width_, own_, sigma_;
};

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The blurred edge itself, by Gauss and Newton with Marquardt's damping and Tukey's weights.
/// Parameters: curve (3), value inside, value outside, sigma, and by how much the light grows along and across the
/// edge, a share per pixel: lamps and lenses are not even.
bool fit(const LinearPicture& picture, Edge& edge, double sign) {
  const double half = std::clamp(0.6 * edge.cell, 1.2, 5.0);
  const std::vector<Sample> samples = band(picture, edge, half);
  if (samples.size() < 12) return false;
  Parameters x;
  double inside = 0, outside = 0;
  int insides = 0, outsides = 0;
  for (const Sample& s : samples) {
    const double off = s.d - edge.offset(s.t * edge.end);
    if (off < -half / 2) inside += s.value, ++insides;
    if (off > half / 2) outside += s.value, ++outsides;
  }
  if (insides < 2 || outsides < 2) return false;
  x << edge.curve, inside / insides, outside / outsides, 0.7, 0, 0;

  const auto model = [&](const Sample& s, const Parameters& at, Parameters* slope) {
    const double off = s.d - (at[0] + s.t * (at[1] + s.t * at[2])), step = at[4] - at[3];
    const BlurredStep::Value v = BlurredStep(at[5], edge.out).at(off);
    const double even = at[3] + step * v.share, along = (s.t - 0.5) * edge.end;
    const double light = 1 + at[6] * along + at[7] * s.d;
    if (slope) {
      const double moved = -step * v.by_distance;
      *slope << moved, moved * s.t, moved * s.t * s.t, 1 - v.share, v.share, step * v.by_sigma, even * along / light,
          even * s.d / light;
      *slope *= light;
    }
    return even * light;
  };
  const double bend = bend_deviation(picture, edge.end);
  double scale = 0;  // of Tukey's weights; 0: all count fully
  const auto weight = [&](double r) {
    if (scale == 0) return 1.0;
    const double q = r / (4.685 * scale);
    return std::abs(q) < 1 ? (1 - q * q) * (1 - q * q) : 0.0;
  };
  const auto cost = [&](const Parameters& at) {
    double sum = 0;
    for (const Sample& s : samples) {
      const double r = s.value - model(s, at, nullptr), w = weight(r);
      sum += scale == 0 ? r * r : w * r * r + (1 - w) * scale * scale * 9;
    }
    return sum;
  };
  Normal normal;
  double squares = 0, count = 0, damping = 1e-3;
  for (int pass = 0; pass < 16; ++pass) {
    if (pass == 4 || pass == 8) {
      std::vector<double> sizes;
      for (const Sample& s : samples) sizes.push_back(std::abs(s.value - model(s, x, nullptr)));
      // Most pixels are flat and only tell of noise; those on the slope also show how far the model is from the lens.
      scale = std::max(1.4826 * median_of(std::move(sizes)), 1 + 0.02 * std::abs(x[4] - x[3]));
    }
    normal.setZero();
    Parameters right = Parameters::Zero();
    squares = count = 0;
    for (const Sample& s : samples) {
      Parameters slope;
      const double r = s.value - model(s, x, &slope), w = weight(r);
      normal += w * slope * slope.transpose();
      right += w * r * slope;
      squares += w * r * r;
      count += w;
    }
    const double variance = std::max(squares / std::max(count - kUnknown, 1.0), kRounding * kRounding);
    const auto hold = [&](int i, double deviation) {
      normal(i, i) += variance / (deviation * deviation);
      right[i] -= variance / (deviation * deviation) * x[i];
    };
    hold(2, bend);
    hold(6, kUnevenness);
    hold(7, kUnevennessAcross);
    Normal damped = normal;
    damped.diagonal() += damping * normal.diagonal();
    const Parameters step = damped.ldlt().solve(right);
    if (!step.allFinite()) return false;
    Parameters next = x + step;
    next[5] = std::clamp(next[5], 0.15, half);
    if (cost(next) <= cost(x) * (1 + 1e-9)) {
      x = next;
      damping = std::max(damping / 10, 1e-9);
    } else {
      damping = std::min(damping * 10, 1e6);
    }
    if (pass > 9 && step.head<3>().norm() < 1e-4) break;
  }
  if (count < 10) return false;
  const double variance = std::max(squares / (count - kUnknown), kRounding * kRounding);
  const double contrast = sign * (x[4] - x[3]);
  if (contrast < kLeastContrast || contrast < 2 * std::sqrt(variance)) return false;
  if ((x.head<3>() - edge.curve).cwiseAbs().maxCoeff() > 2 * half) return false;
  const Normal inverse = normal.ldlt().solve(Normal::Identity());
  if (!inverse.allFinite()) return false;
  edge.curve = x.head<3>();
  edge.covariance = variance * inverse.topLeftCorner<3, 3>();
  return true;
}

std::optional<RefinedCorner> meeting(const Edge& a, const Edge& b) {
  double s = 0, t = 0;
  for (int i = 0; i < 10; ++i) {
    const Vector2d ta = a.along + a.out * a.slope(s), tb = b.along + b.out * b.slope(t);
    Eigen::Matrix2d j;
    j << ta, -tb;
    // Edges that are almost one line meet anywhere.
    if (std::abs(j.determinant()) < 0.1) return std::nullopt;
    const Vector2d step = j.inverse() * (b.at(t) - a.at(s));
    s += step.x();
    t += step.y();
    if (!(std::abs(s) < kReach && std::abs(t) < kReach)) return std::nullopt;
    if (step.cwiseAbs().maxCoeff() < 1e-9) break;
  }
  const Vector2d p = a.at(s);
  const auto variance = [](const Edge& e, double at) {
    const double u = at / e.end;
    const Eigen::Vector3d row(1, u, u * u);
    return row.dot(e.covariance * row) + kFloor * kFloor;
  };
  const auto normal = [](const Edge& e, double at) {
    const Vector2d tangent = e.tangent(at);
    return Eigen::RowVector2d(-tangent.y(), tangent.x());
  };
  Eigen::Matrix2d normals;
  normals << normal(a, s), normal(b, t);
  const Eigen::Matrix2d back = normals.inverse();
  const Eigen::Matrix2d c = back * Eigen::Vector2d(variance(a, s), variance(b, t)).asDiagonal() * back.transpose();
  return RefinedCorner{{p.x(), p.y()}, {c(0, 0), c(0, 1), c(1, 1)}};
}

/// The edge from `corner` to `end` of a tag whose opposite side `opposite` tells where its inside is.
std::optional<Edge> edge_from(Vector2d corner, Vector2d end, Vector2d opposite, int edge_cells) {
  Edge e;
  const double length = (end - corner).norm();
  const Vector2d aside = opposite - corner;
  if (!(length > 6)) return std::nullopt;
  e.origin = corner;
  e.along = (end - corner) / length;
  e.out = Vector2d(-e.along.y(), e.along.x());
  if (e.out.dot(aside) > 0) e.out = -e.out;
  const double depth = std::abs(e.out.dot(aside)), sine = depth / std::max(aside.norm(), 1e-9);
  if (!(depth > 4) || sine < 0.15) return std::nullopt;
  e.cell = depth / edge_cells;
  e.begin = std::min(kMargin / sine, 0.25 * length);
  e.end = std::min(length - e.begin, kReach);
  return e;
}

}  // namespace

std::array<std::optional<RefinedCorner>, 4> refine_corners(const GreyPicture& picture, const TagOutline& outline,
                                                           std::span<const float> linear) {
  std::array<std::optional<RefinedCorner>, 4> out;
  const LinearPicture light(picture, linear);
  const double sign = outline.dark_inside ? 1 : -1;
  const auto given = [&](std::size_t i) {
    const PixelPosition p = outline.corners[i % 4];
    return Vector2d(p.x, p.y);
  };
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector2d next = given(i + 1), before = given(i + 3);
    auto a = edge_from(given(i), next, before, outline.edge_cells);
    auto b = edge_from(given(i), before, next, outline.edge_cells);
    if (!a || !b) continue;
    // A bent edge of a large tag lies far from the chord: first a wide look, then one along what was found.
    const auto look = [&](Edge& e, double most) { return follow(light, e, std::clamp(0.6 * e.cell, 1.0, most), sign); };
    if (!look(*a, 20) || !look(*b, 20)) continue;
    const auto rough = meeting(*a, *b);
    if (!rough) continue;
    const auto moved = [&](Edge& e) {
      const Vector2d tangent = e.tangent(0);
      const Vector2d out_before = e.out;
      e.origin = Vector2d(rough->at.x, rough->at.y);
      e.along = tangent;
      e.out = Vector2d(-tangent.y(), tangent.x());
      if (e.out.dot(out_before) < 0) e.out = -e.out;
      e.curve.setZero();
    };
    moved(*a);
    moved(*b);
    if (!look(*a, 3) || !look(*b, 3) || !fit(light, *a, sign) || !fit(light, *b, sign)) continue;
    const auto corner = meeting(*a, *b);
    // One that wandered off by more than a cell belongs to something else.
    if (corner &&
        (Vector2d(corner->at.x, corner->at.y) - given(i)).norm() < std::max({3.0, 1.5 * a->cell, 1.5 * b->cell}))
      out[i] = corner;
  }
  return out;
}

}  // namespace lightwell
