#include "light_upload.hpp"

#include <array>
#include <cstddef>
#include <iomanip>
#include <string_view>

namespace openxr_light {
namespace {

std::string_view name(lightwell::XrLightEstimateState state) {
  return state == lightwell::XrLightEstimateState::valid ? "VALID" : "INVALID";
}

std::ostream& operator<<(std::ostream& out, const std::array<float, 3>& v) {
  return out << v[0] << ' ' << v[1] << ' ' << v[2];
}

}  // namespace

lightwell::Converted<lightwell::OpenXrLightEstimate> light_in_space(const lightwell::Lighting& lighting,
                                                                    const lightwell::Pose& T_world_probe,
                                                                    const lightwell::Pose& T_world_space,
                                                                    lightwell::XrSphericalHarmonicsKind kind) {
  const lightwell::Pose T_space_probe = lightwell::compose(lightwell::inverse(T_world_space), T_world_probe);
  return lightwell::to_openxr(lighting.in_world(T_space_probe), kind);
}

void print(std::ostream& out, const lightwell::Converted<lightwell::OpenXrLightEstimate>& estimate,
           const char* indent) {
  const lightwell::OpenXrLightEstimate& e = estimate.value;
  out << std::fixed << std::setprecision(4);
  out << indent << "state " << name(e.state) << ", " << to_string(estimate.validity);
  if (estimate.residual) out << ", residual " << *estimate.residual;
  out << '\n';
  if (!estimate.has_estimate()) return;
  out << indent << "ambient intensity " << e.ambientLight.intensity << '\n';
  out << indent << "directional " << name(e.directionalLight.state);
  if (e.directionalLight.state == lightwell::XrLightEstimateState::valid)
    out << ", direction " << e.directionalLight.direction << ", intensity " << e.directionalLight.intensity;
  out << '\n'
      << indent << "harmonics " << name(e.sphericalHarmonics.state) << ", "
      << (e.sphericalHarmonics.kind == lightwell::XrSphericalHarmonicsKind::total ? "TOTAL" : "AMBIENT") << '\n';
  for (const auto& coefficient : e.sphericalHarmonics.coefficients) out << indent << "  " << coefficient << '\n';
}

}  // namespace openxr_light
