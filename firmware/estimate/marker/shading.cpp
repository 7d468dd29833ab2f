#include "estimate/marker/shading.hpp"

#include <cstddef>
#include <limits>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include <lightwell/quantile.hpp>

namespace lightwell::marker {
namespace {

/// A patch of the ground plane that is not seen gets the mean radiance of this many nearest samples: one alone would
/// have its texture and its noise.
constexpr std::size_t kNearestSamples = 6;
/// Beyond the samples the plane is divided by azimuth and by distance, in equal ratios: to twice their reach.
constexpr int kAzimuths = 24, kDistances = 2;
constexpr double kDistanceRatio = 1.4142;
/// Standard deviation of the subtracted irradiance, relative to it.
constexpr double kReflectionRelativeSigma = 0.2;

struct GroundPatch {
  Vec3d position;
  double area = 0;
  Rgb radiance;
};

/// Mean colour of the samples that are nearest to a point of the plane.
Rgb color_near(Vec3d point, const std::vector<GroundSample>& samples) {
  std::vector<std::pair<double, const GroundSample*>> by_distance;
  for (const GroundSample& s : samples) by_distance.emplace_back(length(s.position - point), &s);
  const std::size_t count = std::min(kNearestSamples, by_distance.size());
  std::ranges::nth_element(by_distance, by_distance.begin() + static_cast<std::ptrdiff_t>(count - 1));
  Rgb out{};
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t c = 0; c < 3; ++c) out[c] += by_distance[i].second->color[c] / static_cast<double>(count);
  return out;
}

/// The ground plane around the body, what is not seen filled in.
struct GroundGrid {
  std::vector<GroundPatch> patches;
  Rgb beyond{};  ///< Mean radiance of the outermost ones: of the plane beyond them.
};

GroundGrid fill_ground_grid(const GroundPlane& ground) {
  const auto [u, v] = tangent_basis(ground.normal);
  const Vec3d below_body = ground.normal * dot(ground.point, ground.normal);
  const double step = ground.step_m;
  double reach = 0;
  for (const GroundSample& s : ground.samples) reach = std::max(reach, length(s.position - below_body));
  const int across = static_cast<int>(reach / step + 0.5);
  const int edge = 2 * across + 1;
  std::vector<const GroundSample*> at(static_cast<std::size_t>(edge * edge), nullptr);
  for (const GroundSample& s : ground.samples) {
    const Vec3d from = s.position - below_body;
    const int column = static_cast<int>(std::lround(dot(from, u) / step)) + across,
              row = static_cast<int>(std::lround(dot(from, v) / step)) + across;
    if (column >= 0 && row >= 0 && column < edge && row < edge) at[static_cast<std::size_t>(row * edge + column)] = &s;
  }
  GroundGrid out;
  const double inner = reach + step / 2;
  for (int row = 0; row < edge; ++row)
    for (int column = 0; column < edge; ++column) {
      const double x = (column - across) * step, y = (row - across) * step;
      if (std::hypot(x, y) > inner) continue;
      const Vec3d position = below_body + u * x + v * y;
      const GroundSample* observed = at[static_cast<std::size_t>(row * edge + column)];
      out.patches.push_back(
          {position, step * step, observed != nullptr ? observed->color : color_near(position, ground.samples)});
    }
  double from = inner;
  for (int ring = 0; ring < kDistances; ++ring, from *= kDistanceRatio) {
    const double to = from * kDistanceRatio, middle = std::sqrt(from * to);
    for (int k = 0; k < kAzimuths; ++k) {
      const double a = 2 * std::numbers::pi * k / kAzimuths;
      const Vec3d position = below_body + u * (middle * std::cos(a)) + v * (middle * std::sin(a));
      const GroundPatch& patch = out.patches.emplace_back(GroundPatch{
          position, std::numbers::pi * (to * to - from * from) / kAzimuths, color_near(position, ground.samples)});
      if (ring == kDistances - 1)
        for (std::size_t c = 0; c < 3; ++c) out.beyond[c] += patch.radiance[c] / kAzimuths;
    }
  }
  return out;
}

/// Largest residual of a sample relative to the median irradiance of its face, unless four robust standard deviations
/// of the face's residuals are more; four sigmas of the sample are added.
constexpr double kMaxPlaneDeviation = 0.03;

/// Width of the edge of a sphere's shadow relative to its radius: patches of a ball's sheet are about as wide.
constexpr double kSphereShadowWidth = 0.6;

/// Smallest cosine of the angle between down and the normal of a face on which the body may stand.
constexpr double kMinDownCosine = 0.64;
/// Where down is not known: distribution of the camera's roll and of its elevation above the plane, and the largest
/// squared Mahalanobis distance (the 99.73 % quantile of chi square with two degrees of freedom).
constexpr double kDegree = std::numbers::pi / 180;
constexpr double kRollSigma_rad = 10 * kDegree;
constexpr double kMeanElevation_rad = 40 * kDegree, kElevationSigma_rad = 20 * kDegree;
constexpr double kMaxSquaredMahalanobis = 11.83;
/// Smallest sine of the angle between the optical axis and the probe's +Y for which +Y determines the roll.
constexpr double kMinAxisSine = 0.1;
/// Smallest sine of the lens's elevation above the ground plane.
constexpr double kMinLensElevation = 0.12;
/// Number of points that represent the hull of a ball.
constexpr int kBallPoints = 48;

}  // namespace

