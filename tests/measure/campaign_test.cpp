// Scenes and groups of the campaign of the error bound.
#include <cmath>
#include <cstddef>
#include <numbers>

#include <gtest/gtest.h>

#include "measure/campaign_group.hpp"
#include "measure/panorama_truth.hpp"
#include "reference/irradiance.hpp"

namespace lightwell::measure {
namespace {

constexpr double kDeg = std::numbers::pi / 180;

double luminance(const std::vector<reference::Rgb>& irradiance, std::size_t at) {
  return reference::luminance(irradiance.at(at));
}

/// The state's irradiance is that of its panorama by brute force, at some of the normals.
void expect_true_irradiance(const CampaignScene& scene) {
  const sim::Panorama& p = scene.panorama();
  const reference::Panorama whole{p.width, p.height, {p.rgb.begin(), p.rgb.end()}};
  for (std::size_t n = 0; n < truth_normals().size(); n += 300) {
    const reference::Rgb truth = reference::irradiance(whole, truth_normals()[n]);
    // The panorama's sums of light are rounded to floats.
    for (std::size_t c = 0; c < 3; ++c)
      EXPECT_NEAR(scene.irradiance()[n][c], truth[c], 1e-6 * truth[c]) << scene.name() << ", normal " << n;
  }
}

TEST(Campaign, IrradianceOfEachStateIsThatOfItsPanorama) {
  for (const SceneKind kind : kSceneKinds) {
    if (kind == SceneKind::real) continue;
    extremes::Chance chance(7);
    Result<CampaignScene> scene = CampaignScene::draw(kind, chance);
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    scene->set(scene->first_state());
    expect_true_irradiance(*scene);
    LightState other = scene->first_state();
    other.gain = 0.3;
    for (LampState& lamp : other.lamps) {
      lamp.axis = chance.direction();
      lamp.factor = lamp.factor > 0 ? 0 : 2;
    }
    scene->set(other);
    expect_true_irradiance(*scene);
  }
}

TEST(Campaign, ALampHasTheIrradianceOfItsShape) {
  for (const double radius : {0.02, 0.2, 2.0, 20.0}) {
    LampShape lamp;
    lamp.axis = {0, 0, 1};  // Normal 0 of the lattice is 1.8 degrees away.
    lamp.half_width_rad = lamp.half_height_rad = radius * kDeg;
    lamp.radiance = {1, 1, 1};
    const double sine = std::sin(radius * kDeg), expected = std::numbers::pi * sine * sine;
    const double got = luminance(rasterized(lamp, 1024).irradiance, 0);
    // A radius of 0.2 degrees is half a pixel: 16 samples of each of four pixels.
    EXPECT_NEAR(got, expected, (radius < 1 ? 0.3 : 0.02) * expected) << radius;
  }
}

TEST(Campaign, AGroupIsDeterminedByItsNumber) {
  int generated = 0;
  for (std::uint32_t number = 0; number < 6; ++number) {
    Result<Group> first = draw_group(number);
    if (!first) continue;  // The eighteen panoramas that only figures need may be missing.
    ++generated;
    const Group second = std::move(*draw_group(number));
    EXPECT_EQ(first->scene.name(), second.scene.name());
    EXPECT_EQ(first->config, second.config);
    EXPECT_EQ(first->rig().lenses.size(), second.rig().lenses.size());
    ASSERT_EQ(first->frames.size(), static_cast<std::size_t>(kGroupFrames));
    for (std::size_t i = 0; i < first->frames.size(); ++i) {
      EXPECT_EQ(first->frames[i].light, second.frames[i].light);
      EXPECT_EQ(first->frames[i].yaw_rad, second.frames[i].yaw_rad);
    }
    EXPECT_TRUE(first->rig().validate().ok()) << first->lens;
  }
  EXPECT_GT(generated, 1);
}

}  // namespace
}  // namespace lightwell::measure
