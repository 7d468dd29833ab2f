#include "calibration/solve/geometry/bundle.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <Eigen/SparseCore>
#include <ceres/ceres.h>
#include <ceres/normal_prior.h>
#include <glog/logging.h>

#include <lightwell/quantile.hpp>

#include "calibration/model/cameras.hpp"
#include "calibration/solve/geometry/covariance.hpp"

namespace lightwell::calibration {
namespace {

/// Parameter blocks of a pose: quaternion x, y, z, w (Eigen's order), and translation.
struct PoseBlock {
  std::array<double, 4> q{0, 0, 0, 1};
  std::array<double, 3> t{};

  PoseBlock() = default;
  explicit PoseBlock(const Pose& p) {
    const Quat u = p.rotation.normalized();
    q = {u.x, u.y, u.z, u.w};
    t = {p.translation.x, p.translation.y, p.translation.z};
  }
  [[nodiscard]] Pose pose() const { return {Quat{q[0], q[1], q[2], q[3]}.normalized(), {t[0], t[1], t[2]}}; }
};

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
constexpr auto kShapeNumbers = static_cast<Eigen::Index>(BoardShape::kParameters);

template <class T>
using Point = Eigen::Matrix<T, 3, 1>;

template <class T>
Point<T> moved(const T* q, const T* t, const Point<T>& p) {
  return Eigen::Map<const Eigen::Quaternion<T>>(q) * p + Eigen::Map<const Point<T>>(t);
}

/// Velocity of the world relative to the rig, in the rig frame: angular (rad/s) and linear (m/s).
struct Twist {
  Vec3d turn, shift;
};

/// Position of a point in the rig frame after `seconds`, to first order in the translation.
template <class T>
Point<T> transform_by_twist(const Twist& twist, const T& seconds, const Point<T>& p) {
  // Normalised quaternion from half angles: the error is of third order in the rotation angle, which is small.
  const Eigen::Quaternion<T> q(T(1), T(0.5) * seconds * twist.turn.x, T(0.5) * seconds * twist.turn.y,
                               T(0.5) * seconds * twist.turn.z);
  const Point<T> shift(seconds * twist.shift.x, seconds * twist.shift.y, seconds * twist.shift.z);
  return q.normalized() * p + shift;
}

/// By capture, T_after T_before^-1 of the previous and the next rig pose over the time between them. Empty for the
/// first and the last capture, next to gaps of more than a second, and for too few observations.
std::vector<std::optional<Twist>> twists_of(const BoardObservations& observations,
                                            const std::vector<Pose>& rig_from_world) {
  constexpr double kMaxGap_s = 1;
  constexpr std::size_t kMinPoints = 8;
  std::vector<double> time(rig_from_world.size(), std::numeric_limits<double>::quiet_NaN());
  std::vector<std::size_t> seen(rig_from_world.size()), order;
  for (const Picture& p : observations.pictures) seen[static_cast<std::size_t>(p.capture)] += p.observations.size();
  for (const Picture& p : observations.pictures)
    if (const auto c = static_cast<std::size_t>(p.capture); seen[c] >= kMinPoints) time[c] = p.time_s;
  for (std::size_t i = 0; i < time.size(); ++i)
    if (std::isfinite(time[i])) order.push_back(i);
  std::ranges::sort(order, {}, [&](std::size_t i) { return time[i]; });
  std::vector<std::optional<Twist>> out(rig_from_world.size());
  for (std::size_t k = 1; k + 1 < order.size(); ++k) {
    const std::size_t before = order[k - 1], at = order[k], after = order[k + 1];
    const double seconds = time[after] - time[before];
    if (!(time[at] > time[before]) || !(time[after] > time[at]) || seconds > 2 * kMaxGap_s) continue;
    const Pose moved = compose(rig_from_world[after], inverse(rig_from_world[before]));
    Quat q = moved.rotation;
    if (q.w < 0) q = {-q.x, -q.y, -q.z, -q.w};
    const double s = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z);
    const double angle = 2 * std::atan2(s, q.w), rate = (s > 0 ? angle / s : 2) / seconds;
    out[at] = Twist{{q.x * rate, q.y * rate, q.z * rate}, moved.translation * (1 / seconds)};
  }
  return out;
}

/// Reprojection error of a point in the lens's frame; false if it has no pixel.
template <template <class> class Camera, class T>
bool reproject(const T* lens, const Point<T>& p, const PixelPosition& seen, T* residual) {
  T u, v;
  if (!Camera<T>::from(lens).project(p.x(), p.y(), p.z(), u, v)) return false;
  residual[0] = u - seen.x;
  residual[1] = v - seen.y;
  return true;
}

/// Reprojection error of an observation by lens 0 of board 0, whose poses are the identity.
template <template <class> class Camera>
struct Lens0Residual {
  Vec3d point;
  PixelPosition seen;

