// Light that the ground plane sends to the place of the body, as if the body were absent, and its part of the ambient
// radiance; compared with closed forms and with sums over an infinite plane.
#include "estimate/marker/ground_light.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/harmonics.hpp>

#include "estimate/marker/ambient_radiance.hpp"
#include "firmware/estimate/marker/lit_body.hpp"

namespace lightwell::marker {
namespace {

using test::LitBody;
using test::towards;

constexpr double kAlbedo = 0.35;
const Vec3d kUp{0, 1, 0};

Rgb at_normal(const std::array<Rgb, 4>& irradiance, Vec3d n) {
  Rgb out{};
  for (std::size_t c = 0; c < 3; ++c)
    out[c] = irradiance[0][c] + irradiance[1][c] * n.x + irradiance[2][c] * n.y + irradiance[3][c] * n.z;
  return out;
}

/// Irradiance of the plane without the body, at a position on it.
Rgb irradiance_of_plane(const LitBody& body, Vec3d at) {
  Rgb out;
  out.fill(body.ambient);
  for (const PointLight& lamp : body.lamps)
    for (std::size_t c = 0; c < 3; ++c) out[c] += lamp.irradiance[c] * test::relative_irradiance_of(lamp, at, kUp);
  return out;
}

TEST(GroundLight, IsThatOfAHalfSpaceWithoutTheBodysShadow) {
  for (const double azimuth : {0.0, 90.0, 180.0}) {
    const LitBody body{
        .lamps = {{towards(azimuth, 40), 0, {1, 0.8, 0.6}}, {towards(azimuth + 100, 60), 0, {0.2, 0.3, 0.4}}},
        .ambient = 0.2,
        .table = true,
        .table_albedo = kAlbedo};
    const auto ground = unoccluded_ground_irradiance(body.shading(), body.lamps);
    const Rgb on_plane = irradiance_of_plane(body, {});
    for (const Vec3d& n : fibonacci_directions(50))
      for (std::size_t c = 0; c < 3; ++c)
        // 2 %: the edges of the shadows are smoothed, and the colours of the lights are fitted beside them.
        EXPECT_NEAR(at_normal(ground, n)[c], kAlbedo * on_plane[c] * (1 - n.y) / 2, 0.02 * kAlbedo * on_plane[c])
            << azimuth << " deg, channel " << c;
  }
}

TEST(GroundLight, OfANearLampVariesOverThePlane) {
  const LitBody body{
      .lamps = {{towards(60, 35), 1 / 0.3, {1, 1, 1}}}, .ambient = 0.05, .table = true, .table_albedo = kAlbedo};
  const auto ground = unoccluded_ground_irradiance(body.shading(), body.lamps);
  // Rings of a polar grid around the foot, out to 20 m; the form factor of a ring's cell is cos cos dA / (pi d²).
  for (const Vec3d n : {-kUp, normalized(Vec3d{1, -1, 0}), normalized(Vec3d{-1, -1, 1}), Vec3d{1, 0, 0}, Vec3d{0, 0, 1},
                        Vec3d{0, 0, -1}}) {
    double truth = 0;
    for (double inner = 0.001; inner < 20; inner *= 1.02)
      for (int k = 0; k < 360; ++k) {
        const double a = (k + 0.5) * test::kDegree, radius = inner * 1.01;
        const Vec3d p{radius * std::cos(a), -test::kInradius, radius * std::sin(a)};
        const double area = radius * inner * 0.02 * test::kDegree, squared = dot(p, p);
        truth += kAlbedo / std::numbers::pi * irradiance_of_plane(body, p)[0] * std::max(0.0, dot(p, n)) *
                 test::kInradius * area / (squared * squared);
      }
    // Beyond its samples the plane keeps the radiance at their edge: too much near the horizon.
    EXPECT_NEAR(at_normal(ground, n)[0], truth, 0.07 * kAlbedo) << n.x << " " << n.y << " " << n.z;
  }
}

TEST(GroundLight, IsThatOfTheTableInPlaceOfABallsSheet) {
  const LitBody body{.lamps = {{towards(40, 40), 0, {1, 0.8, 0.6}}}, .ambient = 0.2, .table = true};
  Shading shading = body.shading();
  const auto table = unoccluded_ground_irradiance(shading, body.lamps);
  for (GroundSample& s : shading.ground->samples) {
    if (length(s.position) > 0.1) continue;
    // A sheet of four times the table's albedo.
    s.table_ratio = 0.25;
    for (double& c : s.color) c /= s.table_ratio;
  }
  const auto sheet = unoccluded_ground_irradiance(shading, body.lamps);
  for (const Vec3d& n : fibonacci_directions(20)) EXPECT_NEAR(at_normal(sheet, n)[1], at_normal(table, n)[1], 1e-9);
}

TEST(GroundLight, IsZeroWithoutAPlane) {
  const LitBody body{.lamps = {{towards(0, 40), 0, {1, 1, 1}}}};
  EXPECT_EQ(unoccluded_ground_irradiance(body.shading(), body.lamps), (std::array<Rgb, 4>{}));
}

TEST(AmbientRadiance, ContainsTheGroundWhetherTheLightsAreCertainOrNot) {
  LightingEstimate estimate;
  const LitBody body{.lamps = {{towards(20, 30), 0, {1, 1, 1}}}, .ambient = 0.3};
  estimate.inliers = body.shading().samples;
  estimate.lights.resize(1);
  estimate.lights[0].light = body.lamps[0];
  estimate.ambient[0].fill(0.3);
  for (const bool uncertain : {false, true}) {
    estimate.uncertain = uncertain;
    LightingEstimate with = estimate, without = estimate;
    // A half space of radiance (0.4, 0.2, 0.1) / pi below.
    with.ground = {Rgb{0.2, 0.1, 0.05}, Rgb{}, Rgb{-0.2, -0.1, -0.05}, Rgb{}};
    const IrradianceSh e = irradiance_of(ambient_radiance(with, 4)),
                       plain = irradiance_of(ambient_radiance(without, 4));
    for (const Vec3d& n : fibonacci_directions(20)) {
      const auto at = vec_cast<float>(n);
      EXPECT_NEAR(evaluate(e, at).r - evaluate(plain, at).r, 0.2 * (1 - n.y), 1e-5) << uncertain;
      EXPECT_NEAR(evaluate(e, at).b - evaluate(plain, at).b, 0.05 * (1 - n.y), 1e-5) << uncertain;
    }
    EXPECT_EQ(with.lights[0].light.irradiance, without.lights[0].light.irradiance) << uncertain;
  }
}

TEST(AmbientRadiance, UncertainLightsThatExtrapolateGiveWayToTheLightOfTheFaces) {
  const LitBody body{.lamps = {{towards(20, 30), 0, {1, 1, 1}}}, .ambient = 0.3};
  LightingEstimate estimate;
  estimate.inliers = body.shading().samples;
  estimate.uncertain = estimate.localized = true;
  estimate.lights.resize(1);
  // A light between two faces, so strong that the irradiance there is ten times that of the brightest face.
  estimate.lights[0].light = {towards(36, 60), 0, {10, 10, 10}};
  const RadianceSh radiance = ambient_radiance(estimate, 4);
  double brightest = 0;
  for (const SurfaceSample& s : estimate.inliers) brightest = std::max(brightest, s.irradiance[1]);
  EXPECT_LT(estimate.lights[0].light.irradiance[1], brightest);
  // The maximum-entropy light reproduces the faces: 5 %, their errors.
  for (const SurfaceSample& s : estimate.inliers) {
    const double by_light =
        estimate.lights[0].light.irradiance[1] * std::max(0.0, dot(estimate.lights[0].light.direction, s.normal));
    EXPECT_NEAR(evaluate(irradiance_of(radiance), vec_cast<float>(s.normal)).g + by_light, s.irradiance[1],
                0.05 * brightest)
        << s.surface;
  }
}

}  // namespace
}  // namespace lightwell::marker
