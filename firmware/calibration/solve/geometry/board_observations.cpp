#include "calibration/solve/geometry/board_observations.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <Eigen/Dense>

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

constexpr int kCellsAcross = 12;
constexpr int kMinPictures = 20;
/// Fraction of uncovered cells in a region above which a view is suggested.
constexpr double kMaxUncoveredFraction = 0.25;

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

double Coverage::share() const {
  int counted = 0, known = 0;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    if (!counts[i]) continue;
    ++counted;
    known += pictures[i] >= kMinViewsPerCell ? 1 : 0;
  }
  return counted > 0 ? static_cast<double>(known) / counted : 0;
}

Coverage coverage(const BoardObservations& observations, int lens, double circle_px) {
  Coverage out;
  const LensSize& size = observations.lenses[static_cast<std::size_t>(lens)];
  const double cell = static_cast<double>(std::max(size.width, size.height)) / kCellsAcross;
  out.columns = std::max(1, static_cast<int>(std::lround(size.width / cell)));
  out.rows = std::max(1, static_cast<int>(std::lround(size.height / cell)));
  const auto cells = static_cast<std::size_t>(out.columns * out.rows);
  out.pictures.assign(cells, 0);
  out.counts.assign(cells, true);
  for (int row = 0; row < out.rows; ++row)
    for (int column = 0; column < out.columns; ++column) {
      const double x = (column + 0.5) / out.columns * size.width - 0.5 * size.width;
      const double y = (row + 0.5) / out.rows * size.height - 0.5 * size.height;
      if (circle_px > 0 && std::hypot(x, y) > circle_px)
        out.counts[static_cast<std::size_t>(row * out.columns + column)] = false;
    }
  for (const Picture& p : observations.pictures) {
    if (p.lens != lens || p.observations.empty()) continue;
    ++out.with_board;
    std::set<std::size_t> seen;
    for (const PointObservation& s : p.observations) {
      const int column = std::clamp(static_cast<int>((s.pixel.x + 0.5) / size.width * out.columns), 0, out.columns - 1);
      const int row = std::clamp(static_cast<int>((s.pixel.y + 0.5) / size.height * out.rows), 0, out.rows - 1);
      seen.insert(static_cast<std::size_t>(row * out.columns + column));
    }
    for (const std::size_t i : seen) ++out.pictures[i];
  }
  return out;
}

std::vector<std::string> suggest_views(const Coverage& c) {
  std::vector<std::string> out;
  struct Region {
    double lacking;
    std::string text;
  };
  std::vector<Region> regions;
  static constexpr const char* kDown[] = {"upper", "middle", "lower"};
  static constexpr const char* kAcross[] = {"left", "middle", "right"};
  for (int down = 0; down < 3; ++down) {
    for (int across = 0; across < 3; ++across) {
      int counted = 0, lacking = 0;
      for (int row = down * c.rows / 3; row < (down + 1) * c.rows / 3; ++row)
        for (int column = across * c.columns / 3; column < (across + 1) * c.columns / 3; ++column) {
          counted += c.counts[static_cast<std::size_t>(row * c.columns + column)] ? 1 : 0;
          lacking += c.needs_views(column, row) ? 1 : 0;
        }
      if (counted == 0 || lacking <= kMaxUncoveredFraction * counted) continue;
      std::string where = down == 1 && across == 1 ? "middle"
                          : down == 1              ? kAcross[across]
                          : across == 1            ? kDown[down] + std::string(" part")
                                                   : std::string(kDown[down]) + " " + kAcross[across];
      regions.push_back({static_cast<double>(lacking) / counted,
                         "show the board in the " + where + " of the picture" +
                             (down == 1 && across == 1 ? "" : ", up to its edge") + " (" + std::to_string(lacking) +
                             " of " + std::to_string(counted) + " cells lack views)"});
    }
  }
  std::ranges::stable_sort(regions, std::ranges::greater(), &Region::lacking);
  for (Region& r : regions) out.push_back(std::move(r.text));
  if (c.with_board < kMinPictures)
    out.push_back("take " + std::to_string(kMinPictures - c.with_board) +
                  " more pictures, the board tilted by 30 degrees and more");
  return out;
}

}  // namespace lightwell::calibration
