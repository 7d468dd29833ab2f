#include "pose/mounting.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include <Eigen/Dense>
#include <ceres/ceres.h>

#include "pose/tag_directions.hpp"

namespace lightwell {

namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
using Matrix6d = Eigen::Matrix<double, 6, 6>;
template <class T>
using Vector3 = Eigen::Matrix<T, 3, 1>;

Eigen::Vector3d eigen(Vec3d v) { return {v.x, v.y, v.z}; }
Vec3d vec(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Status wrong(const std::string& what) { return {StatusCode::invalid_argument, what}; }

/// Two components of `d` in the plane that touches the sphere at n, projected from -n: as long as the angle for small
/// ones, growing without end towards -n, so that nothing rests there.
template <class T>
void stereographic(const Vector3<T>& d, const Eigen::Vector3d& n, const Eigen::Vector3d& u, const Eigen::Vector3d& v,
                   Eigen::Matrix<T, 2, 1>& out) {
  const T denominator = T(1) + d.dot(n.cast<T>());
  const T scale = T(2) / (denominator > T(1e-9) ? denominator : T(1e-9));
  out = {scale * d.dot(u.cast<T>()), scale * d.dot(v.cast<T>())};
}

/// Parameters of both residuals: the quaternion (x, y, z, w) and the translation of T_world_probe.
struct CornerResidual {
  const SeenCorner* corner;

  template <class T>
  bool operator()(const T* rotation, const T* translation, T* out) const {
    const Eigen::Map<const Eigen::Quaternion<T>> q(rotation);
    const Eigen::Map<const Vector3<T>> t(translation);
    const Vector3<T> in_probe = q.conjugate() * (eigen(corner->world).cast<T>() - t) - eigen(corner->lens).cast<T>();
    const T distance = in_probe.norm();
    if (!(distance > T(1e-9))) return false;
    Eigen::Matrix<T, 2, 1> off;
    stereographic<T>(in_probe / distance, eigen(corner->direction), eigen(corner->u), eigen(corner->v), off);
    Eigen::Map<Eigen::Matrix<T, 2, 1>> residual(out);
    residual = corner->weigh.cast<T>() * off;
    return true;
  }
};

struct UpResidual {
  Vec3d up, u, v;
  double sigma_rad;

  template <class T>
  bool operator()(const T* rotation, T* out) const {
    const Eigen::Map<const Eigen::Quaternion<T>> q(rotation);
    const Vector3<T> seen = q.conjugate() * Eigen::Vector3d::UnitY().cast<T>();
    Eigen::Matrix<T, 2, 1> off;
    stereographic<T>(seen, eigen(up), eigen(u), eigen(v), off);
    Eigen::Map<Eigen::Matrix<T, 2, 1>> residual(out);
    residual = off / T(sigma_rad);
    return true;
  }
};

using Quads = std::vector<const SeenQuad*>;

struct Solution {
  Pose pose;
  double cost = kInfinite;                  ///< Sum of squares after the loss.
  Matrix6d information = Matrix6d::Zero();  ///< For (rotation, translation), world axes.
};

/// From `start` downhill. `loss_at` is where a corner's error, in standard deviations, begins to count less.
Solution solved(const Quads& quads, const std::optional<GravityReading>& gravity, const Pose& start, bool forgiving) {
  std::array<double, 4> q = {start.rotation.x, start.rotation.y, start.rotation.z, start.rotation.w};
  std::array<double, 3> t = {start.translation.x, start.translation.y, start.translation.z};
  ceres::Problem problem;
  problem.AddParameterBlock(q.data(), 4, new ceres::EigenQuaternionManifold);
  problem.AddParameterBlock(t.data(), 3);
  for (const SeenQuad* quad : quads)
    for (const SeenCorner& corner : quad->corners) {
      ceres::LossFunction* loss = forgiving ? static_cast<ceres::LossFunction*>(new ceres::CauchyLoss(3))
                                            : static_cast<ceres::LossFunction*>(new ceres::HuberLoss(4));
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<CornerResidual, 2, 4, 3>(new CornerResidual{&corner}),
                               loss, q.data(), t.data());
    }
  if (gravity) {
    const Vec3d up = normalized(gravity->up_probe);
    const auto basis = tangent_basis(up);
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<UpResidual, 2, 4>(new UpResidual{up, basis[0], basis[1], gravity->sigma_rad}),
        nullptr, q.data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = 100;
  options.function_tolerance = 1e-14;
  options.gradient_tolerance = 1e-12;
  options.parameter_tolerance = 1e-12;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  Solution out;
  if (!summary.IsSolutionUsable()) return out;
  ceres::Problem::EvaluateOptions evaluate;
  evaluate.parameter_blocks = {q.data(), t.data()};
  ceres::CRSMatrix sparse;
  double cost = 0;
  if (!problem.Evaluate(evaluate, &cost, nullptr, nullptr, &sparse) || sparse.num_cols != 6) return out;
  Eigen::MatrixXd slope = Eigen::MatrixXd::Zero(sparse.num_rows, 6);
  for (int row = 0; row < sparse.num_rows; ++row)
    for (int i = sparse.rows[static_cast<std::size_t>(row)]; i < sparse.rows[static_cast<std::size_t>(row) + 1]; ++i)
      // Ceres turns by the half of a rotation vector.
      slope(row, sparse.cols[static_cast<std::size_t>(i)]) =
          sparse.values[static_cast<std::size_t>(i)] * (sparse.cols[static_cast<std::size_t>(i)] < 3 ? 0.5 : 1.0);
  out.information = slope.transpose() * slope;
  out.cost = 2 * cost;
  out.pose = {Quat{q[0], q[1], q[2], q[3]}.normalized(), {t[0], t[1], t[2]}};
  return out;
}

/// Mean square of a tag's corners, in standard deviations.
double mismatch(const SeenQuad& quad, const Pose& pose) {
  double sum = 0;
  const std::array<double, 4> q = {pose.rotation.x, pose.rotation.y, pose.rotation.z, pose.rotation.w};
  const std::array<double, 3> t = {pose.translation.x, pose.translation.y, pose.translation.z};
  for (const SeenCorner& corner : quad.corners) {
    std::array<double, 2> r{};
    if (!CornerResidual{&corner}(q.data(), t.data(), r.data())) return kInfinite;
    sum += r[0] * r[0] + r[1] * r[1];
  }
  return sum / (2.0 * static_cast<double>(quad.corners.size()));
}

double robust_cost(const Quads& quads, const std::optional<GravityReading>& gravity, const Pose& pose) {
  double sum = 0;
  for (const SeenQuad* quad : quads) sum += std::log1p(mismatch(*quad, pose) / 9);
  if (gravity) {
    const Vec3d up = rotate(pose.rotation.inverse(), Vec3d{0, 1, 0});
    const double off = angle_between(up, gravity->up_probe) / gravity->sigma_rad;
    sum += std::log1p(off * off / 9);
  }
  return sum;
}

/// The pose from which corners of a flat target look almost the same: the target's plane mirrored in the plane across
/// the line of sight (Schweighofer & Pinz 2006, section 3, without their perspective terms, which the solver adds).
Pose flipped(const Quads& quads, const Pose& world_probe) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  int count = 0;
  for (const SeenQuad* quad : quads)
    for (const SeenCorner& c : quad->corners) {
      middle += eigen(c.world);
      ++count;
    }
  middle /= count;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const SeenQuad* quad : quads)
    for (const SeenCorner& c : quad->corners) {
      const Eigen::Vector3d off = eigen(c.world) - middle;
      spread += off * off.transpose();
    }
  const Eigen::Vector3d normal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(0);
  const Pose probe_world = inverse(world_probe);
  const Quat& r = probe_world.rotation;
  const Eigen::Matrix3d turn = Eigen::Quaterniond(r.w, r.x, r.y, r.z).toRotationMatrix();
  const Vec3d seen = transformed(probe_world, vec(middle));
  const Eigen::Vector3d sight = (eigen(seen) - eigen(quads[0]->corners[0].lens)).normalized();
  const Eigen::Matrix3d other = (Eigen::Matrix3d::Identity() - 2 * sight * sight.transpose()) * turn *
                                (Eigen::Matrix3d::Identity() - 2 * normal * normal.transpose());
  const Eigen::Quaterniond q(other);
  Pose out{Quat{q.x(), q.y(), q.z(), q.w()}.normalized(), {}};
  out.translation = seen - rotate(out.rotation, vec(middle));
  return inverse(out);
}

