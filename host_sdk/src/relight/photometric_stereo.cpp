// Normals and albedo from photographs under known lights.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Dense>

#include <lightwell/relight_capture.hpp>

#include "relight/emitter.hpp"
#include "relight/gather.hpp"
#include "relight/subject.hpp"

namespace lightwell {
namespace relight {
namespace {

constexpr int kIterations = 12;
/// Rays to lights start this far in front of the surface, so that noise of the depth throws no shadows.
constexpr float kShadowOffset_px = 2;
/// Hypotheses are solved from triples of this many of the brightest observations: most lights may be behind the
/// surface.
constexpr std::size_t kHypothesisLights = 8;
/// Triples whose directions span less volume are left out.
constexpr double kMinVolume = 0.05;
/// Cosine of the largest angle between a normal and that of the geometry, 60 degrees: beyond, few lights that are all
/// in shadow or in highlights have misled it.
constexpr double kMinAgreement = 0.5;
/// Lights nearer to the horizon say little of the albedo.
constexpr double kMinCosine = 0.1;
/// Residuals count up to this share of the brightest of them.
constexpr double kMaxResidual = 0.3;
/// Smallest scale of the residuals relative to the albedo: below, there is noise alone.
constexpr double kMinScale = 0.01;
/// Smallest eigenvalue of the weighted directions' moments, of one light's weight: three lights in one plane say
/// nothing.
constexpr double kMinSpread = 0.02;

/// What one light shows at one pixel: pi L / E, the albedo times the cosine where the surface is matte and lit.
struct Observation {
  Eigen::Vector3d towards;
  std::array<double, 3> rgb{};
  double grey = 0;
  double weight = 0;
};

Eigen::Vector3d eigen(Vec3f v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}

/// Reorders the values, of which there must be one.
double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

class PixelSolver {
 public:
  std::vector<Observation>& observations() { return observations_; }

  /// Albedo times normal of the grey values. `facet`: normal of the geometry.
  [[nodiscard]] std::optional<Eigen::Vector3d> solve(const Eigen::Vector3d& facet) {
    const std::optional<Eigen::Vector3d> geometric = with_normal(facet);
    std::optional<Eigen::Vector3d> b = best_hypothesis(facet, geometric);
    for (int i = 0; b && i < kIterations; ++i) {
      reweight(*b);
      b = least_squares();
    }
    if (b && b->dot(facet) > kMinAgreement * b->norm()) return b;
    if (geometric) reweight(*geometric);
    return geometric;
  }

  /// With the weights of the last solve().
  [[nodiscard]] Albedo albedo(const Eigen::Vector3d& normal) const {
    std::array<double, 3> sum{};
    double squares = 0;
    for (const Observation& o : observations_) {
      const double cosine = normal.dot(o.towards);
      if (!(cosine > 0)) continue;
      for (std::size_t c = 0; c < 3; ++c) sum[c] += o.weight * o.rgb[c] * cosine;
      squares += o.weight * cosine * cosine;
    }
    const auto share = [&](double v) {
      return squares > 0 ? static_cast<float>(std::clamp(v / squares, 0.0, 1.0)) : 0;
    };
    return {share(sum[0]), share(sum[1]), share(sum[2])};
  }

 private:
  /// The surface with that normal: the median of what the lights in front of it say of the albedo.
  [[nodiscard]] std::optional<Eigen::Vector3d> with_normal(const Eigen::Vector3d& normal) {
    residuals_.clear();
    for (const Observation& o : observations_)
      if (const double cosine = normal.dot(o.towards); cosine > kMinCosine && o.grey > 0)
        residuals_.push_back(o.grey / cosine);
    if (residuals_.empty()) return std::nullopt;
    return median(residuals_) * normal;
  }

  [[nodiscard]] std::optional<Eigen::Vector3d> best_hypothesis(const Eigen::Vector3d& facet,
                                                               const std::optional<Eigen::Vector3d>& geometric) {
    const std::size_t count = std::min(kHypothesisLights, observations_.size());
    std::partial_sort(observations_.begin(), observations_.begin() + static_cast<std::ptrdiff_t>(count),
                      observations_.end(), [](const Observation& a, const Observation& b) { return a.grey > b.grey; });
    std::optional<Eigen::Vector3d> best = geometric;
    double least = std::numeric_limits<double>::infinity();
    if (geometric) least = residual_sum(*geometric, kMaxResidual * observations_[0].grey);
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t j = i + 1; j < count; ++j)
        for (std::size_t k = j + 1; k < count && observations_[k].grey > 0; ++k) {
          Eigen::Matrix3d rows;
          rows << observations_[i].towards.transpose(), observations_[j].towards.transpose(),
              observations_[k].towards.transpose();
          if (std::abs(rows.determinant()) < kMinVolume) continue;
          const Eigen::Vector3d b =
              rows.inverse() * Eigen::Vector3d(observations_[i].grey, observations_[j].grey, observations_[k].grey);
          if (!(b.dot(facet) > kMinAgreement * b.norm())) continue;
          const double sum = residual_sum(b, kMaxResidual * observations_[0].grey);
          if (sum < least) least = sum, best = b;
        }
    return best;
  }

