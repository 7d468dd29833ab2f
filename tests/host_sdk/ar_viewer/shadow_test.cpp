// Shadows on the real plane against geometry and against the reference ray tracer.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "ar_viewer/light_state.hpp"
#include "host_sdk/ar_viewer/viewer_scenes.hpp"
#include "host_sdk/shadow_scenes.hpp"
#include "reference/shadow_tracer.hpp"

namespace lightwell::test {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

viewer::Scene ground_scene() {
  viewer::Scene scene = make_viewer_scene();
  scene.ground = viewer::Ground{{}, 2, 2};
  return scene;
}

/// A wide plate 0.1 m above the plane, whose right edge is at x = 0, under a lamp overhead: the penumbra is around x =
/// 0.
viewer::Scene plate_scene() {
  viewer::Scene scene = ground_scene();
  scene.objects = {make_object("box", {0.4, 0.002, 0.4}, {-0.2, 0.1, 0})};
  return scene;
}

/// Visible share of a disc whose centre is x radii beyond a straight edge.
double disc_share(double x) {
  const double t = std::clamp(x, -1.0, 1.0);
  return 0.5 + (t * std::sqrt(1 - t * t) + std::asin(t)) / std::numbers::pi;
}

class PenumbraTest : public testing::TestWithParam<double> {};

TEST_P(PenumbraTest, OfAnEdgeHasTheWidthOfTheLightsAngularRadius) {
  viewer::Scene scene = plate_scene();
  // From the side of +Z, so that the plate does not hide its shadow.
  scene.pose = Pose{Quat::about({1, 0, 0}, -0.15), {0, 0.06, 0.4}};
  const double radius = GetParam() * kDegree;
  Descriptor d = uniform_light({0, 0, 0});
  d.lights = {make_light({0, 1, 0}, {1, 1, 1}, GetParam())};
  set_light(scene, d);
  const Rendered picture = render(scene);
  const int row = 200;
  double worst = 0, reach = 0;
  for (int column = 100; column < 540; ++column) {
    const double x = ground_point(scene, column, row).x;
    const double expected = disc_share(x / (0.099 * std::tan(radius)));
    worst = std::max(worst, std::abs(static_cast<double>(picture.shadow.at(column, row)[0]) - expected));
    reach = std::max(reach, std::abs(x));
  }
  ASSERT_GT(reach, 0.04) << "the row must show the plane on both sides";
  // 64 taps of the disc and the thickness of the plate; half a texel of the map, 0.3 mm, in a penumbra of 3.5 mm at 2
  // degrees.
  EXPECT_LT(worst, 0.04 + 0.09 / GetParam()) << GetParam();
}

INSTANTIATE_TEST_SUITE_P(Radii, PenumbraTest, testing::Values(2.0, 5.0, 12.0));

/// Error of the ratio beside a box of the seed's trials, 7.8 cm tall, against the ray tracer.
struct RatioErrors {
  double rms = 0, worst = 0;
  int dark = 0;  ///< Pixels whose true ratio is below 0.9.
};

RatioErrors ratio_errors(const Descriptor& d) {
  viewer::Scene scene = ground_scene();
  scene.objects = {make_object("box", {0.03, 0.078, 0.03})};
  set_light(scene, d);
  const Rendered picture = render(scene);

  // The tracer's plane is z = 0: its x, y, z are our x, -z, y.
  reference::ShadowScene truth;
  truth.mesh = reference::make_box({-0.015, -0.015, 0}, {0.015, 0.015, 0.078}, 1);
  for (const Light& light : d.lights)
    truth.lights.push_back({{light.direction.x, -light.direction.z, light.direction.y},
                            light.angular_radius_rad,
                            {light.irradiance.r, light.irradiance.g, light.irradiance.b},
                            0});
  truth.residual = [](reference::V3) { return reference::Rgb{0.3, 0.4, 0.5}; };
  const reference::ShadowTracer tracer(truth);
  double squares = 0, worst = 0;
  int count = 0, dark = 0;
  for (int row = 30; row < 350; row += 9)
    for (int column = 130; column < 520; column += 9) {
      const Vec3d at = ground_point(scene, column, row);
      if (std::abs(at.x) < 0.02 && std::abs(at.z) < 0.02) continue;  // Below the object.
      const Vec3d next = ground_point(scene, column + 1, row + 1);
      const reference::Rgb expected = tracer.ratio(
          {std::min(at.x, next.x), std::min(-at.z, -next.z), std::max(at.x, next.x), std::max(-at.z, -next.z)}, 256);
      for (int c = 0; c < 3; ++c) {
        const double e = static_cast<double>(picture.shadow.at(column, row)[c]) - expected[static_cast<std::size_t>(c)];
        squares += e * e;
        worst = std::max(worst, std::abs(e));
      }
      dark += expected[0] < 0.9 ? 1 : 0;
      ++count;
    }
  return {std::sqrt(squares / (3 * count)), worst, dark};
}

TEST(ViewerShadow, RatioAgreesWithTheReferenceRayTracer) {
  Descriptor d = uniform_light({0.3F, 0.4F, 0.5F});
  d.lights = {make_light({0.6F, 0.7F, 0.3F}, {2, 1.8F, 1.5F}, 2),
              make_light({-0.7F, 0.6F, 0.2F}, {0.4F, 0.5F, 0.8F}, 10)};
  const RatioErrors errors = ratio_errors(d);
  EXPECT_GT(errors.dark, 25);
  // The mean depth of the casters stands for their depths, which errs where a penumbra joins the object's foot.
  EXPECT_LT(errors.rms, 0.02);
  EXPECT_LT(errors.worst, 0.2);
}

TEST(ViewerShadow, OcclusionOfTheResidualAgreesWithTheReferenceRayTracer) {
  const RatioErrors errors = ratio_errors(uniform_light({0.3F, 0.4F, 0.5F}));
  EXPECT_GT(errors.dark, 25);
  // Beyond 0.8 of its reach the texture fades out, where the box hides less than 1 % of the light.
  EXPECT_LT(errors.rms, 0.01);
  EXPECT_LT(errors.worst, 0.04);
}

TEST(ViewerShadow, OfANearLampFallsFromItsPosition) {
  viewer::Scene scene = ground_scene();
  scene.objects = {make_object("box", {0.02, 0.078, 0.02})};
  // The probe is at the object's top; the lamp is 0.2 m from there.
  scene.T_world_probe = Pose{{}, {0, 0.078, 0}};
  const Vec3f towards = normalized(Vec3f{1, 0.9F, 0});
  Descriptor d = uniform_light({0, 0, 0});
  d.lights = {make_light(towards, {1, 1, 1}, 0.2, 0.2F)};
  set_light(scene, d);
  const Rendered picture = render(scene);
  const Vec3d lamp = Vec3d{0, 0.078, 0} + vec_cast<double>(towards) * static_cast<double>(0.2F);
  // The shadow's tip: where the ray from the lamp over the far upper edge meets the plane.
  const Vec3d edge{-0.01, 0.078, 0};
  const Vec3d tip = lamp + (edge - lamp) * (lamp.y / (lamp.y - edge.y));
  const PixelPoint expected = pixel_of(scene, tip);
  // To the left of the tip the row is lit.
  std::optional<double> found;
  const int row = static_cast<int>(std::lround(expected.row));
  for (int column = static_cast<int>(expected.column) - 30; column < static_cast<int>(expected.column) + 30; ++column)
    if (!found && picture.shadow.at(column, row)[0] >= 0.5F && picture.shadow.at(column + 1, row)[0] < 0.5F)
      found = column + 0.5;
  ASSERT_TRUE(found.has_value());
  EXPECT_NEAR(*found, expected.column, 1.5);
  // A distant light from there would end the shadow elsewhere.
  const Vec3d distant_tip = edge - vec_cast<double>(towards) * (0.078 / static_cast<double>(towards.y));
  EXPECT_GT(std::abs(pixel_of(scene, distant_tip).column - expected.column), 6);
}

TEST(ViewerShadow, StrengthAndGainChangeTheRatioAsDocumented) {
  viewer::Scene scene = ground_scene();
  scene.objects = {make_object("box", {0.03, 0.078, 0.03})};
  Descriptor d = uniform_light({0.3F, 0.4F, 0.5F});
  d.lights = {make_light({0.6F, 0.7F, 0.3F}, {2, 1.8F, 1.5F}, 2)};
  set_light(scene, d);
  const Rendered plain = render(scene);
  scene.shadow.strength = 0.6F;
  scene.shadow.gain = 2;
  const Rendered changed = render(scene);
  for (int row = 0; row < 360; row += 5)
    for (int column = 0; column < 640; column += 5)
      for (int c = 0; c < 3; ++c) {
        const float ratio = plain.shadow.at(column, row)[c];
        // Samples of a pixel at the plane's edge are averaged after the exponent.
        ASSERT_NEAR(changed.shadow.at(column, row)[c], 1 - 0.6F * (1 - ratio * ratio), 2e-3);
      }
}

TEST(ViewerShadow, OfAlphaTestHasTwoValues) {
  viewer::Scene scene = ground_scene();
  scene.objects = {make_object("box", {0.03, 0.078, 0.03})};
  scene.shadow.display = viewer::ShadowDisplay::alpha_test;
  scene.shadow.strength = 0.75F;
  Descriptor d = uniform_light({0.3F, 0.4F, 0.5F});
  d.lights = {make_light({0.6F, 0.7F, 0.3F}, {2, 1.8F, 1.5F}, 2)};
  set_light(scene, d);
  const Rendered picture = render(scene);
  int lit = 0, dark = 0;
  for (int row = 0; row < 360; ++row)
    for (int column = 0; column < 640; ++column) {
      const float value = picture.shadow.at(column, row)[0];
      if (value == 1) ++lit;
      if (value == 0.25F) ++dark;
    }
  EXPECT_EQ(lit + dark, 640 * 360);
  EXPECT_GT(dark, 1000);
}

TEST(ViewerShadow, ObjectsShadowEachOther) {
  // The lamp, the plate and the sphere are in one line.
  viewer::Scene scene = make_viewer_scene();
  scene.objects = {make_object("sphere", {0.08}), make_object("box", {0.1, 0.002, 0.1}, {0.15, 0.2, 0})};
  Descriptor d = uniform_light({0, 0, 0});
  d.lights = {make_light({0.15F, 0.16F, 0}, {1, 1, 1}, 0.5)};
  set_light(scene, d);
  const Rendered shadowed = render(scene);
  scene.objects.pop_back();
  const Rendered alone = render(scene);
  const PixelPoint p = pixel_of(scene, {0.02, 0.07, 0.02});
  const int column = static_cast<int>(std::lround(p.column)), row = static_cast<int>(std::lround(p.row));
  EXPECT_GT(alone.frame.at(column, row)[0], 0.1F);
  EXPECT_EQ(shadowed.frame.at(column, row)[0], 0.0F);
}

TEST(ViewerShadow, OfStaleLightFadesToTheMean) {
  Descriptor d = uniform_light({0.3F, 0.3F, 0.3F});
  d.lights = {make_light({0.6F, 0.7F, 0.3F}, {2, 2, 2}, 2)};
  EXPECT_EQ(viewer::stale_presence(Validity::valid, 100, 2), 1.0F);
  EXPECT_EQ(viewer::stale_presence(Validity::stale, 0.5, 2), 0.75F);
  EXPECT_EQ(viewer::stale_presence(Validity::stale, 5, 2), 0.0F);
  EXPECT_EQ(viewer::stale_presence(Validity::stale, 0, 0), 0.0F);
  const Lighting lighting = Lighting::of(d);
  const viewer::LightState whole = viewer::make_light_state(lighting, viewer::Shading::full, 1);
  const viewer::LightState half = viewer::make_light_state(lighting, viewer::Shading::full, 0.5F);
  const viewer::LightState gone = viewer::make_light_state(lighting, viewer::Shading::full, 0);
  ASSERT_EQ(whole.lights.size(), 1U);
  ASSERT_EQ(half.lights.size(), 1U);
  EXPECT_TRUE(gone.lights.empty());
  EXPECT_FLOAT_EQ(half.lights[0].irradiance.r, 1.0F);
  // The mean stays: what the light loses is in the residual.
  const auto mean_of = [](const viewer::LightState& state) {
    Descriptor all = state.residual.descriptor();
    for (const viewer::ShadedLight& light : state.lights)
      all.lights.push_back(make_light(light.direction, light.irradiance, 2));
    return viewer::mean_radiance(all).r;
  };
  EXPECT_NEAR(mean_of(half), mean_of(whole), 1e-5);
  EXPECT_NEAR(mean_of(gone), mean_of(whole), 1e-5);
}

}  // namespace
}  // namespace lightwell::test