Quat turn_to(Vec3d from, Vec3d to) {
  const Vec3d axis = cross(from, to);
  // Half a turn: about any axis across.
  if (dot(from, to) < -1 + 1e-12) {
    const Vec3d any = tangent_basis(from)[0];
    return {any.x, any.y, any.z, 0};
  }
  return Quat{axis.x, axis.y, axis.z, 1 + dot(from, to)}.normalized();
}

Status check(const GravityReading& gravity) {
  if (normalized(gravity.up_probe) == Vec3d{})
    return wrong(
        "gravity: up_probe is zero or not a number; give the direction away from the earth in the probe's frame");
  if (!(gravity.sigma_rad > 0) || !std::isfinite(gravity.sigma_rad))
    return wrong("gravity: sigma_rad is " + std::to_string(gravity.sigma_rad) + "; it must be positive");
  return {};
}

Status check(std::span<const TagInRoom> room) {
  std::set<std::pair<TagFamily, int>> known;
  for (const TagInRoom& tag : room) {
    const std::string name = "room: " + std::string(to_string(tag.family)) + " " + std::to_string(tag.id);
    const Quat q = tag.world_tag.rotation;
    const Vec3d t = tag.world_tag.translation;
    const double norm = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
    if (!(tag.size_m > 0) || !std::isfinite(tag.size_m)) return wrong(name + ": its size must be positive, in metres");
    if (!(std::abs(norm - 1) < 1e-3))
      return wrong(name + ": its quaternion has the length " + std::to_string(norm) + ", not 1");
    if (!std::isfinite(t.x + t.y + t.z)) return wrong(name + ": its place is not a number");
    if (!known.emplace(tag.family, tag.id).second) return wrong(name + " is listed twice");
  }
  return {};
}

