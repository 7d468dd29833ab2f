// The shadow of the body on tables with a texture or a smooth brightness, on samples from closed forms.
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "estimate/marker/lighting_estimate.hpp"
#include "firmware/estimate/marker/estimate_errors.hpp"
#include "firmware/estimate/marker/lit_body.hpp"

namespace lightwell::marker {
namespace {

using test::error_deg;
using test::LitBody;
using test::mahalanobis;
using test::towards;

constexpr Rgb kWhite = {1, 1, 1};

/// Answers for lamps all around, 20 to 65 degrees high, on tables with a texture.
struct TexturedTables {
  int trials = 0, wrong = 0;
  std::vector<double> errors_deg;  ///< Of the answers that are not uncertain.
};

TexturedTables on_textured_tables(double texture, double lamp) {
  TexturedTables out;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(0, 1);
  for (unsigned seed = 0; seed < 20; ++seed) {
    const Vec3d truth = towards(360 * unit(random) - 180, 20 + 45 * unit(random));
    const LitBody body{.lamps = {{truth, 1 / 0.8, {lamp, lamp, lamp}}},
                       .ambient = 0.5,
                       .turn_deg = 72 * unit(random),
                       .camera_elevation_deg = 40,
                       .table = true,
                       .table_albedo = 0.3,
                       .table_texture = texture,
                       .sample_noise = 0.005,
                       .surface_noise = 0.007,
                       .floor_noise = 0.005,
                       .seed = seed};
    const LightingEstimate light = estimate_lighting(body.shading());
    ++out.trials;
    if (light.uncertain) continue;
    out.errors_deg.push_back(error_deg(light, truth));
    out.wrong += out.errors_deg.back() > 10 || mahalanobis(light.lights[0], truth) > 11.83 ? 1 : 0;
  }
  std::ranges::sort(out.errors_deg);
  return out;
}

TEST(GroundShadow, ShadowsOnTexturedTablesAreObserved) {
  for (const double texture : {0.1, 0.2}) {
    const TexturedTables seen = on_textured_tables(texture, 1);
    const std::size_t sure = seen.errors_deg.size();
    // The faces alone leave 14 of 20 uncertain.
    ASSERT_GE(sure, 17U) << texture;
    EXPECT_LT(seen.errors_deg[sure / 2], 1.5) << texture;
    EXPECT_LT(seen.errors_deg[sure * 9 / 10], 5) << texture;
    // A squared distance above 11.83 has a probability of 0.27 %.
    EXPECT_LE(seen.wrong, 1) << texture;
  }
}

TEST(GroundShadow, TexturesAreNotTakenForShadows) {
  for (const double texture : {0.1, 0.3})
    EXPECT_TRUE(on_textured_tables(texture, 0).errors_deg.empty()) << "a table without a lamp, texture " << texture;
}

TEST(GroundShadow, BrightnessOfTheTableThatVariesSmoothlyIsNotAShadow) {
  for (const double slope : {1.0, 2.0, 4.0}) {
    LitBody body{.lamps = {}, .ambient = 0.5, .table = true, .table_albedo = 0.3, .table_texture = 0.05};
    Shading shading = body.shading();
    for (GroundSample& t : shading.ground->samples)
      t.radiance *= std::max(0.05, 1 + slope * t.position.x + slope * slope * t.position.x * t.position.z);
    EXPECT_NE(estimate_lighting(shading).surround_model, SurroundModel::ground_plane_with_shadow) << slope;
  }
}

TEST(GroundShadow, ShadowBesideASmoothBrightnessOfTheTableIsUsed) {
  constexpr double kReach_m = 0.2;
  for (const double azimuth : {110.0, 150.0, 180.0, 230.0})
    for (const double slope : {0.5, -0.5}) {
      const LitBody body{.lamps = {{towards(azimuth, 40), 0, kWhite}},
                         .ambient = 0.3,
                         .camera_elevation_deg = 35,
                         .table = true,
                         .table_albedo = 0.3,
                         .sample_noise = 0.002};
      Shading shading = body.shading();
      for (GroundSample& t : shading.ground->samples) t.radiance *= 1 + slope * t.position.x / kReach_m;
      const LightingEstimate light = estimate_lighting(shading);
      EXPECT_EQ(light.surround_model, SurroundModel::ground_plane_with_shadow) << azimuth << " deg, slope " << slope;
      EXPECT_FALSE(light.uncertain) << azimuth << " deg, slope " << slope;
      ASSERT_FALSE(light.lights.empty()) << azimuth << " deg, slope " << slope;
      EXPECT_LT(error_deg(light, towards(azimuth, 40)), 1.5) << azimuth << " deg, slope " << slope;
    }
}

}  // namespace
}  // namespace lightwell::marker
