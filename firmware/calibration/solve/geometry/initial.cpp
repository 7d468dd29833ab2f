#include "calibration/solve/geometry/initial.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Dense>
#include <ceres/ceres.h>

#include <lightwell/quantile.hpp>

#include "calibration/model/cameras.hpp"

namespace lightwell::calibration {
namespace {

using std::numbers::pi;

/// Initial fields of view along the shorter side; from each the optimisation converges to neighbouring ones.
constexpr double kFields_deg[] = {60, 100, 140, 180, 220};
/// Minimum number of points for a board's pose.
constexpr std::size_t kMinPoints = 4;
/// Residual from which a point is rejected: this many times the median residual, or this angle if it is larger.
constexpr double kOutlierMedians = 5, kNear_rad = 2e-3;
constexpr int kPoseRounds = 6;
/// Second smallest singular value, relative to the largest, below which the homography is not unique.
constexpr double kMinSingularValueRatio = 1e-7;

LensParameters equidistant(const LensSize& size, double field_rad) {
  const double f = 0.5 * std::min(size.width, size.height) / (0.5 * field_rad);
  return lens_of(size, KannalaBrandtParameters{f, f, 0.5 * (size.width - 1), 0.5 * (size.height - 1), 0, 0, 0, 0});
}

/// Pose of a board; points with residuals far above the median are removed, and the pose is computed again.
std::optional<Pose> pose_of(const BoardObservations& all, const Picture& picture, int board,
                            const CameraModel& camera) {
  std::vector<Vec3d> points, directions;
  for (const PointObservation& s : picture.observations) {
    if (s.board != board) continue;
    const std::optional<Vec3d> d = camera.unproject(s.pixel);
    if (!d) continue;
    points.push_back(all.boards[static_cast<std::size_t>(board)].points[static_cast<std::size_t>(s.point)]);
    directions.push_back(*d);
  }
  std::optional<Pose> pose;
  for (int round = 0; round < kPoseRounds && points.size() >= kMinPoints; ++round) {
    pose = board_pose(points, directions);
    if (!pose) return pose;
    std::vector<double> off;
    for (std::size_t k = 0; k < points.size(); ++k)
      off.push_back(angle_between(transformed(*pose, points[k]), directions[k]));
    const double limit = kOutlierMedians * std::max(upper_quantile(std::vector(off), 0.5), kNear_rad);
    std::size_t kept = 0;
    for (std::size_t k = 0; k < points.size(); ++k) {
      if (off[k] > limit) continue;
      points[kept] = points[k];
      directions[kept++] = directions[k];
    }
    if (kept == points.size()) return pose;
    points.resize(kept);
    directions.resize(kept);
  }
  return points.size() >= kMinPoints ? board_pose(points, directions) : std::nullopt;
}

/// The observations of one lens, with each board in each picture as a separate capture of one board with all points.
struct SplitByBoard {
  BoardObservations observations;
  BundleState state;
  std::vector<std::pair<std::size_t, int>> captures;  ///< Picture and board of each capture.
};

SplitByBoard split_by_board(const BoardObservations& all, int lens, const LensParameters& guess) {
  SplitByBoard out;
  out.observations.lenses = {all.lenses[static_cast<std::size_t>(lens)]};
  std::vector<int> first_point;
  Board every;
  for (const Board& b : all.boards) {
    first_point.push_back(static_cast<int>(every.points.size()));
    every.points.insert(every.points.end(), b.points.begin(), b.points.end());
  }
  out.observations.boards = {every};
  out.state.lenses = {guess.model};
  out.state.lens_from_rig = {Pose{}};
  out.state.world_from_board = {Pose{}};
  const CameraModel camera(guess);
  for (std::size_t i = 0; i < all.pictures.size(); ++i) {
    if (all.pictures[i].lens != lens) continue;
    for (int b = 0; b < static_cast<int>(all.boards.size()); ++b) {
      const std::optional<Pose> pose = pose_of(all, all.pictures[i], b, camera);
      if (!pose) continue;
      Picture picture;
      picture.capture = static_cast<int>(out.captures.size());
      for (const PointObservation& s : all.pictures[i].observations)
        if (s.board == b)
          picture.observations.push_back({0, first_point[static_cast<std::size_t>(b)] + s.point, s.pixel});
      out.observations.pictures.push_back(std::move(picture));
      out.state.rig_from_world.push_back(*pose);
      out.captures.emplace_back(i, b);
    }
  }
  return out;
}

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

Result<LensInitialization> initialize_lens(const BoardObservations& observations, int lens) {
  LensInitialization best;
  best.rms_px = std::numeric_limits<double>::infinity();
  for (const double field : kFields_deg) {
    const SplitByBoard start = split_by_board(
        observations, lens, equidistant(observations.lenses[static_cast<std::size_t>(lens)], field * pi / 180));
    if (start.captures.empty()) continue;
    // The initial estimate may be far off, so weight all observations equally at first.
    BundleOptions options;
    options.robust_px = 20;
    options.max_iterations = 60;
    const Result<BundleFit> fit = fit_bundle(start.observations, start.state, options);
    if (!fit || !(fit->rms_px < best.rms_px)) continue;
    best.lens = std::get<KannalaBrandtParameters>(fit->state.lenses[0]);
    best.rms_px = fit->rms_px;
    best.board_poses.assign(observations.pictures.size(), std::vector<std::optional<Pose>>(observations.boards.size()));
    best.tilt_rad = 0;
    std::vector<Vec3d> normals;
    for (std::size_t k = 0; k < start.captures.size(); ++k) {
      const auto [picture, board] = start.captures[k];
      best.board_poses[picture][static_cast<std::size_t>(board)] = fit->state.rig_from_world[k];
      normals.push_back(rotate(fit->state.rig_from_world[k].rotation, Vec3d{0, 0, 1}));
    }
    for (const Vec3d& a : normals)
      for (const Vec3d& b : normals) best.tilt_rad = std::max(best.tilt_rad, angle_between(a, b));
  }
  if (!std::isfinite(best.rms_px))
    return Status(StatusCode::failed_precondition, "calibration: lens " + std::to_string(lens) +
                                                       ": no lens model fits the pictures; check the board's size and "
                                                       "spacing, and that all pictures are of this lens");
  return best;
}

Result<BundleState> initialize_bundle(const BoardObservations& observations,
                                      const std::vector<LensInitialization>& lenses) {
  const std::size_t boards = observations.boards.size();
  std::size_t captures = 0;
  for (const Picture& p : observations.pictures) captures = std::max(captures, static_cast<std::size_t>(p.capture) + 1);
  std::vector<std::optional<Pose>> world_from_board(boards), rig_from_world(captures), lens_from_rig(lenses.size());
  world_from_board[0] = Pose{};
  lens_from_rig[0] = Pose{};

  // Each pose T_lens_board = T_lens_rig T_rig_world T_world_board determines one of the three factors from the other
  // two. Repeat, those with the most points first, until no further pose is determined.
  struct Link {
    std::size_t lens, capture, board, points;
    Pose pose;
  };
  std::vector<Link> links;
  for (std::size_t i = 0; i < observations.pictures.size(); ++i) {
    const Picture& p = observations.pictures[i];
    for (std::size_t b = 0; b < boards; ++b) {
      const std::optional<Pose>& pose = lenses[static_cast<std::size_t>(p.lens)].board_poses[i][b];
      if (!pose) continue;
      const auto points = std::count_if(p.observations.begin(), p.observations.end(), [&](const PointObservation& s) {
        return static_cast<std::size_t>(s.board) == b;
      });
      links.push_back({static_cast<std::size_t>(p.lens), static_cast<std::size_t>(p.capture), b,
                       static_cast<std::size_t>(points), *pose});
    }
  }
  std::stable_sort(links.begin(), links.end(), [](const Link& a, const Link& b) { return a.points > b.points; });
  for (bool more = true; more;) {
    more = false;
    for (const Link& k : links) {
      std::optional<Pose>&lens = lens_from_rig[k.lens], &rig = rig_from_world[k.capture],
      &board = world_from_board[k.board];
      if (static_cast<int>(lens.has_value()) + static_cast<int>(rig.has_value()) +
              static_cast<int>(board.has_value()) !=
          2)
        continue;
      if (!rig)
        rig = compose(compose(inverse(*lens), k.pose), inverse(*board));
      else if (!board)
        board = compose(inverse(compose(*lens, *rig)), k.pose);
      else
        lens = compose(k.pose, inverse(compose(*rig, *board)));
      more = true;
      break;  // Restart with the one with the most points.
    }
  }
  for (std::size_t b = 0; b < boards; ++b) {
    if (world_from_board[b]) continue;
    return Status(StatusCode::failed_precondition,
                  "calibration: board '" + observations.boards[b].name + "' is joined to '" +
                      observations.boards[0].name +
                      "' by no picture; take pictures that show both to one lens, or remove the board");
  }
  if (lens_from_rig.size() > 1 && !lens_from_rig[1])
    return Status(StatusCode::failed_precondition,
                  "calibration: no capture joins the two lenses; take some in which each of them sees a board");
  BundleState out;
  for (const LensInitialization& l : lenses) out.lenses.emplace_back(l.lens);
  for (const auto& p : lens_from_rig) out.lens_from_rig.push_back(*p);
  for (const auto& p : world_from_board) out.world_from_board.push_back(*p);
  for (const auto& p : rig_from_world) out.rig_from_world.push_back(p.value_or(Pose{}));
  return out;
}

namespace {

/// Difference of the pixels of one direction in both models.
template <template <class> class Camera>
struct SamePixel {
  Vec3d direction;
  PixelPosition pixel;

