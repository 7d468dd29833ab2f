#include "field/views.hpp"

#include <algorithm>
#include <cmath>

#include "core/sample.hpp"

namespace lightwell::field {
namespace {

/// Pixels and lenses: no direction and no pose is more certain than this.
constexpr double kDirectionFloor_rad = 1e-3, kRotationFloor_rad = 1e-4, kTranslationFloor_m = 1e-3;

}  // namespace

double luminance_of(const Irradiance& e) { return static_cast<double>(e.luminance()); }

ProbeView view_of(const FieldSample& sample) {
  const Descriptor& d = sample.light;
  const Pose& pose = sample.T_world_probe.pose;
  const Quat turn = pose.rotation.normalized();
  ProbeView out;
  out.origin = transformed({turn, pose.translation}, d.T_probe_origin.translation);
  out.radiance = rotated(d.radiance, turn);
  for (const Light& light : d.lights) out.lights.push_back(core::rotate_light(light, turn));
  const PoseCovariance& c = sample.T_world_probe.covariance;
  for (std::size_t i = 0; i < 6; ++i)
    out.pose_sigma[i] = std::max(std::sqrt(std::max(c[i][i], 0.0)), i < 3 ? kRotationFloor_rad : kTranslationFloor_m);
  out.absolute = d.units == Units::absolute;
  out.calibration = std::uint64_t{d.probe_id} << 32U | d.calibration_id;
  return out;
}

std::vector<Observation> observations_of(std::span<const ProbeView> views) {
  std::vector<Observation> out;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const ProbeView& view = views[v];
    for (std::size_t k = 0; k < view.lights.size(); ++k) {
      const Light& light = view.lights[k];
      const double luminance = luminance_of(light.irradiance) * view.scale;
      const Vec3d direction = normalized(vec_cast<double>(light.direction));
      if (!(luminance > 0) || direction == Vec3d{}) continue;
      Observation o;
      o.view = v;
      o.light = k;
      o.origin = view.origin;
      o.direction = direction;
      o.luminance = luminance;
      const auto& c = light.direction_covariance;
      // The centroid of a wide light is not where its middle projects to: foreshortening moves it by some rho²/2.
      const double rho = static_cast<double>(light.angular_radius_rad), centroid = 0.5 * rho * rho;
      const auto& s = view.pose_sigma;
      const double turn2 = (s[0] * s[0] + s[1] * s[1] + s[2] * s[2]) / 3;
      o.sigma_rad = std::sqrt(static_cast<double>(c[0] + c[2]) / 2 + kDirectionFloor_rad * kDirectionFloor_rad +
                              centroid * centroid + turn2);
      const auto channel = [&](float value) {
        return std::log(std::max(static_cast<double>(value), 1e-3 * luminance));
      };
      const double g = channel(light.irradiance.g);
      o.chroma = {channel(light.irradiance.r) - g, channel(light.irradiance.b) - g};
      o.radius_rad = rho;
      o.distance_m = static_cast<double>(light.distance_m);
      o.distance_sigma_m = static_cast<double>(light.distance_sigma_m);
      out.push_back(o);
    }
  }
  std::ranges::stable_sort(out, [](const Observation& a, const Observation& b) {
    return a.view != b.view ? a.view < b.view : a.luminance > b.luminance;
  });
  return out;
}

}  // namespace lightwell::field
