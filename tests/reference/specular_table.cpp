// The table of S(v): a tree of pixel blocks sums the panorama, cubic polynomials interpolate.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "reference/glossy_plane.hpp"

namespace lightwell::reference {

namespace {

/// The table's step is this fraction of alpha, as an angle of v. A light that is a point has the lobe (1 + u^2)^-2, u
/// the angle over 2 alpha, whose fourth derivative is at most 72: cubic interpolation leaves 3/128 72 0.2^4 = 0.27 %.
constexpr double kStepOfAlpha = 0.4;
/// A wide lobe has a finer step, for the Fresnel term and the horizon.
constexpr double kMaxStep = 0.06;
/// Below this elevation the step in azimuth does not follow the lobe.
constexpr double kLowestElevation = 8 * pi / 180;
/// The radius of an accepted block, as a fraction of the distance over which the lobe changes at the block. A block's
/// power at its centroid leaves an error of second order: 7e-4 of a constant environment.
constexpr double kBlockSize = 0.13;
/// The largest cell of a divided pixel, in the same unit. Two Gauss points an axis leave 0.5^4 72 / 4320 = 0.1 %.
constexpr double kCellSize = 0.5;
constexpr int kMaxCells = 64;

/// A rectangle of pixels. The tree is in preorder: the first child follows its parent.
struct SourceBlock {
  V3 centroid;           ///< of the power, on the unit sphere
  double radius2 = 0;    ///< every pixel of the block is within this squared distance of the centroid
  double half_dz = 0;    ///< half the extent in z
  double smith = 0;      ///< sqrt(alpha^2 + (1 - alpha^2) z^2)
  Rgb power{};           ///< radiance times solid angle
  std::size_t next = 0;  ///< the block after this one and all its children
  int column = 0, row = 0;
  bool is_pixel = false;
  bool is_row = false;  ///< one pixel high
};

/// The cosine and sine of an angle.
struct Turn {
  double c = 1, s = 0;
};

Turn operator+(const Turn& a, const Turn& b) { return {a.c * b.c - a.s * b.s, a.s * b.c + a.c * b.s}; }

/// The points of two-point Gauss rules in `count` equal cells of an interval of that width around 0.
std::vector<Turn> gauss_points(int count, double width_rad) {
  std::vector<Turn> points;
  for (int k = 0; k < count; ++k) {
    for (const double side : {-0.5, 0.5}) {
      const double x = ((k + 0.5 + side / std::sqrt(3.0)) / count - 0.5) * width_rad;
      points.push_back({std::cos(x), std::sin(x)});
    }
  }
  return points;
}

class BlockTree {
 public:
  BlockTree(const Panorama& env, const Gloss& gloss)
      : env_(env), gloss_(gloss), a2_(gloss.alpha * gloss.alpha), block_limit_(0.25 * kBlockSize * kBlockSize) {
    const int rows = (env.height + 1) / 2;
    for (int count = 1; count <= kMaxCells; ++count) {
      azimuths_.push_back(gauss_points(count, 2 * pi / env.width));
      elevations_.push_back(gauss_points(count, pi / env.height));
      last_elevations_.push_back(gauss_points(count, top(rows - 1) - bottom(rows - 1)));
    }
    blocks_.reserve(2 * static_cast<std::size_t>(rows) * static_cast<std::size_t>(env.width));
    add_block(0, env.width, 0, rows);
  }

  [[nodiscard]] Rgb radiance(const V3& v) const {
    const double smith_v = std::sqrt(a2_ + (1 - a2_) * v.z * v.z);
    Rgb sum{};
    for (std::size_t k = 0; k < blocks_.size();) {
      const SourceBlock& b = blocks_[k];
      if (b.power[0] + b.power[1] + b.power[2] <= 0) {
        k = b.next;
        continue;
      }
      // h is not normalised: |h|^2 / 4 = (v.h)^2, and D = alpha^2 |h|^4 / (pi q^2).
      const V3 h = v + b.centroid;
      const double h2 = dot(h, h);
      const double q = a2_ * h.z * h.z + h.x * h.x + h.y * h.y;
      // The half vector moves by up to radius / (2 v.h); D changes over sqrt(q) / |h|.
      const bool small = b.radius2 <= block_limit_ * q;
      if (small && (b.is_row || b.half_dz <= 0.34 * b.centroid.z)) {
        const double f = kernel(v.z, smith_v, b.centroid.z, b.smith, h2, q);
        for (std::size_t c = 0; c < 3; ++c) sum[c] += f * b.power[c];
        k = b.next;
      } else if (b.is_pixel) {
        const double f = divided_pixel(v, smith_v, b, h2, q);
        for (std::size_t c = 0; c < 3; ++c) sum[c] += f * b.power[c];
        k = b.next;
      } else {
        ++k;
      }
    }
    return sum;
  }

