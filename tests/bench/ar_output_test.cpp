#include "bench/ar_output.hpp"

#include <gtest/gtest.h>

#include "bench/scenes.hpp"
#include "reference/bright_region.hpp"
#include "reference/harmonics.hpp"

namespace lightwell::bench {
namespace {

namespace ref = lightwell::reference;
using scenes::Scene;

// Rounding error of a sum in double in another order.
constexpr double kSameSum = 1e-9;

TEST(ArOutput, NineCoefficientsEqualTheReferenceProjection) {
  const Scene scene(scenes::lamp_in_room(128, {1, 2, -3}));
  const auto oracle = ref::project(scene.panorama, 2);
  const NineCoefficients got = nine_coefficients(scene.image());
  for (std::size_t k = 0; k < 9; ++k) {
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(got[k][c], oracle[k][c], kSameSum) << k << " " << c;
  }
}

TEST(ArOutput, IrradianceOfCoefficientsEqualsTheReference) {
  const Scene scene(scenes::lamp_in_room(128, {-1, 1, 1}));
  const auto oracle = ref::project(scene.panorama, 2);
  const ArkitOutput out = arkit_output(scene.image());
  for (const ref::V3& n : ref::fibonacci_normals(64)) {
    const ref::Rgb want = ref::irradiance_from_sh(oracle, n);
    const Triple got = irradiance_of(out, {n.x, n.y, n.z});
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(got[c], want[c], kSameSum);
  }
}

TEST(ArOutput, SmoothSceneIsExactForBoth) {
  const Scene scene(scenes::smooth(256));
  // The scene has only bands 0 to 2; the remaining error is that of the pixel rule, (2 pi / 128)^2 / 24 = 1e-4.
  EXPECT_LT(scenes::error_of(scene.panorama, arkit_output(scene.image())).rms, 1e-4);
}

TEST(ArOutput, MainLightIsTheReferenceBrightRegion) {
  // In the centre, on the seam, and at both poles.
  for (const ref::V3 d : {ref::V3{0.2, 0.3, -1}, {0.01, 0.2, 1}, {0.02, 1, 0.01}, {0.03, -1, -0.02}}) {
    const Scene scene(scenes::lamp_in_room(256, d));
    const auto oracle = ref::bright_region(scene.panorama);
    const ArcoreOutput out = arcore_output(scene.image());
    ASSERT_TRUE(oracle);
    EXPECT_LT(ref::angle_deg({out.main_direction[0], out.main_direction[1], out.main_direction[2]}, oracle->direction),
              1e-6);
    // The reference integral includes the room behind the lamp (a few of 900), this one does not.
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(out.main_irradiance[c] / oracle->radiance_integral[c], 1, 0.01);
  }
}

TEST(ArOutput, TheBrightRegionIsConnectedAcrossAPole) {
  // Two bright pixels of the top row, 180 degrees apart, are neighbours only across the pole.
  ref::Panorama p = ref::constant(16, 8, {0.1, 0.1, 0.1});
  ref::set_pixel(p, 3, 0, {10, 10, 10});
  ref::set_pixel(p, 11, 0, {10, 10, 10});
  const Scene scene(p);
  const ArcoreOutput out = arcore_output(scene.image());
  EXPECT_LT(ref::angle_deg({out.main_direction[0], out.main_direction[1], out.main_direction[2]}, {0, 1, 0}), 1e-6);
  EXPECT_NEAR(out.main_irradiance[0], 2 * 9.9 * ref::pixel_solid_angle(0, 16, 8), 1e-6);  // floats hold 0.1 to 1e-8
}

TEST(ArOutput, WithAMainLightALampInARoomIsNearlyExact) {
  const Scene scene(scenes::lamp_in_room(256, {0.2, 0.3, -1}));
  const double without = scenes::error_of(scene.panorama, arkit_output(scene.image())).rms;
  const double with = scenes::error_of(scene.panorama, arcore_output(scene.image())).rms;
  EXPECT_GT(without, 0.01);  // Nine coefficients cannot represent a lamp: 0.9 to 7.5 % error on real scenes.
  // Rim pixels below half the peak stay in the ambient part: a tenth of the lamp; a fifth at a radius of 2.3 pixels.
  EXPECT_LT(with, 0.2 * without);
}

TEST(ArOutput, MainLightAndAmbientAddUp) {
  const Scene scene(scenes::lamp_in_room(128, {1, 0.5, 0.2}));
  const ArcoreOutput out = arcore_output(scene.image());
  const NineCoefficients total = nine_coefficients(scene.image());
  // Band 0 is the integral of radiance divided by sqrt(4 pi); the parts of light and ambient add up to it.
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_NEAR(out.ambient[0][c] + out.main_irradiance[c] * 0.28209479177387814, total[0][c], kSameSum);
}

TEST(ArOutput, BlackHasNoMainLight) {
  const Scene scene(ref::constant(16, 8, {0, 0, 0}));
  const ArcoreOutput out = arcore_output(scene.image());
  EXPECT_EQ(out.main_irradiance, (Triple{0, 0, 0}));
  EXPECT_EQ(irradiance_of(out, {0, 1, 0}), (Triple{0, 0, 0}));
}

TEST(ArOutput, ThePhaseChangesOnlySignsOfOddM) {
  NineCoefficients ones;
  ones.fill({1, 1, 1});
  const NineCoefficients phased = to_condon_shortley(ones);
  const std::array<double, 9> signs{1, -1, 1, -1, 1, -1, 1, -1, 1};
  for (std::size_t k = 0; k < 9; ++k) EXPECT_EQ(phased[k][1], signs[k]) << k;
  EXPECT_EQ(to_condon_shortley(phased), ones);
}

}  // namespace
}  // namespace lightwell::bench