double rms_px(const RigParameters& rig, const SeenTag& seen, const TagInRoom& tag, const Pose& world_probe) {
  const LensParameters& lens = rig.lenses[static_cast<std::size_t>(seen.lens)];
  const CameraModel model(lens);
  const Pose probe_lens{lens.pose_cv.rotation.normalized(), lens.pose_cv.translation};
  const Pose lens_world = compose(inverse(probe_lens), inverse(world_probe));
  double sum = 0;
  const auto at = tag_corners(tag.size_m);
  for (std::size_t i = 0; i < 4; ++i) {
    const auto p = model.project(transformed(lens_world, transformed(tag.world_tag, at[i])));
    if (!p) return kInfinite;
    sum += (p->x - seen.tag.corners[i].x) * (p->x - seen.tag.corners[i].x) +
           (p->y - seen.tag.corners[i].y) * (p->y - seen.tag.corners[i].y);
  }
  return std::sqrt(sum / 4);
}

/// The pose that most tags agree on, from every single tag's own and its mirror image as starts.
Solution agreed(const Quads& quads, const std::optional<GravityReading>& gravity) {
  std::vector<std::pair<double, Pose>> starts;
  for (const SeenQuad* quad : quads) {
    const Quads one = {quad};
    for (const Pose& start : {quad->world_probe, flipped(one, quad->world_probe)}) {
      const Solution s = solved(one, gravity, start, false);
      if (std::isfinite(s.cost)) starts.emplace_back(robust_cost(quads, gravity, s.pose), s.pose);
    }
  }
  std::sort(starts.begin(), starts.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  // A good start is among the first; each of them is a solver's run over all corners.
  constexpr std::size_t kTried = 4;
  if (starts.size() > kTried) starts.resize(kTried);
  Solution best;
  for (const auto& start : starts)
    if (Solution s = solved(quads, gravity, start.second, true); s.cost < best.cost) best = s;
  return best;
}

/// Those that agree with `pose`, by the standard deviation of a corner. A model that is off by as much everywhere
/// contradicts nobody: what counts is to be much worse than the better half.
Quads agreeing(const Quads& quads, const Pose& pose) {
  std::vector<double> all;
  for (const SeenQuad* quad : quads) all.push_back(mismatch(*quad, pose));
  std::vector<double> sorted = all;
  std::sort(sorted.begin(), sorted.end());
  const double usual = sorted[(sorted.size() - 1) / 2];
  const double most = std::max(25.0, 25 * usual);
  Quads out;
  for (std::size_t i = 0; i < quads.size(); ++i)
    if (all[i] <= most) out.push_back(quads[i]);
  return out;
}

}  // namespace