 private:
  [[nodiscard]] double top(int row) const { return pi * (0.5 - static_cast<double>(row) / env_.height); }
  [[nodiscard]] double bottom(int row) const { return std::max(0.0, pi * (0.5 - (row + 1.0) / env_.height)); }

  /// f_s n.l; h2 = |h|^2 of h = v + l, q = alpha^2 h_z^2 + h_x^2 + h_y^2.
  [[nodiscard]] double kernel(double v_z, double smith_v, double l_z, double smith_l, double h2, double q) const {
    const double v_dot_h = 0.5 * std::sqrt(h2);
    return a2_ * h2 * h2 * 0.5 * l_z * fresnel(gloss_, v_dot_h) / (pi * q * q * (l_z * smith_v + v_z * smith_l));
  }

  /// The mean of f_s n.l over a pixel.
  [[nodiscard]] double divided_pixel(const V3& v, double smith_v, const SourceBlock& b, double h2, double q) const {
    const double height = top(b.row) - bottom(b.row), width = 2 * pi / env_.width;
    const double ring = std::hypot(b.centroid.x, b.centroid.y);
    const Turn azimuth{b.centroid.y / ring, b.centroid.x / ring}, elevation{ring, b.centroid.z};
    // The half vector moves by dl / 2 in the plane of v and l, and by dl / (2 v.h) across it. The smallest q of the
    // pixel decides; it is a pixel's radius away from the centre's.
    const double v_dot_h = 0.5 * std::sqrt(h2);
    const double slope = std::max(std::sqrt(q / h2) - std::sqrt(b.radius2) / (2 * v_dot_h), gloss_.alpha);
    const V3 across = normalised(cross(v, b.centroid));
    const V3 north{-elevation.s * azimuth.s, -elevation.s * azimuth.c, elevation.c};
    const V3 east{azimuth.c, -azimuth.s, 0};
    const auto cells = [&](const V3& tangent, double extent) {
      const double c = dot(across, tangent);
      const double stretch = std::sqrt(1 + c * c * (1 / (v_dot_h * v_dot_h) - 1));
      const int count = static_cast<int>(std::ceil(0.5 * extent * stretch / (kCellSize * slope)));
      return static_cast<std::size_t>(std::clamp(count, 1, kMaxCells) - 1);
    };
    const bool is_last = 2 * (b.row + 1) >= env_.height;
    const auto& x = azimuths_[cells(east, width * ring)];
    const auto& y = (is_last ? last_elevations_ : elevations_)[cells(north, height)];
    double sum = 0, weights = 0;
    for (const Turn& dy : y) {
      const Turn up = elevation + dy;
      const double smith_l = std::sqrt(a2_ + (1 - a2_) * up.s * up.s);
      double row_sum = 0;
      for (const Turn& dx : x) {
        const Turn around = azimuth + dx;
        const V3 h = v + V3{up.c * around.s, up.c * around.c, up.s};
        const double length2 = dot(h, h);
        const double at = a2_ * h.z * h.z + h.x * h.x + h.y * h.y;
        row_sum += kernel(v.z, smith_v, up.s, smith_l, length2, at);
      }
      sum += up.c * row_sum;
      weights += up.c * static_cast<double>(x.size());
    }
    return sum / weights;
  }

  void set_pixel_values(SourceBlock& b) const {
    const double upper = top(b.row), lower = bottom(b.row), middle = 0.5 * (upper + lower);
    const double azimuth = 2 * pi * ((b.column + 0.5) / env_.width - 0.5);
    const double width = 2 * pi / env_.width * std::cos(lower);
    b.centroid = {std::cos(middle) * std::sin(azimuth), std::cos(middle) * std::cos(azimuth), std::sin(middle)};
    b.radius2 = 0.25 * (width * width + (upper - lower) * (upper - lower));
    const Rgb radiance = pixel(env_, b.column, b.row);
    const double solid_angle = 2 * pi / env_.width * (std::sin(upper) - std::sin(lower));
    for (std::size_t c = 0; c < 3; ++c) b.power[c] = solid_angle * radiance[c];
  }

