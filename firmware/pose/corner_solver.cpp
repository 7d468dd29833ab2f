#include "pose/corner_solver.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <Eigen/Dense>
#include <Eigen/SparseCore>
#include <ceres/ceres.h>

#include <lightwell/quantile.hpp>

namespace lightwell {

namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
/// Degrees of freedom of the prior of the corners' common variance factor: a standard deviation of the factor's
/// logarithm of sqrt(2 / 8), the scatter of chi² over the conditions of the table in README.md.
constexpr double kVarianceFreedom = 8;
template <class T>
using Vector3 = Eigen::Matrix<T, 3, 1>;

/// Stereographic projection of the unit vector `d` from -n to the tangent plane at n: its length is the angle for small
/// angles and grows without bound towards -n, so that the cost has no stationary point there.
template <class T>
void stereographic(const Vector3<T>& d, const Eigen::Vector3d& n, const Eigen::Vector3d& u, const Eigen::Vector3d& v,
                   Eigen::Matrix<T, 2, 1>& out) {
  const T denominator = T(1) + d.dot(n.cast<T>());
  const T scale = T(2) / (denominator > T(1e-9) ? denominator : T(1e-9));
  out = {scale * d.dot(u.cast<T>()), scale * d.dot(v.cast<T>())};
}

/// Whitened direction error of one corner. Parameters: quaternion (x, y, z, w) and translation of T_probe_centroid.
struct CornerResidual {
  const CornerObservation* corner;
  Vec3d centroid;

  template <class T>
  bool operator()(const T* rotation, const T* translation, T* out) const {
    const Eigen::Map<const Eigen::Quaternion<T>> q(rotation);
    const Eigen::Map<const Vector3<T>> t(translation);
    const Vector3<T> in_probe = q * eigen(corner->world - centroid).cast<T>() + t - eigen(corner->lens).cast<T>();
    const T distance = in_probe.norm();
    if (!(distance > T(1e-9))) return false;
    Eigen::Matrix<T, 2, 1> off;
    stereographic<T>(in_probe / distance, eigen(corner->direction), eigen(corner->u), eigen(corner->v), off);
    Eigen::Map<Eigen::Matrix<T, 2, 1>> residual(out);
    residual = corner->whitening.cast<T>() * off;
    return true;
  }
};

/// Error of the up direction against the gravity reading, in standard deviations. Parameter: the quaternion alone.
struct UpResidual {
  Vec3d up, u, v;
  double sigma_rad;

  template <class T>
  bool operator()(const T* rotation, T* out) const {
    const Eigen::Map<const Eigen::Quaternion<T>> q(rotation);
    const Vector3<T> seen = q * Eigen::Vector3d::UnitY().cast<T>();
    Eigen::Matrix<T, 2, 1> off;
    stereographic<T>(seen, eigen(up), eigen(u), eigen(v), off);
    Eigen::Map<Eigen::Matrix<T, 2, 1>> residual(out);
    residual = off / T(sigma_rad);
    return true;
  }
};

struct Parameters {
  std::array<double, 4> q;
  std::array<double, 3> t;

  explicit Parameters(const Pose& p)
      : q{p.rotation.x, p.rotation.y, p.rotation.z, p.rotation.w},
        t{p.translation.x, p.translation.y, p.translation.z} {}
  [[nodiscard]] Pose pose() const { return {Quat{q[0], q[1], q[2], q[3]}.normalized(), {t[0], t[1], t[2]}}; }
};

Vec3d centroid_of(const Quads& quads) {
  Vec3d sum;
  int count = 0;
  for (const ObservedTag* quad : quads)
    for (const CornerObservation& c : quad->corners) {
      sum += c.world;
      ++count;
    }
  return sum * (1.0 / count);
}

/// Cauchy-like cost of whole tags and gravity, to rank starts.
double robust_cost(const Quads& quads, const std::optional<GravityReading>& gravity, const Pose& probe_world) {
  double sum = 0;
  for (const ObservedTag* quad : quads) sum += std::log1p(mean_squared_residual(*quad, probe_world) / 9);
  if (gravity) {
    const Vec3d up = rotate(probe_world.rotation, Vec3d{0, 1, 0});
    const double off = angle_between(up, gravity->up_probe) / gravity->sigma_rad;
    sum += std::log1p(off * off / 9);
  }
  return sum;
}

using PoseJacobian = Eigen::Matrix<double, Eigen::Dynamic, 6>;

PoseJacobian dense_jacobian(const ceres::CRSMatrix& sparse) {
  PoseJacobian out = Eigen::Map<const Eigen::SparseMatrix<double, Eigen::RowMajor>>(
      sparse.num_rows, sparse.num_cols, static_cast<Eigen::Index>(sparse.values.size()), sparse.rows.data(),
      sparse.cols.data(), sparse.values.data());
  // The tangent space of Ceres' quaternion manifold is half a rotation vector.
  out.leftCols<3>() *= 0.5;
  return out;
}

}  // namespace

