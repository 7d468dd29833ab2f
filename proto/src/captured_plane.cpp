#include <algorithm>
#include <cmath>
#include <string>

#include <lightwell/captured_plane.hpp>

#include "wire_position.hpp"

namespace lightwell {
namespace {

constexpr double kMinPlane_m = 1e-6, kMaxPlane_m = 1000;
constexpr double kMaxPlaneRotation_rad = 1000;
constexpr float kMaxPlaneRadiance = 1e30F;

Status plane_problem(const std::string& what) { return invalid_argument("captured plane: " + what); }

bool unit_share(const std::optional<float>& v) { return !v || (*v >= 0 && *v <= 1); }

bool within(double v, double limit) { return std::abs(v) <= limit; }

Status radiance_problem(const std::vector<Radiance>& radiance, const std::vector<SampleState>& state, std::size_t count,
                        const char* part) {
  if (radiance.size() != count || state.size() != count)
    return plane_problem(std::string(part) + ": the arrays do not have one element for each entry");
  for (const Radiance& v : radiance)
    // Also false for NaN.
    if (!(within(static_cast<double>(v.r), kMaxPlaneRadiance) && within(static_cast<double>(v.g), kMaxPlaneRadiance) &&
          within(static_cast<double>(v.b), kMaxPlaneRadiance)))
      return plane_problem(std::string(part) + ": a radiance is not finite or above 1e30");
  if (std::ranges::any_of(state, [](SampleState s) { return s > SampleState::clipped; }))
    return plane_problem(std::string(part) + ": a state is not known");
  return {};
}

}  // namespace

Status plane_info_problem(const PlaneInfo& info) {
  if (info.capture == 0) return plane_problem("capture is 0");
  if (info.units != Units::relative && info.units != Units::absolute) return plane_problem("units are not known");
  if (!(info.size_m >= kMinPlane_m && info.size_m <= kMaxPlane_m))
    return plane_problem("size_m must be within 1e-6 m and 1000 m");
  if (info.T_probe_plane)
    if (Status pose = wire_pose_problem(*info.T_probe_plane, "captured plane: T_probe_plane"); !pose.ok()) return pose;
  const PlaneSimilarity& s = info.texture_to_plane;
  if (!(within(s.x_m, kMaxPlane_m) && within(s.y_m, kMaxPlane_m) && within(s.rotation_rad, kMaxPlaneRotation_rad) &&
        s.scale >= 0.5 && s.scale <= 2))
    return plane_problem("texture_to_plane is out of range");
  if (!unit_share(info.gloss_alpha)) return plane_problem("gloss_alpha must be 0 to 1");
  if (!unit_share(info.f0)) return plane_problem("f0 must be 0 to 1");
  return {};
}

Status captured_plane_problem(const CapturedPlane& plane) {
  if (Status s = plane_info_problem(plane.info); !s.ok()) return s;
  if (plane.texture.edge < 0 || plane.texture.edge > kMaxPlaneTextureEdge)
    return plane_problem("texture.edge must be 0 to 256");
  if (plane.lumisphere.grid.levels() > kMaxPlaneLevels) return plane_problem("lumisphere: more than 128 levels");
  if (plane.coverage.grid.levels() > kMaxPlaneLevels) return plane_problem("coverage: more than 128 levels");
  if (Status s = radiance_problem(plane.texture.radiance, plane.texture.state, plane.texture.count(), "texture");
      !s.ok())
    return s;
  if (Status s = radiance_problem(plane.lumisphere.radiance, plane.lumisphere.state, plane.lumisphere.grid.size(),
                                  "lumisphere");
      !s.ok())
    return s;
  if (plane.coverage.seen.size() != plane.coverage.grid.size())
    return plane_problem("coverage: the array does not have one element for each node");
  return {};
}

}  // namespace lightwell
