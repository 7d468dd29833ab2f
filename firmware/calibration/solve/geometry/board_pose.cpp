#include "calibration/solve/geometry/board_pose.hpp"

#include <cmath>

#include <Eigen/Dense>

namespace lightwell::calibration {
namespace {

/// Second smallest singular value, relative to the largest, below which the homography is not unique.
constexpr double kMinSingularValueRatio = 1e-7;

}  // namespace

std::optional<Pose> board_pose(std::span<const Vec3d> points, std::span<const Vec3d> directions_cv) {
  if (points.size() < 4 || points.size() != directions_cv.size()) return std::nullopt;
  // Normalise to centroid 0 and mean size 1 for conditioning (Hartley 1997).
  double mx = 0, my = 0, size = 0;
  const auto n = static_cast<double>(points.size());
  for (const Vec3d& p : points) mx += p.x / n, my += p.y / n;
  for (const Vec3d& p : points) size += std::hypot(p.x - mx, p.y - my) / n;
  if (!(size > 0) || !std::isfinite(size)) return std::nullopt;

  Eigen::MatrixXd a(3 * static_cast<Eigen::Index>(points.size()), 9);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3d d = normalized(directions_cv[i]);
    if (d == Vec3d{}) return std::nullopt;
    const Eigen::RowVector3d x((points[i].x - mx) / size, (points[i].y - my) / size, 1);
    const auto row = 3 * static_cast<Eigen::Index>(i);
    a.block<1, 9>(row, 0) << Eigen::RowVector3d::Zero(), -d.z * x, d.y * x;
    a.block<1, 9>(row + 1, 0) << d.z * x, Eigen::RowVector3d::Zero(), -d.x * x;
    a.block<1, 9>(row + 2, 0) << -d.y * x, d.x * x, Eigen::RowVector3d::Zero();
  }
  // QR first: the triangular factor (9 x 9) has the same right singular vectors.
  const Eigen::MatrixXd triangle =
      Eigen::HouseholderQR<Eigen::MatrixXd>(a).matrixQR().topRows(9).triangularView<Eigen::Upper>();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(triangle, Eigen::ComputeFullV);
  if (!(svd.singularValues()(7) > kMinSingularValueRatio * svd.singularValues()(0))) return std::nullopt;
  const Eigen::VectorXd v = svd.matrixV().col(8);
  Eigen::Matrix3d h;
  h << v(0), v(1), v(2), v(3), v(4), v(5), v(6), v(7), v(8);

  // Choose the sign for which the points are along their rays, not opposite to them.
  double forward = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d seen = h * Eigen::Vector3d((points[i].x - mx) / size, (points[i].y - my) / size, 1);
    forward += seen.x() * directions_cv[i].x + seen.y() * directions_cv[i].y + seen.z() * directions_cv[i].z;
  }
  if (forward < 0) h = -h;
  const double scale = 2 / (h.col(0).norm() + h.col(1).norm());
  if (!(scale > 0) || !std::isfinite(scale)) return std::nullopt;
  Eigen::Matrix3d axes;
  axes << h.col(0) * scale, h.col(1) * scale, h.col(0).cross(h.col(1)) * scale * scale;
  const Eigen::JacobiSVD<Eigen::Matrix3d> nearest(axes, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d r = nearest.matrixU() * nearest.matrixV().transpose();
  if (r.determinant() < 0) return std::nullopt;
  const Eigen::Vector3d t = h.col(2) * scale * size - r * Eigen::Vector3d(mx, my, 0);
  const Eigen::Quaterniond q(r);
  if (!t.allFinite() || !q.coeffs().allFinite()) return std::nullopt;
  return Pose{{q.x(), q.y(), q.z(), q.w()}, {t.x(), t.y(), t.z()}};
}

}  // namespace lightwell::calibration