CornerSolution solve_pose(const Quads& quads, const std::optional<GravityReading>& gravity, const Pose& probe_world,
                          Loss loss, const SolverLimits& limits) {
  CornerSolution out;
  out.centroid = centroid_of(quads);
  Parameters at(compose(probe_world, Pose{{}, out.centroid}));
  ceres::CauchyLoss cauchy(3);
  ceres::HuberLoss huber(4);
  ceres::EigenQuaternionManifold manifold;
  ceres::Problem::Options problem_options;
  problem_options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  // The checks compare each block with all others; here each block is added once.
  problem_options.disable_all_safety_checks = true;
  ceres::Problem problem(problem_options);
  problem.AddParameterBlock(at.q.data(), 4, &manifold);
  problem.AddParameterBlock(at.t.data(), 3);
  ceres::LossFunction* const robust = loss == Loss::cauchy ? static_cast<ceres::LossFunction*>(&cauchy) : &huber;
  for (const ObservedTag* quad : quads)
    for (const CornerObservation& corner : quad->corners)
      problem.AddResidualBlock(
          new ceres::AutoDiffCostFunction<CornerResidual, 2, 4, 3>(new CornerResidual{&corner, out.centroid}), robust,
          at.q.data(), at.t.data());
  if (gravity) {
    const Vec3d up = normalized(gravity->up_probe);
    const auto basis = tangent_basis(up);
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<UpResidual, 2, 4>(new UpResidual{up, basis[0], basis[1], gravity->sigma_rad}),
        nullptr, at.q.data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = limits.iterations;
  options.function_tolerance = limits.tolerance;
  options.gradient_tolerance = 100 * limits.tolerance;
  options.parameter_tolerance = 100 * limits.tolerance;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable()) return out;
  ceres::Problem::EvaluateOptions evaluate;
  evaluate.parameter_blocks = {at.q.data(), at.t.data()};
  ceres::CRSMatrix sparse;
  double cost = 0;
  std::vector<double> residual;
  if (!problem.Evaluate(evaluate, &cost, nullptr, nullptr, &sparse) || sparse.num_cols != 6) return out;
  const PoseJacobian weighted = dense_jacobian(sparse);
  out.information = weighted.transpose() * weighted;
  evaluate.apply_loss_function = false;
  if (!problem.Evaluate(evaluate, nullptr, &residual, nullptr, &sparse)) return out;
  out.residual = Eigen::Map<const Eigen::VectorXd>(residual.data(), sparse.num_rows);
  out.jacobian = dense_jacobian(sparse);
  out.cost = 2 * cost;
  out.probe_centroid = at.pose();
  return out;
}

double mean_squared_residual(const ObservedTag& quad, const Pose& probe_world) {
  double sum = 0;
  const Parameters at(probe_world);
  for (const CornerObservation& corner : quad.corners) {
    std::array<double, 2> r{};
    if (!CornerResidual{&corner, {}}(at.q.data(), at.t.data(), r.data())) return kInfinite;
    sum += r[0] * r[0] + r[1] * r[1];
  }
  return sum / (2.0 * static_cast<double>(quad.corners.size()));
}

