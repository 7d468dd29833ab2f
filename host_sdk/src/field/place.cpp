#include "field/place.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <ceres/ceres.h>

namespace lightwell::field {
namespace {

constexpr double kOutlierThreshold = 25;  // Squared Mahalanobis distance of a direction.
constexpr double kInverseDistance = 10;   // Standard deviation of the prior on the inverse distance, 1/m.

/// Residual of a direction in its two tangents. light: offsets along u and v of the reference direction, inverse
/// distance from the anchor. pose: correction of the view, rotation (rad) and translation (m).
struct DirectionResidual {
  Vec3d reference, u, v, anchor;
  const Observation* observation;

  template <class T>
  bool operator()(const T* light, const T* pose, T* residual) const {
    const Vec3d& d = observation->direction;
    const Vec3d& o = observation->origin;
    const std::array<double, 3> m{reference.x, reference.y, reference.z}, mu{u.x, u.y, u.z}, mv{v.x, v.y, v.z},
        gap{anchor.x - o.x, anchor.y - o.y, anchor.z - o.z};
    std::array<T, 3> to;
    for (std::size_t i = 0; i < 3; ++i)
      to[i] = m[i] + light[0] * mu[i] + light[1] * mv[i] + light[2] * (gap[i] - pose[3 + i]);
    const T norm = ceres::sqrt(to[0] * to[0] + to[1] * to[1] + to[2] * to[2]);
    const std::array<T, 3> seen{d.x + pose[1] * d.z - pose[2] * d.y, d.y + pose[2] * d.x - pose[0] * d.z,
                                d.z + pose[0] * d.y - pose[1] * d.x};
    const auto [a, b] = tangent_basis(d);
    const std::array<T, 3> miss{to[0] / norm - seen[0], to[1] / norm - seen[1], to[2] / norm - seen[2]};
    residual[0] = (miss[0] * a.x + miss[1] * a.y + miss[2] * a.z) / observation->sigma_rad;
    residual[1] = (miss[0] * b.x + miss[1] * b.y + miss[2] * b.z) / observation->sigma_rad;
    return true;
  }
};

/// Residual of a measured distance, in its inverse.
struct DistanceResidual {
  Vec3d reference, u, v, anchor;
  const Observation* observation;

  template <class T>
  bool operator()(const T* light, T* residual) const {
    const Vec3d& o = observation->origin;
    const std::array<double, 3> m{reference.x, reference.y, reference.z}, mu{u.x, u.y, u.z}, mv{v.x, v.y, v.z},
        gap{anchor.x - o.x, anchor.y - o.y, anchor.z - o.z};
    T norm2(0);
    for (std::size_t i = 0; i < 3; ++i) {
      const T to = m[i] + light[0] * mu[i] + light[1] * mv[i] + light[2] * gap[i];
      norm2 += to * to;
    }
    const double distance = observation->distance_m;
    const double sigma = std::max(observation->distance_sigma_m, 1e-3) / (distance * distance);
    residual[0] = (light[2] / ceres::sqrt(norm2) - 1 / distance) / sigma;
    return true;
  }
};

struct PosePrior {
  std::array<double, 6> sigma;
  template <class T>
  bool operator()(const T* pose, T* residual) const {
    for (std::size_t i = 0; i < 6; ++i) residual[i] = pose[i] / sigma[i];
    return true;
  }
};

struct InverseDistancePrior {
  template <class T>
  bool operator()(const T* light, T* residual) const {
    residual[0] = light[2] / kInverseDistance;
    return true;
  }
};

struct LightState {
  std::vector<std::size_t> members;
  Vec3d anchor, reference, u, v;
  std::array<double, 3> value{};
};

LightState initial(std::span<const Observation> observations, std::vector<std::size_t> members) {
  LightState out;
  out.members = std::move(members);
  const Observation& best = observations[*std::ranges::min_element(
      out.members, {}, [&](std::size_t i) { return observations[i].sigma_rad; })];
  out.anchor = best.origin;
  const auto point = triangulate(observations, out.members);
  out.reference = point ? normalized(point->point - out.anchor) : best.direction;
  out.value[2] = point ? 1 / length(point->point - out.anchor) : 0;
  const auto [u, v] = tangent_basis(out.reference);
  out.u = u;
  out.v = v;
  return out;
}

class Bundle {
 public:
  Bundle(std::span<const ProbeView> views, std::span<const Observation> observations)
      : observations_(observations), views_(views), poses_(views.size()) {}

  void add(std::vector<std::size_t> members) { lights_.push_back(initial(observations_, std::move(members))); }

