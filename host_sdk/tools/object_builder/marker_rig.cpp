#include "marker_rig.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <string>

#include <opencv2/core.hpp>

#include <lightwell/text.hpp>

namespace lightwell::tool {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
/// A marker's pose is exact to a few tenths of a degree, its light to a few degrees.
constexpr double kMaxAxisError = 3 * kDegree, kMaxLightSpread = 15 * kDegree, kMinTurn = 1 * kDegree,
                 kMinParallax = 1 * kDegree;
/// A light this close would be in the picture, m.
constexpr double kNearest = 0.2;

Status wrong(std::string what) { return {StatusCode::failed_precondition, std::move(what)}; }

std::string view_name(std::size_t view) { return "view " + std::to_string(view); }

/// Mean of poses that differ little.
std::optional<Pose> mean_pose(const std::vector<std::optional<Descriptor>>& estimates) {
  Quat sum{0, 0, 0, 0}, first;
  Vec3d translation;
  int count = 0;
  for (const auto& estimate : estimates) {
    if (!estimate) continue;
    const Pose& pose = estimate->T_probe_origin;
    const Quat& q = pose.rotation;
    if (count == 0) first = q;
    const double sign = q.x * first.x + q.y * first.y + q.z * first.z + q.w * first.w < 0 ? -1 : 1;
    sum = {sum.x + sign * q.x, sum.y + sign * q.y, sum.z + sign * q.z, sum.w + sign * q.w};
    translation += pose.translation;
    ++count;
  }
  if (count == 0) return std::nullopt;
  return Pose{sum.normalized(), translation * (1.0 / count)};
}

Vec3d imaginary(Quat q) { return {q.x, q.y, q.z}; }

/// The common axis of rotations, upwards; zero where none of them turns. Their imaginary parts are sin(angle / 2) times
/// the axis, with either sign.
Vec3d common_axis(const std::vector<Quat>& rotations) {
  const auto widest = std::ranges::max_element(rotations, {}, [](Quat q) { return length(imaginary(q)); });
  if (length(imaginary(*widest)) < std::sin(kMinTurn / 2)) return {};
  Vec3d sum;
  for (const Quat& q : rotations) {
    const Vec3d part = imaginary(q);
    sum += dot(part, imaginary(*widest)) < 0 ? -part : part;
  }
  return normalized(sum.y < 0 ? -sum : sum);
}

/// The point of the turntable's axis through which all positions turn, in the plane across it: least squares of
/// (1 - e^(i turn)) c = p - e^(i turn) p_0 over the views.
Vec3d center_of(const std::vector<Pose>& poses, const std::vector<double>& turns, Vec3d axis) {
  const Vec3d u = normalized(std::abs(axis.x) < 0.9 ? cross(axis, Vec3d{1, 0, 0}) : cross(axis, Vec3d{0, 0, 1}));
  const Vec3d v = cross(axis, u);
  const auto flat = [&](Vec3d p) { return std::complex<double>(dot(p, u), dot(p, v)); };
  const std::complex<double> start = flat(poses[0].translation);
  std::complex<double> sum;
  double weights = 0;
  for (std::size_t k = 1; k < poses.size(); ++k) {
    const std::complex<double> turn = std::polar(1.0, turns[k]), factor = 1.0 - turn;
    sum += std::conj(factor) * (flat(poses[k].translation) - turn * start);
    weights += std::norm(factor);
  }
  const std::complex<double> c = sum / weights;
  return u * c.real() + v * c.imag();
}

/// Where a view shows a light: from the marker, in the frame of the rig.
struct Ray {
  Vec3d from, direction;
  double distance_m = 0;  ///< 0: not known.
};

/// The point with the least sum of squared distances from the rays. Errors along parallel rays are large, but turn the
/// direction from the origin little. Rays that are parallel within their errors, or do not meet before the marker: the
/// largest distance that one knows, else kDistant.
Vec3d light_position(const std::vector<Ray>& rays) {
  constexpr double kDistant = 100;
  cv::Matx33d sum = cv::Matx33d::zeros();
  cv::Vec3d right_side;
  Vec3d mean, start;
  double distance = 0;
  for (const Ray& ray : rays) {
    const cv::Vec3d d(ray.direction.x, ray.direction.y, ray.direction.z);
    const cv::Matx33d across = cv::Matx33d::eye() - d * d.t();
    sum += across;
    right_side += across * cv::Vec3d(ray.from.x, ray.from.y, ray.from.z);
    mean += ray.direction;
    start += ray.from * (1.0 / static_cast<double>(rays.size()));
    distance = std::max(distance, ray.distance_m);
  }
  mean = normalized(mean);
  double parallax = 0;
  for (const Ray& ray : rays) parallax = std::max(parallax, angle_between(ray.direction, mean));
  cv::Vec3d meeting;
  if (parallax > kMinParallax && cv::solve(sum, right_side, meeting, cv::DECOMP_CHOLESKY)) {
    const Vec3d point{meeting[0], meeting[1], meeting[2]};
    if (const double along = dot(point - start, mean); along > kNearest && along < kDistant) return point;
  }
  return start + mean * (distance > 0 ? distance : kDistant);
}

}  // namespace