  [[nodiscard]] double residual_sum(const Eigen::Vector3d& b, double most) const {
    double sum = 0;
    for (const Observation& o : observations_)
      sum += std::min(std::abs(o.grey - std::max(0.0, b.dot(o.towards))), most);
    return sum;
  }

  [[nodiscard]] std::optional<Eigen::Vector3d> least_squares() const {
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const Observation& o : observations_) {
      moments += o.weight * o.towards * o.towards.transpose();
      right += o.weight * o.grey * o.towards;
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spread(moments);
    if (!(spread.eigenvalues()[0] > kMinSpread)) return std::nullopt;
    return moments.ldlt().solve(right);
  }

  void reweight(const Eigen::Vector3d& b) {
    residuals_.clear();
    for (const Observation& o : observations_)
      if (b.dot(o.towards) > 0 && o.grey > 0) residuals_.push_back(std::abs(o.grey - b.dot(o.towards)));
    if (residuals_.empty()) return;
    // 1.4826: from the median of absolute values to the standard deviation of a normal distribution.
    const double scale = std::max(1.4826 * median(residuals_), kMinScale * b.norm());
    for (Observation& o : observations_) {
      const double model = b.dot(o.towards), r = (o.grey - model) / scale;
      o.weight = model > 0 ? 1 / (1 + r * r) : 0;
    }
  }

  std::vector<Observation> observations_;
  std::vector<double> residuals_;
};

/// `indirect` is subtracted from the photographs; empty: nothing.
PhotometricSurface estimate(const SubjectData& subject, const RayScene& rays, std::span<const BasisLight> basis,
                            BasisPictures photographs, const std::vector<std::vector<Radiance>>& indirect) {
  const std::size_t pixels = subject.depth.size();
  PhotometricSurface out;
  out.normals.assign(pixels, {});
  out.albedo.assign(pixels, {});
  PixelSolver solver;
  for (std::size_t p = 0; p < pixels; ++p) {
    std::optional<Eigen::Vector3d> b;
    if (subject.has_geometry(p)) {
      solver.observations().clear();
      const Vec3f origin = subject.positions[p] + subject.facets[p] * (kShadowOffset_px * subject.pixel_size(p));
      for (std::size_t i = 0; i < basis.size(); ++i) {
        const Incident light = incident(basis[i], subject.positions[p]);
        if (rays.occluded(origin, light.towards, light.distance)) continue;
        Observation o{eigen(light.towards)};
        for (int c = 0; c < 3; ++c) {
          const float radiance = photographs[i][p][c] - (indirect.empty() ? 0.0F : indirect[i][p][c]);
          if (!(radiance > 0 && std::isfinite(radiance) && light.irradiance[c] > 0)) continue;
          o.rgb[static_cast<std::size_t>(c)] =
              std::numbers::pi * static_cast<double>(radiance) / static_cast<double>(light.irradiance[c]);
        }
        o.grey = (o.rgb[0] + o.rgb[1] + o.rgb[2]) / 3;
        solver.observations().push_back(o);
      }
      b = solver.solve(eigen(subject.facets[p]));
    }
    if (!b) {
      ++out.without_answer;
      continue;
    }
    const Eigen::Vector3d normal = b->normalized();
    out.normals[p] = vec_cast<float>(Vec3d{normal.x(), normal.y(), normal.z()});
    out.albedo[p] = solver.albedo(normal);
  }
  return out;
}

}  // namespace
}  // namespace relight

Status PhotometricStereoOptions::validate() const {
  if (interreflection_rounds < 0 || interreflection_rounds > 8)
    return invalid_argument("photometric stereo: interreflection_rounds is " + std::to_string(interreflection_rounds) +
                            ", it must be 0 to 8");
  return indirect.validate();
}

Result<PhotometricSurface> estimate_surface(const RelightSubject& subject, std::span<const BasisLight> basis,
                                            BasisPictures photographs, const PhotometricStereoOptions& options) {
  if (Status status = options.validate(); !status.ok()) return status;
  if (Status status = relight::validate(basis, {}); !status.ok()) return status;
  if (photographs.size() != basis.size())
    return invalid_argument("there are " + std::to_string(photographs.size()) + " photographs for " +
                            std::to_string(basis.size()) + " basis lights");
  for (std::size_t i = 0; i < photographs.size(); ++i)
    if (Status status =
            relight::check_size("photograph " + std::to_string(i), photographs[i].size(), subject.camera().pixels());
        !status.ok())
      return status;
  const auto rays = subject.data().surface->rays();
  if (!rays) return rays.status();
  PhotometricSurface out = relight::estimate(subject.data(), **rays, basis, photographs, {});
  for (int round = 0; round < options.interreflection_rounds; ++round) {
    const auto known = subject.with({out.albedo, out.normals});
    if (!known) return known.status();
    const auto gather = relight::GatherRays::cast(known->data(), **rays, options.indirect);
    if (!gather) return gather.status();
    std::vector<std::vector<Radiance>> indirect(basis.size());
    for (std::size_t i = 0; i < basis.size(); ++i)
      gather->simulate(relight::DirectLight(known->data(), **rays, basis[i]), indirect[i]);
    out = relight::estimate(subject.data(), **rays, basis, photographs, indirect);
  }
  return out;
}

}  // namespace lightwell