  template <class T>
  bool operator()(const T* lens, T* residual) const {
    T u, v;
    // Outside the model's domain the residual is large and its slope leads back into the domain.
    if (!Camera<T>::from(lens).project(T(direction.x), T(direction.y), T(direction.z), u, v)) return false;
    residual[0] = u - pixel.x;
    residual[1] = v - pixel.y;
    return true;
  }
};

/// Minimises from one start and returns the remaining error; infinite if the start does not cover all angles.
template <template <class> class Camera>
double fit_equivalent_model(const KannalaBrandtParameters& lens, double max_model_angle_rad,
                            std::array<double, 9>& values) {
  ceres::Problem problem;
  const auto source = KannalaBrandtCamera<double>::from(values_of(lens).data());
  const auto first = Camera<double>::from(values.data());
  constexpr int kThetas = 40, kAzimuths = 12;
  for (int i = 1; i <= kThetas; ++i) {
    for (int j = 0; j < kAzimuths; ++j) {
      const double theta = max_model_angle_rad * i / kThetas, phi = 2 * pi * j / kAzimuths;
      const Vec3d d{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
      PixelPosition p;
      double start[2];
      if (!source.project(d.x, d.y, d.z, p.x, p.y)) continue;
      if (!first.project(d.x, d.y, d.z, start[0], start[1])) return std::numeric_limits<double>::infinity();
      problem.AddResidualBlock(
          new ceres::AutoDiffCostFunction<SamePixel<Camera>, 2, static_cast<int>(Camera<double>::kParameters)>(
              new SamePixel<Camera>{d, p}),
          nullptr, values.data());
    }
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = 200;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return summary.IsSolutionUsable() ? summary.final_cost : std::numeric_limits<double>::infinity();
}

/// The best of several minimisations; all zero if no start covers all angles.
template <template <class> class Camera>
ModelParameters best_fit(const KannalaBrandtParameters& lens, double max_model_angle_rad,
                         const std::vector<std::array<double, 9>>& starts) {
  std::array<double, 9> best{};
  double least = std::numeric_limits<double>::infinity();
  for (std::array<double, 9> values : starts) {
    const double left = fit_equivalent_model<Camera>(lens, max_model_angle_rad, values);
    if (!(left < least)) continue;
    least = left;
    best = values;
  }
  return from_values<typename Camera<double>::Parameters>(best.data());
}

}  // namespace

ModelParameters equivalent_model(const KannalaBrandtParameters& k, LensKind kind, double max_model_angle_rad) {
  if (kind == LensKind::kannala_brandt) return k;
  // Starts with the same scale on the axis as `k`.
  std::vector<std::array<double, 9>> starts;
  if (kind == LensKind::mei) {
    for (const double xi : {0.8, 1.2, 1.8, 3.0})
      starts.push_back({(1 + xi) * k.fx, (1 + xi) * k.fy, k.cx, k.cy, xi, 0, 0, 0, 0});
    return best_fit<MeiCamera>(k, max_model_angle_rad, starts);
  }
  for (const double xi : {-0.4, -0.2, 0.0, 0.3})
    for (const double alpha : {0.45, 0.55, 0.65})
      starts.push_back({(1 + xi) * k.fx, (1 + xi) * k.fy, k.cx, k.cy, xi, alpha});
  return best_fit<DoubleSphereCamera>(k, max_model_angle_rad, starts);
}

}  // namespace lightwell::calibration