  /// Appends the block of columns [left, right) and rows [first, last), and all its children.
  std::size_t add_block(int left, int right, int first, int last) {
    const std::size_t at = blocks_.size();
    blocks_.emplace_back();
    SourceBlock b;
    b.column = left;
    b.row = first;
    b.is_pixel = right - left == 1 && last - first == 1;
    b.is_row = last - first == 1;
    b.half_dz = 0.5 * (std::sin(top(first)) - std::sin(bottom(last - 1)));
    if (b.is_pixel) {
      set_pixel_values(b);
    } else {
      const double width = 2 * pi / env_.width * (right - left) * std::cos(bottom(last - 1));
      const bool by_column = last - first == 1 || (right - left > 1 && width > top(first) - bottom(last - 1));
      const int column = (left + right) / 2, row = (first + last) / 2;
      const std::size_t one = by_column ? add_block(left, column, first, last) : add_block(left, right, first, row);
      const std::size_t two = by_column ? add_block(column, right, first, last) : add_block(left, right, row, last);
      join(b, blocks_[one], blocks_[two]);
    }
    b.smith = std::sqrt(a2_ + (1 - a2_) * b.centroid.z * b.centroid.z);
    b.next = blocks_.size();
    blocks_[at] = b;
    return at;
  }

  static void join(SourceBlock& b, const SourceBlock& one, const SourceBlock& two) {
    const auto grey = [](const SourceBlock& x) { return x.power[0] + x.power[1] + x.power[2] + 1e-30; };
    b.centroid = normalised(grey(one) * one.centroid + grey(two) * two.centroid);
    double radius = 0;
    for (const SourceBlock* child : {&one, &two}) {
      radius = std::max(radius, length(child->centroid - b.centroid) + std::sqrt(child->radius2));
      for (std::size_t c = 0; c < 3; ++c) b.power[c] += child->power[c];
    }
    b.radius2 = radius * radius;
  }

  const Panorama& env_;
  Gloss gloss_;
  double a2_, block_limit_;
  std::vector<std::vector<Turn>> azimuths_, elevations_, last_elevations_;  // [cells - 1]
  std::vector<SourceBlock> blocks_;
};

/// The weights of the cubic polynomial through the values at -1, 0, 1 and 2, at t.
std::array<double, 4> cubic_weights(double t) {
  return {-t * (t - 1) * (t - 2) / 6, (t + 1) * (t - 1) * (t - 2) / 2, -(t + 1) * t * (t - 2) / 2,
          (t + 1) * t * (t - 1) / 6};
}

}  // namespace

SpecularTable::SpecularTable(const Panorama& env, const Gloss& gloss) {
  const BlockTree tree(env, gloss);
  const double step = std::min(kStepOfAlpha * gloss.alpha, kMaxStep);
  const int rows = static_cast<int>(std::ceil(0.5 * pi / step));
  for (int i = 0; i < rows; ++i) {
    const double elevation = 0.5 * pi * (i + 0.5) / rows;
    const double arc = 2 * pi * std::cos(elevation) / std::sin(std::max(elevation, kLowestElevation));
    const int count = std::max(16, static_cast<int>(std::ceil(arc / step)));
    rows_.push_back({values_.size(), count});
    for (int k = 0; k < count; ++k) {
      const double azimuth = 2 * pi * k / count;
      values_.push_back(tree.radiance(
          {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth), std::sin(elevation)}));
    }
  }
}

Rgb SpecularTable::along_row(const Row& row, double turns) const {
  const double at = (turns - std::floor(turns)) * row.count;
  const int left = static_cast<int>(at);
  const std::array<double, 4> weights = cubic_weights(at - left);
  Rgb value{};
  for (int k = 0; k < 4; ++k) {
    int column = left + k - 1;
    if (column < 0) column += row.count;
    if (column >= row.count) column -= row.count;
    const Rgb& entry = values_[row.start + static_cast<std::size_t>(column)];
    for (std::size_t c = 0; c < 3; ++c) value[c] += weights[static_cast<std::size_t>(k)] * entry[c];
  }
  return value;
}

Rgb SpecularTable::radiance(const V3& v_plane) const {
  Rgb value{};
  if (!(v_plane.z > 0)) return value;
  const int rows = static_cast<int>(rows_.size());
  const double elevation = std::atan2(v_plane.z, std::hypot(v_plane.x, v_plane.y));
  const double turns = std::atan2(v_plane.y, v_plane.x) / (2 * pi);
  const double at = elevation / (0.5 * pi) * rows - 0.5;
  const int first = std::max(0, static_cast<int>(std::floor(at)) - 1);
  const std::array<double, 4> weights = cubic_weights(at - first - 1);
  for (int k = 0; k < 4; ++k) {
    // Beyond the zenith the rows continue on the opposite meridian.
    const int i = first + k;
    const Rgb entry = i < rows ? along_row(rows_[static_cast<std::size_t>(i)], turns)
                               : along_row(rows_[static_cast<std::size_t>(2 * rows - 1 - i)], turns + 0.5);
    for (std::size_t c = 0; c < 3; ++c) value[c] += weights[static_cast<std::size_t>(k)] * entry[c];
  }
  for (double& v : value) v = std::max(v, 0.0);
  return value;
}

}  // namespace lightwell::reference
