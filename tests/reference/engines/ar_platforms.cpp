#include "reference/engines/ar_platforms.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "reference/engines/condon_shortley.hpp"
#include "reference/engines/renderers.hpp"
#include "reference/harmonics.hpp"

namespace lightwell::reference::engines {

namespace {

constexpr int degree_of[9] = {0, 1, 1, 1, 2, 2, 2, 2, 2};
constexpr int order_of[9] = {0, -1, 0, 1, -2, -1, 0, 1, 2};

double clipped_cosine(const V3& normal, const std::array<double, 3>& towards) {
  return std::max(0.0, dot(normal, {towards[0], towards[1], towards[2]}));
}

/// pi times the radiance reflected by a white surface for nine coefficients in the basis with the phase.
Rgb irradiance_with_phase(const std::array<std::array<double, 3>, 9>& c, const V3& normal) {
  Rgb white{};
  for (std::size_t i = 0; i < 9; ++i) {
    // cosine_lobe() / pi is 1, 2/3, 1/4: the cosine's convolution and the BRDF's 1/pi.
    const double factor = condon_shortley(degree_of[i], order_of[i], normal) * cosine_lobe(degree_of[i]) / pi;
    for (std::size_t k = 0; k < 3; ++k) white[k] += factor * c[i][k];
  }
  return {pi * white[0], pi * white[1], pi * white[2]};
}

std::array<std::array<double, 3>, 9> rows(const std::array<double, 27>& interleaved) {
  std::array<std::array<double, 3>, 9> out{};
  for (std::size_t i = 0; i < 27; ++i) out[i / 3][i % 3] = interleaved[i];
  return out;
}

}  // namespace

Rgb arcore_irradiance(const ArCoreEstimate& e, const V3& normal) {
  Rgb sum = irradiance_with_phase(rows(e.ambient_spherical_harmonics), normal);
  for (std::size_t k = 0; k < 3; ++k)
    sum[k] += pi * (e.main_light_intensity[k] * clipped_cosine(normal, e.main_light_direction) / pi);
  return sum;
}

Rgb webxr_irradiance_as_browsers_give_it(const WebXrEstimate& e, const V3& normal) {
  const auto& d = e.primary_light_direction;
  const auto& l = e.primary_light_intensity;
  return arcore_irradiance({{d[0], d[1], d[2]}, {l[0], l[1], l[2]}, e.spherical_harmonics_coefficients}, normal);
}

Rgb webxr_irradiance_as_three_js_reads_it(const WebXrEstimate& e, const V3& normal) {
  const auto& d = e.primary_light_direction;
  const auto& l = e.primary_light_intensity;
  const double scalar = std::max({1.0, l[0], l[1], l[2]});
  ThreeScene scene;
  scene.sh = rows(e.spherical_harmonics_coefficients);
  scene.probe_intensity = 1;
  scene.light_position = {d[0], d[1], d[2]};
  scene.light_color = {l[0] / scalar, l[1] / scalar, l[2] / scalar};
  scene.light_intensity = scalar;
  return three_irradiance(scene, ThreeLights::physical, normal);
}

Rgb openxr_irradiance(const OpenXrEstimate& e, OpenXrBasis basis, const V3& normal) {
  Rgb sum{};
  if (e.state != 0) return sum;
  if (e.harmonics_state == 0) {
    if (basis == OpenXrBasis::condon_shortley) {
      sum = irradiance_with_phase(e.coefficients, normal);
    } else {
      std::vector<Rgb> list(e.coefficients.begin(), e.coefficients.end());
      sum = irradiance_from_sh(list, normal);
    }
  }
  if (e.directional_state == 0)
    for (std::size_t k = 0; k < 3; ++k) sum[k] += e.intensity[k] * clipped_cosine(normal, e.direction);
  return sum;
}

Rgb arkit_irradiance(const std::array<double, 27>& planes, const V3& normal) {
  std::vector<Rgb> list(9);
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t i = 0; i < 9; ++i) list[i][k] = planes[9 * k + i];
  return irradiance_from_sh(list, normal);
}

}  // namespace lightwell::reference::engines
