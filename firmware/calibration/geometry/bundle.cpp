#include "calibration/geometry/bundle.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <numeric>
#include <optional>

#include <ceres/ceres.h>
#include <glog/logging.h>

#include "calibration/geometry/twist.hpp"
#include "calibration/projection.hpp"

namespace lightwell::calibration {
namespace {

/// A pose as Ceres moves it: quaternion x, y, z, w (Eigen's order, and ours), then translation.
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

template <class T>
using Point = Eigen::Matrix<T, 3, 1>;

template <class T>
Point<T> moved(const T* q, const T* t, const Point<T>& p) {
  return Eigen::Map<const Eigen::Quaternion<T>>(q) * p + Eigen::Map<const Point<T>>(t);
}

/// A sighting of the frame's own lens and board: poses of both are the identity.
template <class Model>
struct OwnSighting {
  Vec3d point;
  PixelPosition seen;

  template <class T>
  bool operator()(const T* lens, const T* q, const T* t, T* residual) const {
    const Point<T> p = moved(q, t, Point<T>(T(point.x), T(point.y), T(point.z)));
    T u, v;
    if (!Model::project(lens, p.x(), p.y(), p.z(), u, v)) return false;
    residual[0] = u - seen.x;
    residual[1] = v - seen.y;
    return true;
  }
};

/// Any sighting: lens, rig and board each have their pose, and the rig moves on with `twist` (rad/s, m/s, in the rig's
/// axes) for the lens's time offset.
template <class Model>
struct AnySighting {
  Vec3d point;
  PixelPosition seen;
  Twist twist;

  template <class T>
  bool operator()(const T* lens, const T* lens_q, const T* lens_t, const T* rig_q, const T* rig_t, const T* board_q,
                  const T* board_t, const T* offset, T* residual) const {
    Point<T> p = moved(board_q, board_t, Point<T>(T(point.x), T(point.y), T(point.z)));
    p = moved(rig_q, rig_t, p);
    p = carried(twist, *offset, p);
    p = moved(lens_q, lens_t, p);
    T u, v;
    if (!Model::project(lens, p.x(), p.y(), p.z(), u, v)) return false;
    residual[0] = u - seen.x;
    residual[1] = v - seen.y;
    return true;
  }
};

/// Ceres tells of ranks and steps through glog, to standard error; here the answer tells.
class Silence {
 public:
  Silence() : before_(FLAGS_minloglevel) { FLAGS_minloglevel = google::GLOG_FATAL; }
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;
  ~Silence() { FLAGS_minloglevel = before_; }

 private:
  int before_;
};

class Bundle {
 public:
  Bundle(const Sightings& sightings, const BundleState& start, const BundleOptions& options);

  [[nodiscard]] Result<BundleFit> fit();

 private:
  struct Lens {
    ModelParameters model;  ///< As it was at first; its kind counts.
    std::vector<double> numbers;
    PoseBlock from_rig;
  };

  void build();
  template <class Model>
  void add(const Picture& picture, const Sighting& s);
  [[nodiscard]] bool moves() const { return options_.time_offset && lenses_.size() > 1; }
  /// Taken with the offset that is being fitted.
  [[nodiscard]] bool late(const Picture& picture) const { return moves() && picture.lens == 1; }
  [[nodiscard]] BundleState state() const;
  void find_residuals(BundleFit& out);
  [[nodiscard]] Status find_covariances(BundleFit& out);