std::size_t strongest(const LightModel& model) {
  std::size_t out = 0;
  for (std::size_t k = 1; k < model.lights.size(); ++k)
    if (luminance(model.lights[k].irradiance) > luminance(model.lights[out].irradiance)) out = k;
  return out;
}

double sphere_visibility(Vec3d direction, double inverse_distance, const SurfaceSample& sample) {
  if (!(sample.occluder_radius > 0)) return 1;
  const Vec3d to_light = normalized(direction - sample.position * inverse_distance);
  // Of the ray from the sample to the light: distance from the sample to the point nearest to the origin.
  const double along = -dot(sample.position, to_light);
  if (!(along > 0)) return 1;
  const double miss = length(sample.position + to_light * along) / sample.occluder_radius - 1;
  const double step = std::clamp(miss / kSphereShadowWidth + 0.5, 0.0, 1.0);
  return step * step * (3 - 2 * step);
}

double relative_irradiance(Vec3d direction, double inverse_distance, const SurfaceSample& sample) {
  return relative_irradiance(direction, inverse_distance, sample.position, sample.normal) *
         sphere_visibility(direction, inverse_distance, sample);
}

void estimate_ground_reflection(Shading& shading) {
  if (!shading.ground || shading.ground->samples.empty()) return;
  const GroundPlane& ground = *shading.ground;
  const GroundGrid grid = fill_ground_grid(ground);
  for (SurfaceSample& s : shading.samples) {
    s.from_ground = {};
    // An infinite plane of radiance 1 gives this irradiance.
    double beyond = std::numbers::pi * (1 - dot(s.normal, ground.normal)) / 2;
    for (const GroundPatch& patch : grid.patches) {
      const Vec3d to_patch = patch.position - s.position;
      const double squared = dot(to_patch, to_patch);
      const double along_ground_normal = -dot(to_patch, ground.normal), along_sample_normal = dot(to_patch, s.normal);
      if (!(along_ground_normal > 0) || !(along_sample_normal > 0)) continue;
      // Form factor from a small surface to a disc of the patch's area (Cohen & Wallace 1993, "Radiosity and realistic
      // image synthesis"): finite at small distances.
      const double factor = along_ground_normal * along_sample_normal /
                            (squared * (squared + patch.area / std::numbers::pi)) * patch.area;
      for (std::size_t c = 0; c < 3; ++c) s.from_ground[c] += patch.radiance[c] * factor;
      beyond -= factor;
    }
    for (std::size_t c = 0; c < 3; ++c) s.from_ground[c] += std::max(0.0, beyond) * grid.beyond[c];
  }
}

void subtract_ground_reflection(Shading& shading) {
  for (SurfaceSample& s : shading.samples) {
    for (std::size_t c = 0; c < 3; ++c) {
      s.irradiance[c] = std::max(0.0, s.irradiance[c] - s.from_ground[c]);
      s.sigma[c] = std::hypot(s.sigma[c], kReflectionRelativeSigma * s.from_ground[c]);
    }
    s.from_ground = {};
  }
}

