#include "bench/median_cut.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "bench/scenes.hpp"

namespace lightwell::bench {
namespace {

namespace ref = lightwell::reference;
using scenes::Scene;

Triple total_of(const std::vector<CutLight>& lights) {
  Triple sum{};
  for (const CutLight& l : lights) {
    for (std::size_t c = 0; c < 3; ++c) sum[c] += l.irradiance[c];
  }
  return sum;
}

double luminance_of(const CutLight& l) { return ref::luminance({l.irradiance[0], l.irradiance[1], l.irradiance[2]}); }

TEST(MedianCut, ConservesEnergyAndSolidAngle) {
  const Scene scene(scenes::lamp_in_room(256, {1, 2, -3}));
  const auto lights = median_cut(scene.image());
  ASSERT_EQ(lights.size(), 64U);
  const ref::Rgb mean = ref::mean_radiance(scene.panorama);
  double sphere = 0;
  for (const CutLight& l : lights) sphere += l.solid_angle_sr;
  EXPECT_NEAR(sphere, 4 * ref::pi, 1e-9);  // the same sums in another order
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(total_of(lights)[c] / (4 * ref::pi * mean[c]), 1, 1e-9);
}

TEST(MedianCut, LightsHaveAboutTheSameEnergy) {
  const Scene scene(scenes::smooth(512));
  const auto lights = median_cut(scene.image());
  const Triple sum = total_of(lights);
  const double each = ref::luminance({sum[0], sum[1], sum[2]}) / 64;
  // Cuts are between pixels: for regions of at least 40 columns or rows, up to half a column is misplaced in each of
  // six generations.
  for (const CutLight& l : lights) EXPECT_NEAR(luminance_of(l) / each, 1, 0.08);
}

TEST(MedianCut, DirectionsOfAConstantAreCentroidsOfTheirRegions) {
  const Scene scene(ref::constant(256, 128, {1, 1, 1}));
  Triple first_moment{};
  for (const CutLight& l : median_cut(scene.image())) {
    EXPECT_NEAR(std::hypot(l.direction[0], l.direction[1], l.direction[2]), 1, 1e-12);
    for (std::size_t c = 0; c < 3; ++c) first_moment[c] += l.solid_angle_sr * l.direction[c];
  }
  // The regions tile the sphere symmetrically: their centroids cancel except for their different spread (a few
  // percent).
  for (const double m : first_moment) EXPECT_NEAR(m / (4 * ref::pi), 0, 0.02);
}

TEST(MedianCut, IrradianceIsNearTheReference) {
  const Scene room(scenes::smooth(256)), lamp(scenes::lamp_in_room(256, {1, 2, -3}));
  // 64 point lights for 0.2 sr each sample the cosine's kink at the horizon in steps of 0.44 rad.
  EXPECT_LT(scenes::error_of(room.panorama, median_cut(room.image())).rms, 0.03);
  EXPECT_LT(scenes::error_of(lamp.panorama, median_cut(lamp.image())).rms, 0.03);
  EXPECT_LT(scenes::error_of(room.panorama, median_cut(room.image(), 10)).rms,
            scenes::error_of(room.panorama, median_cut(room.image())).rms);
}

TEST(MedianCut, ALampIsRepresentedByItsOwnLights) {
  const ref::V3 where = ref::normalised({1, 2, -3});
  const Scene scene(scenes::lamp_in_room(256, where));
  double near = 0, all = 0;
  for (const CutLight& l : median_cut(scene.image())) {
    all += luminance_of(l);
    if (ref::angle_deg(where, {l.direction[0], l.direction[1], l.direction[2]}) < 3) near += luminance_of(l);
  }
  const ref::Panorama room = scenes::smooth(256);
  const double lamp_share =
      1 - ref::luminance(ref::mean_radiance(room)) / ref::luminance(ref::mean_radiance(scene.panorama));
  EXPECT_NEAR(near / all, lamp_share, 0.05);  // Regions at its rim include some of the room; two of 64 are 3 %.
}

TEST(MedianCut, HandlesSmallAndBlackImages) {
  EXPECT_TRUE(median_cut({}).empty());
  const Scene one(ref::constant(1, 1, {1, 2, 3})), few(ref::constant(4, 2, {1, 1, 1})),
      black(ref::constant(64, 32, {0, 0, 0}));
  EXPECT_EQ(median_cut(one.image()).size(), 1U);
  EXPECT_EQ(median_cut(few.image()).size(), 8U);
  for (const CutLight& l : median_cut(black.image())) {
    EXPECT_EQ(luminance_of(l), 0);
    EXPECT_TRUE(std::isfinite(l.direction[0]));
  }
}

}  // namespace
}  // namespace lightwell::bench
