#include "estimate/marker/ambient_radiance.hpp"

#include <algorithm>
#include <functional>
#include <numbers>
#include <vector>

#include "estimate/marker/max_entropy_radiance.hpp"

namespace lightwell::marker {
namespace {

/// Constants of the spherical harmonics of bands 0 and 1: proto/README.md.
constexpr double kY0 = 0.28209479177387814, kY1 = 0.48860251190291992;
/// Last band of the maximum-entropy radiance: the cosine lobe of the faces attenuates higher bands.
constexpr int kMaxEntropyBand = 4;
/// Normals at which an uncertain model is checked, and the cosine of their largest angle to a face that is seen. At
/// these, irradiance above that of the brightest face by more than this factor is an extrapolation: between faces of a
/// dodecahedron (63 degrees apart), that of one light is up to 1.2 times as large as on either.
constexpr int kNormals = 200;
constexpr double kMinNormalCosine = 0.7, kMaxExtrapolation = 1.3;

/// Adds the radiance of bands 0 and 1 whose irradiance at a normal is irradiance[0] + dot(irradiance[1..3], normal); of
/// band 0 alone where `out` has no more.
void add_irradiance(const std::array<Rgb, 4>& irradiance, RadianceSh& out) {
  // irradiance[1..3] are x, y, z; band 1 is in the order y, z, x.
  constexpr std::array<std::size_t, 4> kOrder = {0, 2, 3, 1};
  for (std::size_t i = 0; i < std::min<std::size_t>(4, static_cast<std::size_t>(out.count())); ++i) {
    const double factor = i == 0 ? 1 / (std::numbers::pi * kY0) : 1.5 / (std::numbers::pi * kY1);
    const Rgb& from = irradiance[kOrder[i]];
    out.c[i].r += static_cast<float>(from[0] * factor);
    out.c[i].g += static_cast<float>(from[1] * factor);
    out.c[i].b += static_cast<float>(from[2] * factor);
  }
}

/// Whether the model's irradiance between the faces that are seen, or beside them, is much above that of the brightest
/// one.
bool extrapolates(const LightingEstimate& estimate) {
  static const std::vector<Vec3d> normals = fibonacci_directions(kNormals);
  double brightest = 0;
  for (const SurfaceSample& sample : estimate.inliers) brightest = std::max(brightest, luminance(sample.irradiance));
  return std::ranges::any_of(normals, [&](const Vec3d& normal) {
    if (std::ranges::none_of(estimate.inliers,
                             [&](const SurfaceSample& s) { return dot(s.normal, normal) > kMinNormalCosine; }))
      return false;
    const auto& [constant, x, y, z] = estimate.ambient;
    double irradiance =
        luminance(constant) + luminance(x) * normal.x + luminance(y) * normal.y + luminance(z) * normal.z;
    for (const LightEstimate& one : estimate.lights)
      irradiance += luminance(one.light.irradiance) * std::max(0.0, dot(one.light.direction, normal));
    return irradiance > kMaxExtrapolation * brightest;
  });
}

}  // namespace

RadianceSh ambient_radiance(LightingEstimate& estimate, int band) {
  RadianceSh out;
  if (estimate.uncertain && (!estimate.localized || extrapolates(estimate))) {
    // Many sets of point lights explain the faces; they predict different irradiances at normals between the faces.
    std::vector<Vec3d> toward;
    for (const LightEstimate& one : estimate.lights) toward.push_back(one.light.direction);
    if (const auto max_entropy = max_entropy_radiance(estimate.inliers, toward, std::min(band, kMaxEntropyBand))) {
      for (std::size_t k = 0; k < estimate.lights.size(); ++k)
        estimate.lights[k].light.irradiance = max_entropy->lights[k];
      const auto sum = [](const LightEstimate& one) {
        return one.light.irradiance[0] + one.light.irradiance[1] + one.light.irradiance[2];
      };
      std::ranges::stable_sort(estimate.lights, std::ranges::greater{}, sum);
      out = max_entropy->radiance;
      add_irradiance(estimate.ground, out);
      return out;
    }
  }
  out.band = 1;
  add_irradiance(estimate.ambient, out);
  add_irradiance(estimate.ground, out);
  return out;
}

}  // namespace lightwell::marker