Pose mirror_pose(const Quads& quads, const Pose& probe_world) {
  const Eigen::Vector3d centroid = eigen(centroid_of(quads));
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const ObservedTag* quad : quads)
    for (const CornerObservation& c : quad->corners) {
      const Eigen::Vector3d off = eigen(c.world) - centroid;
      spread += off * off.transpose();
    }
  const Eigen::Vector3d normal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(0);
  const Quat& r = probe_world.rotation;
  const Eigen::Matrix3d turn = Eigen::Quaterniond(r.w, r.x, r.y, r.z).toRotationMatrix();
  const Vec3d seen = transformed(probe_world, vec(centroid));
  const Eigen::Vector3d sight = (eigen(seen) - eigen(quads[0]->corners[0].lens)).normalized();
  const Eigen::Matrix3d other = (Eigen::Matrix3d::Identity() - 2 * sight * sight.transpose()) * turn *
                                (Eigen::Matrix3d::Identity() - 2 * normal * normal.transpose());
  Pose out{quat(Eigen::Quaterniond(other)).normalized(), {}};
  out.translation = seen - rotate(out.rotation, vec(centroid));
  return out;
}

CornerSolution consensus_pose(const Quads& quads, const std::optional<GravityReading>& gravity,
                              const SolverLimits& limits) {
  std::vector<std::pair<double, Pose>> starts;
  for (const ObservedTag* quad : quads) {
    const Quads one = {quad};
    for (const Pose& start : {quad->probe_world, mirror_pose(one, quad->probe_world)}) {
      const CornerSolution s = solve_pose(one, gravity, start, Loss::huber, limits);
      if (!std::isfinite(s.cost)) continue;
      const Pose found = s.probe_world();
      starts.emplace_back(robust_cost(quads, gravity, found), found);
    }
  }
  std::sort(starts.begin(), starts.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  // The best start is among the first few; each costs a minimisation over all corners.
  constexpr std::size_t kMaxStarts = 4;
  if (starts.size() > kMaxStarts) starts.resize(kMaxStarts);
  CornerSolution best;
  for (const auto& start : starts)
    if (CornerSolution s = solve_pose(quads, gravity, start.second, Loss::cauchy, limits); s.cost < best.cost) best = s;
  return best;
}

Quads find_inliers(const Quads& quads, const Pose& probe_world, std::span<const double> expected) {
  std::vector<double> all;
  for (const ObservedTag* quad : quads) all.push_back(mean_squared_residual(*quad, probe_world));
  for (std::size_t i = 0; i < expected.size(); ++i) all[i] /= expected[i];
  const double threshold = std::max(25.0, 25 * lower_quantile(std::vector(all), 0.5));
  Quads out;
  for (std::size_t i = 0; i < quads.size(); ++i)
    if (all[i] <= threshold) out.push_back(quads[i]);
  return out;
}

double log_likelihood_ratio(double best, double other, double freedom) {
  return (kVarianceFreedom + freedom) * std::log((kVarianceFreedom + other) / (kVarianceFreedom + best));
}

bool are_distinct(const CornerSolution& a, const CornerSolution& b) {
  const Quat between = b.probe_centroid.rotation * a.probe_centroid.rotation.inverse();
  return !(length(Vec3d{between.x, between.y, between.z}) < 1e-3);
}

std::optional<Matrix6d> pose_covariance_of(const CornerSolution& solution) {
  // Scaled to a unit diagonal first, because radians and metres have different magnitudes.
  const Vector6d unit = solution.information.diagonal().cwiseSqrt().cwiseInverse();
  const Matrix6d scaled = unit.asDiagonal() * solution.information * unit.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> parts(scaled);
  if (!unit.allFinite() || !(parts.eigenvalues()[0] > 1e-14)) return std::nullopt;
  return unit.asDiagonal() * parts.eigenvectors() * parts.eigenvalues().cwiseInverse().asDiagonal() *
         parts.eigenvectors().transpose() * unit.asDiagonal();
}

PoseCovariance covariance_from(const Matrix6d& m) {
  PoseCovariance out{};
  Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(out[0].data()) = m;
  return out;
}

}  // namespace lightwell