  template <class T>
  bool operator()(const T* lens, const T* q, const T* t, T* residual) const {
    return reproject<Camera>(lens, moved(q, t, Point<T>(T(point.x), T(point.y), T(point.z))), seen, residual);
  }
};

/// Reprojection error of any observation, optionally with the board's shape; the rig moves with `twist`.
template <template <class> class Camera>
struct RigResidual {
  Vec3d point;
  PixelPosition seen;
  Twist twist;
  const ShapeBasis* basis;

  template <class T>
  bool operator()(const T* lens, const T* lens_q, const T* lens_t, const T* rig_q, const T* rig_t, const T* board_q,
                  const T* board_t, const T* offset, const T* shape, T* residual) const {
    Point<T> p(T(point.x), T(point.y), T(point.z));
    if (shape != nullptr) basis->deform(shape, p.x(), p.y(), p.z());
    p = transform_by_twist(twist, *offset, moved(rig_q, rig_t, moved(board_q, board_t, p)));
    return reproject<Camera>(lens, moved(lens_q, lens_t, p), seen, residual);
  }

  template <class T>
  bool operator()(const T* lens, const T* lens_q, const T* lens_t, const T* rig_q, const T* rig_t, const T* board_q,
                  const T* board_t, const T* offset, T* residual) const {
    const T* const flat = nullptr;
    return (*this)(lens, lens_q, lens_t, rig_q, rig_t, board_q, board_t, offset, flat, residual);
  }
};

/// Silences Ceres' messages through glog to standard error; errors are returned as Status.
class ScopedLogSilencer {
 public:
  ScopedLogSilencer() : before_(FLAGS_minloglevel) { FLAGS_minloglevel = google::GLOG_FATAL; }
  ScopedLogSilencer(const ScopedLogSilencer&) = delete;
  ScopedLogSilencer& operator=(const ScopedLogSilencer&) = delete;
  ~ScopedLogSilencer() { FLAGS_minloglevel = before_; }

 private:
  int before_;
};

class Bundle {
 public:
  Bundle(const BoardObservations& observations, const BundleState& start, const BundleOptions& options)
      : observations_(observations), options_(options), offset_(start.time_offset_s) {
    for (std::size_t k = 0; k < start.lenses.size(); ++k)
      lenses_.push_back({start.lenses[k], parameters_of(start.lenses[k]), PoseBlock(start.lens_from_rig[k])});
    for (const Pose& p : start.rig_from_world) rigs_.emplace_back(p);
    for (const Pose& p : start.world_from_board) boards_.emplace_back(p);
    shapes_ = start.shapes;
    shapes_.resize(observations.boards.size());
    for (const Board& b : observations.boards) bases_.push_back(shape_basis(b));
  }

  [[nodiscard]] Result<BundleFit> fit() {
    const ScopedLogSilencer silence;
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.max_num_iterations = options_.max_iterations;
    options.function_tolerance = 1e-10;
    options.parameter_tolerance = 1e-12;
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    // The velocity is computed from the poses, which depend on the offset: iterate a few times.
    const int rounds = moves() ? 4 : 1;
    for (int round = 0; round < rounds; ++round) {
      if (moves()) twists_ = twists_of(observations_, state().rig_from_world);
      build(options_.shapes);
      ceres::Solver::Summary summary;
      ceres::Solve(options, problem_.get(), &summary);
      if (!summary.IsSolutionUsable() || !std::isfinite(summary.final_cost))
        return Status(StatusCode::failed_precondition, "calibration: no lens model fits the pictures (" +
                                                           summary.message + "); check the boards' sizes");
    }
    BundleFit out;
    find_residuals(out);
    out.state = state();
    if (const Status s = find_covariances(out); !s.ok()) return s;
    return out;
  }

 private:
  struct Lens {
    ModelParameters model;  ///< The initial model; only its kind is used.
    std::vector<double> numbers;
    PoseBlock from_rig;
  };

  [[nodiscard]] bool moves() const { return options_.time_offset && lenses_.size() > 1; }
  /// Whether the picture has the estimated time offset.
  [[nodiscard]] bool late(const Picture& picture) const { return moves() && picture.lens == 1; }
  [[nodiscard]] Eigen::Index size_of(double* block) const { return problem_->ParameterBlockTangentSize(block); }