  /// Solves. False if Ceres finds no solution.
  bool solve() {
    ceres::Problem::Options keep;
    problem_.emplace(keep);
    std::vector<bool> added(views_.size());
    for (LightState& light : lights_) {
      for (const std::size_t m : light.members) {
        const Observation& o = observations_[m];
        problem_->AddResidualBlock(new ceres::AutoDiffCostFunction<DirectionResidual, 2, 3, 6>(
                                       new DirectionResidual{light.reference, light.u, light.v, light.anchor, &o}),
                                   new ceres::HuberLoss(2), light.value.data(), poses_[o.view].data());
        if (o.distance_m > 0)
          problem_->AddResidualBlock(new ceres::AutoDiffCostFunction<DistanceResidual, 1, 3>(
                                         new DistanceResidual{light.reference, light.u, light.v, light.anchor, &o}),
                                     nullptr, light.value.data());
        if (added[o.view]) continue;
        added[o.view] = true;
        problem_->AddResidualBlock(
            new ceres::AutoDiffCostFunction<PosePrior, 6, 6>(new PosePrior{views_[o.view].pose_sigma}), nullptr,
            poses_[o.view].data());
      }
      problem_->AddResidualBlock(new ceres::AutoDiffCostFunction<InverseDistancePrior, 1, 3>(new InverseDistancePrior),
                                 nullptr, light.value.data());
    }
    ceres::Solver::Options options;
    options.linear_solver_type = lights_.size() < 60 ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
    options.max_num_iterations = 30;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &*problem_, &summary);
    return summary.IsSolutionUsable();
  }

  /// Removes what does not fit. True if something was removed.
  bool remove_outliers() {
    bool removed = false;
    for (LightState& light : lights_) {
      const auto misfit = [&](std::size_t m) {
        const Observation& o = observations_[m];
        std::array<double, 2> r{};
        DirectionResidual{light.reference, light.u, light.v, light.anchor, &o}(light.value.data(),
                                                                               poses_[o.view].data(), r.data());
        return r[0] * r[0] + r[1] * r[1];
      };
      // The worst one alone: it bends the others towards itself.
      const auto worst = std::ranges::max_element(light.members, {}, misfit);
      if (light.members.size() < 2 || misfit(*worst) <= kOutlierThreshold) continue;
      light.members.erase(worst);
      removed = true;
    }
    const auto lost = [&](const LightState& light) {
      return light.members.empty() || (light.members.size() == 1 && !(observations_[light.members[0]].distance_m > 0));
    };
    std::erase_if(lights_, lost);
    return removed;
  }

  /// The lights with covariances; one whose covariance Ceres cannot compute is left out.
  std::vector<Placed> results() {
    std::vector<Placed> out;
    ceres::Covariance::Options options;
    options.algorithm_type = ceres::SPARSE_QR;
    ceres::Covariance covariance(options);
    std::vector<std::pair<const double*, const double*>> blocks;
    for (const LightState& light : lights_) blocks.emplace_back(light.value.data(), light.value.data());
    if (lights_.empty() || !covariance.Compute(blocks, &*problem_)) return out;
    for (const LightState& light : lights_) {
      std::array<double, 9> c{};
      if (covariance.GetCovarianceBlock(light.value.data(), light.value.data(), c.data()))
        out.push_back(result(light, c));
    }
    return out;
  }

 private:
  [[nodiscard]] Placed result(const LightState& light, const std::array<double, 9>& c) const {
    Placed out;
    out.members = light.members;
    const Vec3d m = light.reference + light.u * light.value[0] + light.v * light.value[1];
    const double rho = light.value[2], sigma = std::sqrt(std::max(c[8], 0.0));
    out.distant = !(rho > 2 * sigma);
    double radius = 0;
    for (const std::size_t i : light.members)
      radius += observations_[i].radius_rad / static_cast<double>(light.members.size());
    if (out.distant) {
      out.direction = normalized(m);
      out.direction_sigma_rad = std::sqrt(std::max((c[0] + c[4]) / 2, 0.0));
      out.parallax_sigma = std::max(sigma, std::abs(rho));
      out.radius = radius;
      return out;
    }
    out.position = light.anchor + m * (1 / rho);
    const std::array<Vec3d, 3> j{light.u * (1 / rho), light.v * (1 / rho), m * (-1 / (rho * rho))};
    const auto element = [&](double Vec3d::*a, double Vec3d::*b) {
      double sum = 0;
      for (std::size_t r = 0; r < 3; ++r)
        for (std::size_t k = 0; k < 3; ++k) sum += j[r].*a * c[3 * r + k] * (j[k].*b);
      return sum;
    };
    out.covariance = {element(&Vec3d::x, &Vec3d::x), element(&Vec3d::x, &Vec3d::y), element(&Vec3d::x, &Vec3d::z),
                      element(&Vec3d::y, &Vec3d::y), element(&Vec3d::y, &Vec3d::z), element(&Vec3d::z, &Vec3d::z)};
    out.radius = 0;
    for (const std::size_t i : light.members) {
      const Observation& o = observations_[i];
      out.radius +=
          std::sin(o.radius_rad) * length(out.position - o.origin) / static_cast<double>(light.members.size());
    }
    return out;
  }

  std::span<const Observation> observations_;
  std::span<const ProbeView> views_;
  std::vector<std::array<double, 6>> poses_;
  std::vector<LightState> lights_;
  std::optional<ceres::Problem> problem_;
};

}  // namespace

std::vector<Placed> place_lights(std::span<const ProbeView> views, std::span<const Observation> observations,
                                 std::span<const std::vector<std::size_t>> groups) {
  constexpr int kRounds = 4;
  Bundle bundle(views, observations);
  for (const std::vector<std::size_t>& group : groups) bundle.add(group);
  for (int round = 0;; ++round) {
    if (!bundle.solve()) return {};
    if (round == kRounds || !bundle.remove_outliers()) break;
  }
  return bundle.results();
}

}  // namespace lightwell::field