  const Sightings& sightings_;
  BundleOptions options_;
  std::vector<Lens> lenses_;
  std::vector<PoseBlock> rigs_, boards_;
  double offset_;
  std::unique_ptr<ceres::Problem> problem_;
  std::vector<std::optional<Twist>> twists_;  ///< By capture.
  std::vector<std::pair<ceres::ResidualBlockId, Residual>> blocks_;
};

Bundle::Bundle(const Sightings& sightings, const BundleState& start, const BundleOptions& options)
    : sightings_(sightings), options_(options), offset_(start.time_offset_s) {
  for (std::size_t k = 0; k < start.lenses.size(); ++k)
    lenses_.push_back({start.lenses[k], numbers_of(start.lenses[k]), PoseBlock(start.lens_from_rig[k])});
  for (const Pose& p : start.rig_from_world) rigs_.emplace_back(p);
  for (const Pose& p : start.world_from_board) boards_.emplace_back(p);
}

template <class Model>
void Bundle::add(const Picture& picture, const Sighting& s) {
  constexpr int kValues = static_cast<int>(Model::kParameters);
  Lens& lens = lenses_[static_cast<std::size_t>(picture.lens)];
  PoseBlock& rig = rigs_[static_cast<std::size_t>(picture.capture)];
  PoseBlock& board = boards_[static_cast<std::size_t>(s.board)];
  const Vec3d& point = sightings_.boards[static_cast<std::size_t>(s.board)].points[static_cast<std::size_t>(s.point)];
  ceres::LossFunction* loss = new ceres::HuberLoss(options_.robust_px);
  ceres::ResidualBlockId id = nullptr;
  if (picture.lens == 0 && s.board == 0) {
    id = problem_->AddResidualBlock(
        new ceres::AutoDiffCostFunction<OwnSighting<Model>, 2, kValues, 4, 3>(new OwnSighting<Model>{point, s.pixel}),
        loss, lens.numbers.data(), rig.q.data(), rig.t.data());
  } else {
    const Twist twist = late(picture) ? *twists_[static_cast<std::size_t>(picture.capture)] : Twist{};
    id =
        problem_->AddResidualBlock(new ceres::AutoDiffCostFunction<AnySighting<Model>, 2, kValues, 4, 3, 4, 3, 4, 3, 1>(
                                       new AnySighting<Model>{point, s.pixel, twist}),
                                   loss, lens.numbers.data(), lens.from_rig.q.data(), lens.from_rig.t.data(),
                                   rig.q.data(), rig.t.data(), board.q.data(), board.t.data(), &offset_);
  }
  blocks_.push_back({id, {}});
}

void Bundle::build() {
  problem_ = std::make_unique<ceres::Problem>();
  blocks_.clear();
  for (std::size_t i = 0; i < sightings_.pictures.size(); ++i) {
    const Picture& picture = sightings_.pictures[i];
    // Where the motion is not known, nothing says where a late picture was taken.
    if (late(picture) && !twists_[static_cast<std::size_t>(picture.capture)]) continue;
    for (std::size_t k = 0; k < picture.sightings.size(); ++k) {
      with_model(lenses_[static_cast<std::size_t>(picture.lens)].model,
                 [&](auto model, const auto&) { add<decltype(model)>(picture, picture.sightings[k]); });
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
}

BundleState Bundle::state() const {
  BundleState out;
  for (const Lens& lens : lenses_) {
    out.lenses.push_back(with_numbers(lens.model, lens.numbers.data()));
    out.lens_from_rig.push_back(lens.from_rig.pose());
  }
  for (const PoseBlock& p : rigs_) out.rig_from_world.push_back(p.pose());
  for (const PoseBlock& p : boards_) out.world_from_board.push_back(p.pose());
  out.time_offset_s = offset_;
  return out;
}

void Bundle::find_residuals(BundleFit& out) {
  std::vector<double> sizes;
  double squares = 0;
  for (auto& [id, residual] : blocks_) {
    double r[2] = {};
    (void)problem_->EvaluateResidualBlock(id, false, nullptr, r, nullptr);
    residual.x_px = r[0], residual.y_px = r[1];
    out.residuals.push_back(residual);
    sizes.push_back(std::abs(r[0]));
    sizes.push_back(std::abs(r[1]));
    squares += r[0] * r[0] + r[1] * r[1];
  }
  out.rms_px = std::sqrt(squares / static_cast<double>(blocks_.size()));
  // 1.4826 medians are a deviation of Gaussian numbers whatever the few that are no such; what was fitted takes its
  // share.
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  const double freedom = static_cast<double>(
      sizes.size() - std::min<std::size_t>(sizes.size() - 1, static_cast<std::size_t>(problem_->NumParameters())));
  out.sigma_px = 1.4826 * *middle * std::sqrt(static_cast<double>(sizes.size()) / freedom);
}

Status Bundle::find_covariances(BundleFit& out) {
  ceres::Covariance::Options options;
  options.algorithm_type = ceres::SPARSE_QR;
  options.num_threads = 1;
  ceres::Covariance covariance(options);
  std::vector<std::pair<const double*, const double*>> wanted;
  for (const Lens& lens : lenses_)
    if (problem_->HasParameterBlock(lens.numbers.data())) wanted.emplace_back(lens.numbers.data(), lens.numbers.data());
  const bool pair = lenses_.size() > 1;
  if (pair) {
    const PoseBlock& p = lenses_[1].from_rig;
    wanted.emplace_back(p.q.data(), p.q.data());
    wanted.emplace_back(p.q.data(), p.t.data());
    wanted.emplace_back(p.t.data(), p.t.data());
    if (moves()) wanted.emplace_back(&offset_, &offset_);
  }
  if (!covariance.Compute(wanted, problem_.get()))
    return {
        StatusCode::failed_precondition,
        "calibration: the pictures do not determine all that is to be calibrated; show the boards tilted by 30 degrees "
        "and more, at several distances, and all over the picture up to its edge"};
  const double variance = out.sigma_px * out.sigma_px;
  for (const Lens& lens : lenses_) {
    const std::size_t n = lens.numbers.size();
    std::vector<double> c(n * n);
    (void)covariance.GetCovarianceBlock(lens.numbers.data(), lens.numbers.data(), c.data());
    for (double& v : c) v *= variance;
    out.lens_covariance.push_back(std::move(c));
  }
  if (pair) {
    const PoseBlock& p = lenses_[1].from_rig;
    double qq[9], qt[9], tt[9];
    (void)covariance.GetCovarianceBlockInTangentSpace(p.q.data(), p.q.data(), qq);
    (void)covariance.GetCovarianceBlockInTangentSpace(p.q.data(), p.t.data(), qt);
    (void)covariance.GetCovarianceBlockInTangentSpace(p.t.data(), p.t.data(), tt);
    out.pair_covariance.assign(36, 0);
    // Ceres's tangent of a quaternion is half the turn.
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        out.pair_covariance[6 * i + j] = 4 * variance * qq[3 * i + j];
        out.pair_covariance[6 * i + 3 + j] = out.pair_covariance[6 * (3 + j) + i] = 2 * variance * qt[3 * i + j];
        out.pair_covariance[6 * (3 + i) + 3 + j] = variance * tt[3 * i + j];
      }
    }
    if (moves()) {
      double tv = 0;
      (void)covariance.GetCovarianceBlock(&offset_, &offset_, &tv);
      out.time_offset_sigma_s = std::sqrt(variance * tv);
    }
  }
  return {};
}

Result<BundleFit> Bundle::fit() {
  const Silence silence;
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = options_.most_iterations;
  options.function_tolerance = 1e-10;
  options.parameter_tolerance = 1e-12;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  // The rig's motion is taken from its poses, which the offset moves: a few rounds settle both.
  const int rounds = moves() ? 4 : 1;
  for (int round = 0; round < rounds; ++round) {
    if (moves()) {
      std::vector<Pose> poses;
      for (const PoseBlock& p : rigs_) poses.push_back(p.pose());
      twists_ = twists_of(sightings_, poses);
    }
    build();
    ceres::Solver::Summary summary;
    ceres::Solve(options, problem_.get(), &summary);
    if (!summary.IsSolutionUsable() || !std::isfinite(summary.final_cost))
      return Status(StatusCode::failed_precondition, "calibration: no lens was found that explains the pictures (" +
                                                         summary.message + "); check the boards' sizes");
  }
  BundleFit out;
  find_residuals(out);
  if (const Status s = find_covariances(out); !s.ok()) return s;
  out.state = state();
  return out;
}

}  // namespace

Result<BundleFit> fit_bundle(const Sightings& sightings, const BundleState& start, const BundleOptions& options) {
  return Bundle(sightings, start, options).fit();
}

}  // namespace lightwell::calibration