  template <template <class> class Camera>
  void add(const Picture& picture, const PointObservation& s, bool with_shapes) {
    constexpr int kValues = static_cast<int>(Camera<double>::kParameters),
                  kShape = static_cast<int>(BoardShape::kParameters);
    Lens& lens = lenses_[static_cast<std::size_t>(picture.lens)];
    PoseBlock& rig = rigs_[static_cast<std::size_t>(picture.capture)];
    PoseBlock& board = boards_[static_cast<std::size_t>(s.board)];
    const Vec3d& point =
        observations_.boards[static_cast<std::size_t>(s.board)].points[static_cast<std::size_t>(s.point)];
    const ShapeBasis& basis = bases_[static_cast<std::size_t>(s.board)][static_cast<std::size_t>(s.point)];
    const Twist twist = late(picture) ? *twists_[static_cast<std::size_t>(picture.capture)] : Twist{};
    ceres::LossFunction* loss = new ceres::HuberLoss(options_.robust_px);
    ceres::ResidualBlockId id = nullptr;
    if (with_shapes)
      id = problem_->AddResidualBlock(
          new ceres::AutoDiffCostFunction<RigResidual<Camera>, 2, kValues, 4, 3, 4, 3, 4, 3, 1, kShape>(
              new RigResidual<Camera>{point, s.pixel, twist, &basis}),
          loss, lens.numbers.data(), lens.from_rig.q.data(), lens.from_rig.t.data(), rig.q.data(), rig.t.data(),
          board.q.data(), board.t.data(), &offset_, shapes_[static_cast<std::size_t>(s.board)].numbers.data());
    else if (picture.lens == 0 && s.board == 0)
      id = problem_->AddResidualBlock(new ceres::AutoDiffCostFunction<Lens0Residual<Camera>, 2, kValues, 4, 3>(
                                          new Lens0Residual<Camera>{point, s.pixel}),
                                      loss, lens.numbers.data(), rig.q.data(), rig.t.data());
    else
      id = problem_->AddResidualBlock(
          new ceres::AutoDiffCostFunction<RigResidual<Camera>, 2, kValues, 4, 3, 4, 3, 4, 3, 1>(
              new RigResidual<Camera>{point, s.pixel, twist, &basis}),
          loss, lens.numbers.data(), lens.from_rig.q.data(), lens.from_rig.t.data(), rig.q.data(), rig.t.data(),
          board.q.data(), board.t.data(), &offset_);
    blocks_.push_back({id, {}});
  }

  void build(bool with_shapes) {
    problem_ = std::make_unique<ceres::Problem>();
    blocks_.clear();
    for (std::size_t i = 0; i < observations_.pictures.size(); ++i) {
      const Picture& picture = observations_.pictures[i];
      // Without the rig's velocity the pose at a picture with a time offset is unknown.
      if (late(picture) && !twists_[static_cast<std::size_t>(picture.capture)]) continue;
      for (std::size_t k = 0; k < picture.observations.size(); ++k) {
        with_camera(lenses_[static_cast<std::size_t>(picture.lens)].model,
                    [&]<template <class> class Camera>(const auto& /*parameters*/) {
                      add<Camera>(picture, picture.observations[k], with_shapes);
                    });
        blocks_.back().second = {static_cast<int>(i), static_cast<int>(k), 0, 0};
      }
    }
    const auto turn = [&](PoseBlock& pose) {
      if (problem_->HasParameterBlock(pose.q.data()))
        problem_->SetManifold(pose.q.data(), new ceres::EigenQuaternionManifold);
    };
    const auto fix = [&](double* block) {
      if (problem_->HasParameterBlock(block)) problem_->SetParameterBlockConstant(block);
    };
    for (PoseBlock& p : rigs_) turn(p);
    for (PoseBlock& p : boards_) turn(p);
    for (Lens& lens : lenses_) turn(lens.from_rig);
    fix(lenses_[0].from_rig.q.data()), fix(lenses_[0].from_rig.t.data());
    fix(boards_[0].q.data()), fix(boards_[0].t.data());
    if (!moves()) fix(&offset_);
    for (std::size_t b = 0; b < shapes_.size(); ++b)
      if (problem_->HasParameterBlock(shapes_[b].numbers.data()))
        problem_->AddResidualBlock(
            new ceres::NormalPrior(prior_of(b).asDiagonal(), Eigen::VectorXd::Zero(kShapeNumbers)), nullptr,
            shapes_[b].numbers.data());
  }