Result<MarkerRig> rig_of(const MarkerEstimates& estimates, double half_field_tan) {
  if (!(half_field_tan > 0) || !std::isfinite(half_field_tan))
    return invalid_argument("the field of view must be above 0");
  std::vector<Pose> poses;
  for (std::size_t v = 0; v < estimates.size(); ++v) {
    const auto pose = mean_pose(estimates[v]);
    if (!pose) return wrong("the marker was found in no photograph of " + view_name(v));
    poses.push_back(*pose);
  }
  if (poses.size() < 2) return wrong("one view does not show the axis of the turntable: photograph a second turn");
  std::vector<Quat> rotations;
  for (const Pose& pose : poses) rotations.push_back((pose.rotation * poses[0].rotation.inverse()).normalized());
  const Vec3d axis = common_axis(rotations);
  if (axis == Vec3d{}) return wrong("the marker has the same turn in all views: it must turn with the object");

  MarkerRig out;
  std::vector<double> turns;
  for (std::size_t v = 0; v < rotations.size(); ++v) {
    const Quat& q = rotations[v];
    const double about = dot(imaginary(q), axis);
    turns.push_back(std::remainder(2 * std::atan2(about, q.w), 2 * std::numbers::pi));
    const double across = 2 * std::asin(std::min(1.0, length(imaginary(q) - axis * about)));
    out.axis_error_rad = std::max(out.axis_error_rad, across);
    if (across > kMaxAxisError)
      return wrong(
          formatted("in %s the marker is turned by %.1f degrees about another axis than in the others: it must "
                    "stand still on the turntable, and the camera must not move",
                    view_name(v).c_str(), across / kDegree));
  }

  // The point of the axis that is nearest to the optical axis.
  const Vec3d foot = center_of(poses, turns, axis), forward{0, 0, -1};
  const double along = dot(axis, forward), across = 1 - along * along;
  if (across < 0.25) return wrong("the camera looks along the axis of the turntable: it must stand at its side");
  const Vec3d origin = foot + axis * ((along * dot(foot, forward) - dot(foot, axis)) / across);
  const Vec3d back = normalized(-origin + axis * dot(origin, axis)), right = cross(axis, back);
  const auto in_rig = [&](Vec3d p) { return Vec3d{dot(p, right), dot(p, axis), dot(p, back)}; };
  out.tilt_rad = std::asin(std::abs(along));
  out.rig.camera_distance_m = static_cast<float>(length(origin));
  out.rig.half_width_m = static_cast<float>(length(origin) * half_field_tan);
  for (const double turn : turns) out.rig.turns_rad.push_back(static_cast<float>(turn));

  std::size_t lights = 0;
  for (const auto& view : estimates) lights = std::max(lights, view.size());
  double darkest = std::numeric_limits<double>::infinity(), brightest = 0, sum = 0;
  for (std::size_t l = 0; l < lights; ++l) {
    std::vector<Ray> rays;
    double irradiance = 0;
    for (const auto& view : estimates) {
      if (l >= view.size() || !view[l] || view[l]->lights.empty()) continue;
      const Light& light = view[l]->lights[0];
      irradiance += static_cast<double>(light.irradiance.luminance());
      rays.push_back({in_rig(view[l]->T_probe_origin.translation - origin),
                      normalized(in_rig(vec_cast<double>(light.direction))), static_cast<double>(light.distance_m)});
    }
    if (rays.empty()) return wrong(formatted("no photograph with light %zu shows the marker and a light", l));
    const Vec3d position = light_position(rays);
    for (const Ray& ray : rays)
      out.light_spread_rad = std::max(out.light_spread_rad, angle_between(ray.direction, position - ray.from));
    if (out.light_spread_rad > kMaxLightSpread)
      return wrong(
          formatted("light %zu is up to %.0f degrees elsewhere in some views than in others: it must stand still while "
                    "the object turns, and be the strongest",
                    l, out.light_spread_rad / kDegree));
    out.rig.light_positions.push_back(vec_cast<float>(position));
    irradiance /= static_cast<double>(rays.size());
    darkest = std::min(darkest, irradiance);
    brightest = std::max(brightest, irradiance);
    sum += irradiance;
  }
  out.rig.reference_irradiance = static_cast<float>(sum / static_cast<double>(lights));
  out.brightest_by_darkest = brightest / darkest;
  return out;
}

}  // namespace lightwell::tool