Status MountingOptions::validate() const {
  if (!(model_error_px >= 0 && model_error_px <= 100))
    return wrong("model_error_px is " + std::to_string(model_error_px) + "; it must be 0 to 100");
  if (!(ambiguity_odds >= 1) || !std::isfinite(ambiguity_odds))
    return wrong("ambiguity_odds is " + std::to_string(ambiguity_odds) + "; it must be at least 1");
  return {};
}

std::vector<TagInRoom> tags_of(const TagBoard& board, const Pose& world_board) {
  std::vector<TagInRoom> out;
  for (int i = 0; i < board.tags(); ++i) {
    const int id = board.first_id + i;
    out.push_back(
        {board.family, id, board.tag_size_m, {world_board.rotation, transformed(world_board, board.center(id))}});
  }
  return out;
}

Result<Mounting> gravity_mounting(const GravityReading& gravity) {
  if (const Status s = check(gravity); !s.ok()) return s;
  Mounting out;
  out.world_probe.pose.rotation = turn_to(normalized(gravity.up_probe), {0, 1, 0});
  PoseCovariance& c = out.world_probe.covariance;
  // A turn about the world's X or Z tips up; one about Y cannot be felt.
  c[0][0] = c[2][2] = gravity.sigma_rad * gravity.sigma_rad;
  for (const std::size_t i : {1u, 3u, 4u, 5u}) c[i][i] = kInfinite;
  return out;
}