  /// Prior of a board's shape in units of the residuals, pixels: the Huber scale is three standard deviations of these.
  [[nodiscard]] Eigen::VectorXd prior_of(std::size_t board) const {
    const auto sigmas = shape_prior(observations_.boards[board]);
    return options_.robust_px / 3 * Eigen::Map<const Eigen::VectorXd>(sigmas.data(), kShapeNumbers).cwiseInverse();
  }

  [[nodiscard]] BundleState state() const {
    BundleState out;
    for (const Lens& lens : lenses_) {
      out.lenses.push_back(with_parameters(lens.model, lens.numbers.data()));
      out.lens_from_rig.push_back(lens.from_rig.pose());
    }
    for (const PoseBlock& p : rigs_) out.rig_from_world.push_back(p.pose());
    for (const PoseBlock& p : boards_) out.world_from_board.push_back(p.pose());
    out.time_offset_s = offset_;
    if (options_.shapes) out.shapes = shapes_;
    return out;
  }

  void find_residuals(BundleFit& out) {
    std::vector<double> sizes;
    double squares = 0;
    for (auto& [id, residual] : blocks_) {
      double r[2] = {};
      (void)problem_->EvaluateResidualBlock(id, false, nullptr, r, nullptr);
      residual.x_px = r[0], residual.y_px = r[1];
      out.residuals.push_back(residual);
      sizes.insert(sizes.end(), {std::abs(r[0]), std::abs(r[1])});
      squares += r[0] * r[0] + r[1] * r[1];
    }
    out.rms_px = std::sqrt(squares / static_cast<double>(blocks_.size()));
    // Degrees of freedom: number of residuals less number of estimated parameters.
    Eigen::Index fitted = 0;
    std::vector<double*> blocks;
    problem_->GetParameterBlocks(&blocks);
    for (double* block : blocks)
      if (!problem_->IsParameterBlockConstant(block)) fitted += size_of(block);
    const auto count = static_cast<double>(sizes.size());
    const double share = std::sqrt(count / std::max(1.0, count - static_cast<double>(fitted)));
    out.sigma_px = std::sqrt(squares / count) * share;
    out.spread_px = 1.4826 * upper_quantile(sizes, 0.5) * share;
  }

  /// One cluster per capture: Jacobian with respect to the `shared` blocks, with the capture's pose eliminated.
  [[nodiscard]] std::vector<Cluster> clusters(const std::vector<double*>& shared) {
    std::vector<std::vector<ceres::ResidualBlockId>> of_capture(rigs_.size());
    for (const auto& [id, residual] : blocks_)
      of_capture[static_cast<std::size_t>(observations_.pictures[static_cast<std::size_t>(residual.picture)].capture)]
          .push_back(id);
    ceres::Problem::EvaluateOptions options;
    options.num_threads = 1;
    std::vector<Cluster> out(rigs_.size());
    for (std::size_t c = 0; c < rigs_.size(); ++c) {
      if (of_capture[c].empty()) continue;
      options.residual_blocks = of_capture[c];
      options.parameter_blocks = shared;
      options.parameter_blocks.insert(options.parameter_blocks.end(), {rigs_[c].q.data(), rigs_[c].t.data()});
      std::vector<double> residuals;
      ceres::CRSMatrix sparse;
      if (!problem_->Evaluate(options, nullptr, &residuals, nullptr, &sparse)) continue;
      const Eigen::MatrixXd dense = Eigen::Map<const Eigen::SparseMatrix<double, Eigen::RowMajor>>(
          sparse.num_rows, sparse.num_cols, static_cast<Eigen::Index>(sparse.values.size()), sparse.rows.data(),
          sparse.cols.data(), sparse.values.data());
      constexpr Eigen::Index kPose = 6;
      out[c] = eliminate_nuisance(dense.rightCols(kPose), dense.leftCols(dense.cols() - kPose),
                                  Eigen::Map<const Eigen::VectorXd>(residuals.data(), sparse.num_rows));
    }
    return out;
  }