int remove_occluded_samples(Shading& shading) {
  int outliers = 0;
  std::vector<SurfaceSample> inliers;
  for (std::size_t begin = 0; begin < shading.samples.size();) {
    std::size_t end = begin;
    while (end < shading.samples.size() && shading.samples[end].surface == shading.samples[begin].surface) ++end;
    const std::span<const SurfaceSample> face(shading.samples.data() + begin, end - begin);
    begin = end;
    const Vec3d normal = face[0].normal;
    const bool flat =
        std::all_of(face.begin(), face.end(), [&](const SurfaceSample& s) { return dot(s.normal, normal) > 0.9999; });
    if (!flat || face.size() < 6) {
      inliers.insert(inliers.end(), face.begin(), face.end());
      continue;
    }
    const auto [u, v] = tangent_basis(normal);
    struct Point {
      double u, v, value;
    };
    std::vector<Point> points;
    for (const SurfaceSample& s : face)
      points.push_back(
          {dot(s.position, u), dot(s.position, v), (s.irradiance[0] + s.irradiance[1] + s.irradiance[2]) / 3});
    std::vector<double> residuals(points.size()), best_residuals(points.size(), 0), sorted;
    double least_median = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < points.size(); ++i)
      for (std::size_t j = i + 1; j < points.size(); ++j)
        for (std::size_t k = j + 1; k < points.size(); ++k) {
          const Point &a = points[i], &b = points[j], &c = points[k];
          const double bu = b.u - a.u, bv = b.v - a.v, cu = c.u - a.u, cv = c.v - a.v, det = bu * cv - bv * cu;
          if (std::abs(det) < 0.1 * (bu * bu + bv * bv)) continue;
          const double gu = ((b.value - a.value) * cv - (c.value - a.value) * bv) / det;
          const double gv = ((c.value - a.value) * bu - (b.value - a.value) * cu) / det;
          for (std::size_t n = 0; n < points.size(); ++n)
            residuals[n] = std::abs(points[n].value - a.value - gu * (points[n].u - a.u) - gv * (points[n].v - a.v));
          sorted = residuals;
          const double typical = upper_quantile(sorted, 0.5);
          if (typical < least_median) least_median = typical, best_residuals = residuals;
        }
    sorted.clear();
    for (const Point& p : points) sorted.push_back(p.value);
    const double bound =
        std::max(kMaxPlaneDeviation * std::abs(upper_quantile(sorted, 0.5)), 4 * 1.4826 * least_median);
    for (std::size_t n = 0; n < points.size(); ++n)
      if (!(best_residuals[n] > bound + 4 * (face[n].sigma[0] + face[n].sigma[1] + face[n].sigma[2]) / 3))
        inliers.push_back(face[n]);
      else
        ++outliers;
  }
  shading.samples = std::move(inliers);
  return outliers;
}

PosedBody::PosedBody(const MarkerBody& body, const LensParameters& lens, const CameraModel& model,
                     const Pose& probe_body)
    : body_(body),
      model_(model),
      probe_body_(probe_body),
      lens_probe_(inverse(lens.pose_cv)),
      center_(body.ball ? body.ball->center : Vec3d{}),
      origin_(transformed(probe_body, center_)),
      lens_(lens.pose_cv.translation - origin_),
      axis_(rotate(lens.pose_cv.rotation, Vec3d{0, 0, 1})) {
  const Vec3d right = cross(axis_, Vec3d{0, 1, 0});
  image_right_ = length(right) > kMinAxisSine ? normalized(right) : rotate(lens.pose_cv.rotation, Vec3d{1, 0, 0});
  image_up_ = cross(image_right_, axis_);
  if (body.ball) {
    for (const Vec3d& direction : fibonacci_directions(kBallPoints)) hull_.push_back(direction * body.ball->radius_m);
    return;
  }
  for (const MarkerFace& face : body.faces)
    for (const FacePoint& p : face.outline) hull_.push_back(point_of(face, p));
}

const MarkerFace* PosedBody::face_below(std::optional<Vec3d> up) const {
  if (body_.ball) return &body_.faces.front();
  const MarkerFace* out = nullptr;
  // Cameras are level as a device, or level as the body is seen: the smaller roll counts. Where the body is beside the
  // optical axis, both differ (of a steep view by 30 degrees and more).
  const auto roll_of = [&](Vec3d at_axis) {
    return std::abs(std::atan2(dot(at_axis, image_right_), dot(at_axis, image_up_)));
  };
  const Quat sight_axis = rotation_between(normalized(-lens_), axis_);
  double least = up ? -kMinDownCosine : kMaxSquaredMahalanobis;
  for (const MarkerFace& face : body_.faces) {
    const Vec3d normal = normal_of(face);
    double cost = 0;
    if (up) {
      cost = dot(normal, *up);
    } else {
      // Twice the negative logarithm of the likelihood, up to a constant, if up were the face's inward normal.
      const double roll = std::min(roll_of(-normal), roll_of(rotate(sight_axis, -normal)));
      const double elevation = std::asin(std::clamp(dot(-normal, normalized(lens_)), -1.0, 1.0));
      cost = std::pow(roll / kRollSigma_rad, 2) + std::pow((elevation - kMeanElevation_rad) / kElevationSigma_rad, 2);
    }
    if (cost < least) least = cost, out = &face;
  }
  return out;
}

std::optional<GroundPlane> PosedBody::ground_plane(std::optional<Vec3d> up) const {
  const MarkerFace* lowest = face_below(up);
  if (lowest == nullptr) return std::nullopt;
  GroundPlane out;
  out.point = point_of(*lowest, {0, 0});
  out.normal = body_.ball ? normal_of(*lowest) : -normal_of(*lowest);
  const Vec3d to_lens = lens_ - out.point;
  if (!(dot(to_lens, out.normal) > kMinLensElevation * length(to_lens))) return std::nullopt;
  return out;
}

}  // namespace lightwell::marker