Result<Mounting> find_mounting(const RigParameters& rig, std::span<const TagInRoom> room, std::span<const SeenTag> seen,
                               const std::optional<GravityReading>& gravity, const MountingOptions& options) {
  if (const Status s = options.validate(); !s.ok()) return s;
  if (const Status s = check(room); !s.ok()) return s;
  if (gravity)
    if (const Status s = check(*gravity); !s.ok()) return s;
  std::vector<SeenQuad> known;
  std::vector<TagUse> uses;
  std::set<std::tuple<int, TagFamily, int>> met;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const SeenTag& s = seen[i];
    if (s.lens < 0 || static_cast<std::size_t>(s.lens) >= rig.lenses.size())
      return wrong(name_of(s) + ": the rig has " + std::to_string(rig.lenses.size()) + " lenses");
    uses.push_back({s.lens, s.tag.family, s.tag.id, 0, false, {}});
    const auto tag = std::find_if(room.begin(), room.end(),
                                  [&](const TagInRoom& t) { return t.family == s.tag.family && t.id == s.tag.id; });
    if (tag == room.end()) {
      uses.back().left_out = "it is not in the room's list";
      continue;
    }
    if (!met.emplace(s.lens, s.tag.family, s.tag.id).second)
      return wrong(name_of(s) + " is seen twice; a number may hang in the room only once");
    Result<SeenQuad> quad = directions_of(rig, s, *tag, options.model_error_px);
    if (!quad && quad.status().code() == StatusCode::invalid_argument) return quad.status();
    if (!quad) {
      uses.back().left_out = quad.status().message();
      continue;
    }
    quad->index = i;
    known.push_back(std::move(*quad));
  }
  if (known.empty()) {
    if (!gravity) {
      std::string why = "no tag is seen";
      for (const TagUse& use : uses)
        why = uses.size() == 1 || use.left_out != "it is not in the room's list"
                  ? use.left_out
                  : "none of the " + std::to_string(seen.size()) + " seen tags is in the room's list";
      return wrong(why + ", and no gravity is given");
    }
    Result<Mounting> up = gravity_mounting(*gravity);
    if (up) up->tags = std::move(uses);
    return up;
  }
  Quads all;
  for (const SeenQuad& quad : known) all.push_back(&quad);
  Solution best = agreed(all, gravity);
  if (!std::isfinite(best.cost)) return Status(StatusCode::internal, "mounting: the solver found no pose at all");
  const Quads used = agreeing(all, best.pose);
  if (2 * used.size() <= all.size()) {
    std::string names;
    for (const SeenQuad* quad : all)
      if (std::find(used.begin(), used.end(), quad) == used.end())
        names += (names.empty() ? "" : ", ") + name_of(seen[quad->index]);
    return Status(StatusCode::failed_precondition,
                  "the tags contradict each other (against the rest: " + names +
                      "); check that each hangs where the room's list says, in that size");
  }
  best = solved(used, gravity, best.pose, false);
  Solution other = solved(used, gravity, flipped(used, best.pose), false);
  if (other.cost < best.cost) std::swap(best, other);

  Mounting out;
  out.tags = std::move(uses);
  out.position_known = out.heading_known = true;
  out.world_probe.pose = best.pose;
  const double freedom = 8.0 * static_cast<double>(used.size()) + (gravity ? 2 : 0) - 6;
  out.chi_square = best.cost / freedom;
  const double scale = std::max(1.0, out.chi_square);
  // Scaled to ones in the diagonal first: radians and metres are not of a size.
  const Eigen::Matrix<double, 6, 1> unit = best.information.diagonal().cwiseSqrt().cwiseInverse();
  const Matrix6d scaled = unit.asDiagonal() * best.information * unit.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> parts(scaled);
  if (!unit.allFinite() || !(parts.eigenvalues()[0] > 1e-14))
    return Status(
        StatusCode::failed_precondition,
        "the corners seen do not determine a pose; move the probe so that it sees a tag larger or less on edge");
  const Matrix6d covariance =
      scale * (unit.asDiagonal() * parts.eigenvectors() * parts.eigenvalues().cwiseInverse().asDiagonal() *
               parts.eigenvectors().transpose() * unit.asDiagonal());
  for (int r = 0; r < 6; ++r)
    for (int c = 0; c < 6; ++c)
      out.world_probe.covariance[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)] = covariance(r, c);

  // The way from one to the other in standard deviations, against two runs into the same valley.
  const Quat between = other.pose.rotation * best.pose.rotation.inverse();
  const Vec3d axis{between.x, between.y, between.z};
  if (std::isfinite(other.cost) && length(axis) > 1e-3) {
    out.alternative = other.pose;
    out.alternative_excess = (other.cost - best.cost) / scale;
    out.ambiguous = out.alternative_excess < 2 * std::log(options.ambiguity_odds);
  }
  double squares = 0;
  for (const SeenQuad& quad : known) {
    TagUse& use = out.tags[quad.index];
    use.rms_px = rms_px(rig, seen[quad.index], *quad.tag, best.pose);
    use.used = std::find(used.begin(), used.end(), &quad) != used.end();
    if (use.used) {
      squares += use.rms_px * use.rms_px;
    } else {
      use.left_out = "it contradicts the others";
    }
  }
  out.rms_px = std::sqrt(squares / static_cast<double>(used.size()));
  return out;
}

}  // namespace lightwell