  [[nodiscard]] Status find_covariances(BundleFit& out) {
    build(/*with_shapes=*/true);
    std::vector<double*> shared;
    std::vector<Eigen::Index> first;
    Eigen::Index count = 0;
    const auto share = [&](double* block) {
      first.push_back(count);
      if (!problem_->HasParameterBlock(block) || problem_->IsParameterBlockConstant(block)) return;
      shared.push_back(block);
      count += size_of(block);
    };
    for (Lens& lens : lenses_) share(lens.numbers.data());
    if (lenses_.size() > 1) share(lenses_[1].from_rig.q.data()), share(lenses_[1].from_rig.t.data()), share(&offset_);
    const std::size_t poses = first.size();
    for (PoseBlock& board : boards_) share(board.q.data()), share(board.t.data());
    const Eigen::Index rigid = count;
    for (BoardShape& shape : shapes_) share(shape.numbers.data());
    const std::vector<Cluster> each = clusters(shared);
    std::vector<Cluster> all = each;
    std::erase_if(all, [](const Cluster& c) { return c.jacobian.rows() == 0; });

    Eigen::VectorXd prior = Eigen::VectorXd::Zero(count);
    for (std::size_t b = 0; b < shapes_.size(); ++b) {
      const Eigen::Index at = first[poses + 2 * boards_.size() + b];
      if (problem_->HasParameterBlock(shapes_[b].numbers.data())) prior.segment(at, kShapeNumbers) = prior_of(b);
    }
    const ClusteredCovariance with_shapes = clustered_covariance(all, prior);
    ClusteredCovariance fitted = with_shapes;
    if (!options_.shapes) {
      std::vector<Cluster> flat = all;
      for (Cluster& c : flat) c.jacobian = c.jacobian.leftCols(rigid).eval();
      fitted = clustered_covariance(flat, prior.head(rigid));
    }
    if (!fitted.determined || !fitted.covariance.allFinite())
      return {StatusCode::failed_precondition,
              "calibration: the pictures do not determine all that is to be calibrated; show the boards tilted by 30 "
              "degrees and more, at several distances, and all over the picture up to its edge"};
    const auto block = [](const Eigen::MatrixXd& c, Eigen::Index at, Eigen::Index size) {
      const RowMajor part = c.block(at, at, size, size);
      return std::vector<double>(part.data(), part.data() + part.size());
    };
    for (std::size_t k = 0; k < lenses_.size(); ++k)
      out.lens_covariance.push_back(
          block(fitted.covariance, first[k], static_cast<Eigen::Index>(lenses_[k].numbers.size())));
    if (lenses_.size() > 1) {
      const Eigen::Index q = first[2], t = first[3];
      const std::array<Eigen::Index, 6> places{q, q + 1, q + 2, t, t + 1, t + 2};
      RowMajor pair = fitted.covariance(places, places);
      // Ceres' tangent of a quaternion is half the rotation vector.
      pair.topRows(3) *= 2;
      pair.leftCols(3) *= 2;
      out.pair_covariance.assign(pair.data(), pair.data() + pair.size());
      if (moves()) out.time_offset_sigma_s = std::sqrt(fitted.covariance(first[4], first[4]));
    }
    out.shapes = shapes_;
    for (std::size_t b = 0; b < shapes_.size() && with_shapes.determined; ++b) {
      const Eigen::Index at = first[poses + 2 * boards_.size() + b];
      if (!problem_->HasParameterBlock(shapes_[b].numbers.data())) continue;
      for (std::size_t i = 0; i < BoardShape::kParameters && !options_.shapes; ++i)
        out.shapes[b].numbers[i] += with_shapes.step(at + static_cast<Eigen::Index>(i));
      out.shape_covariance.resize(shapes_.size());
      out.shape_covariance[b] = block(with_shapes.covariance, at, kShapeNumbers);
    }
    // Estimate from each capture separately, with all other parameters fixed.
    for (const Cluster& c : each) {
      Eigen::VectorXd spacing = Eigen::VectorXd::Zero(c.jacobian.rows());
      for (std::size_t b = 0; b < shapes_.size() && c.jacobian.cols() > 0; ++b)
        if (problem_->HasParameterBlock(shapes_[b].numbers.data()))
          spacing += c.jacobian.col(first[poses + 2 * boards_.size() + b]);
      const double weight = spacing.squaredNorm();
      out.capture_spacing.push_back(
          weight > 0 ? Estimate{-spacing.dot(c.residuals) / weight, out.spread_px / std::sqrt(weight)} : Estimate{});
    }
    return {};
  }

  const BoardObservations& observations_;
  BundleOptions options_;
  std::vector<Lens> lenses_;
  std::vector<PoseBlock> rigs_, boards_;
  std::vector<BoardShape> shapes_;
  std::vector<std::vector<ShapeBasis>> bases_;  ///< By board and point.
  double offset_;
  std::unique_ptr<ceres::Problem> problem_;
  std::vector<std::optional<Twist>> twists_;  ///< By capture.
  std::vector<std::pair<ceres::ResidualBlockId, Residual>> blocks_;
};

}  // namespace

Result<BundleFit> fit_bundle(const BoardObservations& observations, const BundleState& start,
                             const BundleOptions& options) {
  return Bundle(observations, start, options).fit();
}

}  // namespace lightwell::calibration
