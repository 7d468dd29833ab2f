#include "pose/body_view.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace lightwell {

namespace {

constexpr double kDegree = std::numbers::pi / 180;
/// Angle between a tag's normal and the line of sight beyond which tags are hardly detected.
constexpr double kOnEdge = 80 * kDegree;
/// Tags beyond this angle do not limit the decimation: they add little to the pose.
constexpr double kMaxViewAngle_rad = 70 * kDegree;
/// Smaller tags, relative to the largest, do not limit the decimation: they cost more time than they add accuracy. Tags
/// next to a dodecahedron's face that is seen head-on have a relative width of 0.45.
constexpr double kMinRelativeTagSize = 0.4;
constexpr double kSearchSigmas = 3;
/// Margin around a tag for AprilTag and the blur of its edges, px.
constexpr double kMargin = 4;

}  // namespace

std::optional<BodyView> view_of(const PosedLens& lens, std::span<const WorldTag> tags,
                                const UncertainPose& probe_body) {
  const Pose lens_body = compose(inverse(lens.probe_lens), probe_body.pose);
  const PoseCovariance& c = probe_body.covariance;
  const double turn = kSearchSigmas * std::sqrt(std::max({c[0][0], c[1][1], c[2][2]}));
  // Position variance across the line of sight only: the sum over the two perpendicular axes.
  const Vec3d sight = normalized(probe_body.pose.translation - lens.probe_lens.translation);
  double across = 0;
  for (const Vec3d axis : tangent_basis(sight)) {
    const std::array<double, 3> a = {axis.x, axis.y, axis.z};
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k) across += a[i] * c[i + 3][k + 3] * a[k];
  }
  const double shift = kSearchSigmas * std::sqrt(std::max(across, 0.0));

  double left = std::numeric_limits<double>::infinity(), right = -left, top = left, bottom = -left;
  double px_per_m = 0, radius = 0;
  std::vector<double> cells;
  for (const WorldTag& tag : tags) {
    const Pose lens_tag = compose(lens_body, tag.world_tag);
    const double off = angle_between(rotate(lens_tag.rotation, Vec3d{0, 0, 1}), -lens_tag.translation);
    if (off > kOnEdge + turn) continue;
    const TagShape shape = shape_of(tag.family);
    const auto project = [&](double size_m, std::array<PixelPosition, 4>& out) {
      const auto at = tag_corners(size_m);
      for (std::size_t i = 0; i < 4; ++i) {
        const auto p = lens.model.project(transformed(lens_tag, at[i]));
        if (!p) return false;
        out[i] = *p;
      }
      return true;
    };
    std::array<PixelPosition, 4> paper, edge;
    if (!project(tag.size_m * shape.cells / shape.edge_cells, paper) || !project(tag.size_m, edge)) continue;
    radius = std::max(radius, length(tag.world_tag.translation));
    double shortest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < 4; ++i) {
      left = std::min(left, paper[i].x);
      right = std::max(right, paper[i].x);
      top = std::min(top, paper[i].y);
      bottom = std::max(bottom, paper[i].y);
      const PixelPosition a = edge[i], b = edge[(i + 1) % 4];
      const double side = std::hypot(a.x - b.x, a.y - b.y);
      shortest = std::min(shortest, side);
      px_per_m = std::max(px_per_m, side / tag.size_m);
    }
    if (off < kMaxViewAngle_rad) cells.push_back(shortest / shape.edge_cells);
  }
  if (!(left < right)) return std::nullopt;
  const double margin = kMargin + px_per_m * (shift + std::min(turn, 1.0) * radius);
  left -= margin;
  right += margin;
  top -= margin;
  bottom += margin;
  if (!(right > 0 && bottom > 0 && left < lens.width - 1 && top < lens.height - 1)) return std::nullopt;
  BodyView out;
  const auto pixel = [](double v, int most) { return static_cast<int>(std::clamp(v, 0.0, static_cast<double>(most))); };
  out.region.x = pixel(std::floor(left), lens.width);
  out.region.y = pixel(std::floor(top), lens.height);
  out.region.width = pixel(std::ceil(right) + 1, lens.width) - out.region.x;
  out.region.height = pixel(std::ceil(bottom) + 1, lens.height) - out.region.y;
  if (!cells.empty()) {
    const double largest = *std::max_element(cells.begin(), cells.end());
    out.cell_px = largest;
    for (const double cell : cells)
      if (cell > kMinRelativeTagSize * largest) out.cell_px = std::min(out.cell_px, cell);
  }
  return out;
}

double decimation_for(double cell_px) {
  // AprilTag subsamples one pixel of d x d for integer d and averages for 1.5. With 1.5 it finds tags nearly as small
  // as without decimation, in a quarter of the time.
  for (const double d : {4.0, 3.0, 2.0})
    if (cell_px >= 3.5 * d) return d;
  return cell_px >= 2.5 * 1.5 ? 1.5 : 1;
}

}  // namespace lightwell
