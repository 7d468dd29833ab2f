// The shadow of a ball on the patches of its sheet.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "estimate/marker/light_fit.hpp"
#include "firmware/estimate/marker/lit_body.hpp"

namespace lightwell::marker {
namespace {

using test::kDegree;
using test::relative_irradiance_of;
using test::towards;

constexpr double kRadius = 0.02;
constexpr Vec3d kUp{0, 1, 0};

SurfaceSample patch_at(double x, double z) {
  return {.position = {x, -kRadius, z}, .normal = kUp, .irradiance = {}, .sigma = {}, .occluder_radius = kRadius};
}

TEST(SphereVisibility, IsThatOfARayPastTheSphere) {
  const Vec3d light = towards(90, 45);
  const double opposite = -kRadius / std::tan(45 * kDegree);
  EXPECT_EQ(sphere_visibility(light, 0, patch_at(opposite, 0)), 0) << "the ray passes through the centre";
  EXPECT_NEAR(sphere_visibility(light, 0, patch_at(opposite, kRadius)), 0.5, 1e-12) << "a tangent";
  EXPECT_EQ(sphere_visibility(light, 0, patch_at(opposite, 2 * kRadius)), 1);
  EXPECT_EQ(sphere_visibility(light, 0, patch_at(3 * kRadius, 0)), 1) << "the sphere is behind the patch";
  SurfaceSample open = patch_at(opposite, 0);
  open.occluder_radius = 0;
  EXPECT_EQ(sphere_visibility(light, 0, open), 1);
}

TEST(SphereVisibility, OfANearLightFollowsItsPosition) {
  // A light 10 cm above the centre of the ball: its shadow ends where the tangent meets the sheet.
  const double height = 0.1, tangent = kRadius / std::sqrt(height * height - kRadius * kRadius);
  const double edge = (height + kRadius) * tangent;
  EXPECT_NEAR(sphere_visibility(kUp, 1 / height, patch_at(edge, 0)), 0.5, 1e-9);
  EXPECT_EQ(sphere_visibility(kUp, 1 / height, patch_at(0.5 * edge, 0)), 0);
  EXPECT_EQ(sphere_visibility(kUp, 1 / height, patch_at(2 * edge, 0)), 1);
}

/// A ball on its sheet, both seen from above. Patches on the edge of the shadow are left out, as the sampler does.
Shading lit_ball(Vec3d lamp, double ambient) {
  Shading out;
  const PointLight light{lamp, 0, {1, 1, 1}};
  for (const Vec3d& normal : fibonacci_directions(80)) {
    out.hull.push_back(normal * kRadius);
    if (dot(normal, towards(0, 50)) < 0.4) continue;
    SurfaceSample s{.position = normal * kRadius, .normal = normal, .irradiance = {}, .sigma = {}, .surface = 1};
    s.irradiance.fill(ambient + relative_irradiance_of(light, s.position, normal));
    s.sigma.fill(1e-4);
    out.samples.push_back(s);
  }
  for (int i = -2; i <= 2; ++i)
    for (int k = -2; k <= 2; ++k) {
      if (i == 0 && k == 0) continue;
      SurfaceSample s = patch_at(0.02 * i, 0.02 * k);
      const double along = dot(-s.position, lamp);
      const double miss = length(s.position + lamp * along) / kRadius;
      if (along > 0 && std::abs(miss - 1) < 0.3) continue;
      const bool hidden = along > 0 && miss < 1;
      s.irradiance.fill(ambient + (hidden ? 0 : relative_irradiance_of(light, s.position, kUp)));
      s.sigma.fill(1e-4);
      out.samples.push_back(s);
    }
  return out;
}

TEST(SphereVisibility, IsPartOfAFit) {
  for (const double azimuth : {-43.0, 10.0, 60.0}) {
    const Vec3d lamp = towards(azimuth, 35);
    const auto fit_of = [&](const Shading& shading) {
      return fit_lights(Observations(shading), {{towards(azimuth + 4, 38), 0, {}}}, {Distance::infinite},
                        ObservationSet::faces, shading.hull);
    };
    Shading shading = lit_ball(lamp, 0.3);
    const Fit fit = fit_of(shading);
    // 0.2 degrees: the prior of the ambient light, as on a dodecahedron.
    EXPECT_LT(angle_between(fit.model.lights[0].direction, lamp) / kDegree, 0.2) << azimuth;
    EXPECT_LT(fit.face_chi_square, 1) << azimuth;
    for (SurfaceSample& s : shading.samples) s.occluder_radius = 0;
    EXPECT_GT(fit_of(shading).face_chi_square, 100) << azimuth << ": the shadow is taken for shading";
  }
}

}  // namespace
}  // namespace lightwell::marker
