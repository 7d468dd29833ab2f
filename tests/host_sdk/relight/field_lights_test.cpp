// A subject in the light of a field: lamps that probes have placed.
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/field.hpp>
#include <lightwell/relight.hpp>

#include "host_sdk/field/field_scenes.hpp"
#include "host_sdk/relight/wall_scene.hpp"

namespace lightwell::test {
namespace {

TEST(PlaceLights, OfAFieldAreItsLamps) {
  WallScene wall;
  for (const Vec3d& d : {Vec3d{1, 0.8, 1}, Vec3d{-1, 0.7, 1.2}, Vec3d{0.1, -1, 1}})
    wall.basis.push_back({Vec3d{0, 0, -2} + normalized(d) * 3.0, LightDistance::finite, {3, 2, 1}});
  const FieldScene scene{.lamps = {{{0.4, 0.3, -0.2}}, {{-0.9, 0.7, 0.3}, {1, 2, 4}}}};
  const LightField field = field_of(scene, {{-1.5, 0.2, -1}, {1.6, 0.1, -0.8}, {1.4, -0.6, 1.5}, {-1.3, 1.5, 1.6}});
  const FieldAnswer answer = field.at({0, 0, -2}, {});
  const auto lights = place_lights(answer.light, {}, wall.basis, wall.subject(), 0);
  ASSERT_TRUE(lights.ok()) << lights.status().message();
  ASSERT_EQ(lights->patterns.size(), 2U);

  AlphaMaps alpha;
  ASSERT_TRUE(alpha.compute(wall.subject(), wall.basis, lights->patterns, lights->weights).ok());
  const auto photographs = wall.photographs();
  std::vector<Radiance> picture(wall.camera.pixels());
  ASSERT_TRUE(relight_direct(alpha, spans_of(photographs), picture).ok());
  for (std::size_t p = 0; p < picture.size(); p += 3) {
    Radiance truth;
    for (const Lamp& lamp : scene.lamps) truth += wall.lit(p, lamp.position, lamp.intensity);
    // The field's intensities and places are within a percent each.
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(picture[p][c], truth[c], 0.02 * truth[c]) << p;
  }
}

TEST(PlaceLights, OfAnExpiredFieldAreRefused) {
  WallScene wall;
  wall.basis = {{{0, 0, 1}, LightDistance::finite, {3, 2, 1}}};
  LightField field = field_of({.lamps = {{{0.4, 0.3, -0.2}}}}, four_places());
  (void)field.update(HostTime{} + Duration{120'000'000'000});
  const FieldAnswer answer = field.at({0, 0, -2}, HostTime{} + Duration{120'000'000'000});
  EXPECT_EQ(place_lights(answer.light, {}, wall.basis, wall.subject()).status().code(),
            StatusCode::failed_precondition);
}

}  // namespace
}  // namespace lightwell::test
