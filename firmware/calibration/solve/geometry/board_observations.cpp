#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "calibration/solve/geometry/board_observations.hpp"

namespace lightwell::calibration {
namespace {

constexpr double kSpacingPrior = 0.1, kAspectPrior = 0.01;
/// Prior standard deviation of heights, relative to half the longer side: 5 mm for a board of 20 cm.
constexpr double kHeightPrior = 0.05;
constexpr int kMaxPower = 4;

struct Extent {
  Vec3d middle;
  double half = 0;
};

Extent extent_of(const Board& board) {
  Vec3d low = board.points.front(), high = low;
  for (const Vec3d& p : board.points) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), 0};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), 0};
  }
  return {(low + high) * 0.5, std::max({1e-9, (high.x - low.x) / 2, (high.y - low.y) / 2})};
}

}  // namespace

std::vector<ShapeBasis> shape_basis(const Board& board) {
  std::vector<ShapeBasis> out(board.points.size());
  if (out.empty()) return out;
  const Extent extent = extent_of(board);
  const auto group = static_cast<std::size_t>(std::max(board.points_per_tag, 0));
  for (std::size_t i = 0; i < out.size(); ++i) {
    const Vec3d from = board.points[i] - extent.middle;
    if (group > 0) {
      const std::size_t first = i / group * group, end = std::min(first + group, out.size());
      Vec3d center;
      for (std::size_t k = first; k < end; ++k) center += board.points[k] * (1.0 / static_cast<double>(end - first));
      out[i].per_number[0] = center - extent.middle;
    }
    out[i].per_number[1] = {from.x / 2, -from.y / 2, 0};
    const double u = from.x / extent.half, v = from.y / extent.half;
    std::size_t at = BoardShape::kFirstHeight;
    for (int power = 2; power <= kMaxPower; ++power)
      for (int k = 0; k <= power; ++k) out[i].per_number[at++].z = std::pow(u, power - k) * std::pow(v, k);
  }
  return out;
}

std::array<double, BoardShape::kParameters> shape_prior(const Board& board) {
  std::array<double, BoardShape::kParameters> out;
  out.fill(board.points.empty() ? 1 : kHeightPrior * extent_of(board).half);
  out[0] = kSpacingPrior;
  out[1] = kAspectPrior;
  return out;
}

double flatness(const Board& board, const BoardShape& shape) {
  const std::vector<ShapeBasis> basis = shape_basis(board);
  const auto n = static_cast<Eigen::Index>(basis.size());
  if (n < 4) return 0;
  Eigen::MatrixXd plane(n, 3);
  Eigen::VectorXd height(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    Vec3d p = board.points[static_cast<std::size_t>(i)];
    plane.row(i) << 1, p.x, p.y;
    basis[static_cast<std::size_t>(i)].deform(shape.numbers.data(), p.x, p.y, p.z);
    height(i) = p.z;
  }
  const Eigen::VectorXd off = height - plane * plane.colPivHouseholderQr().solve(height);
  return off.maxCoeff() - off.minCoeff();
}

}  // namespace lightwell::calibration
