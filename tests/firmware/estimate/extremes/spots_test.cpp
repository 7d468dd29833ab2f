// Hot pixels, suns and lamps in all directions.
#include <utility>

#include <gtest/gtest.h>

#include "firmware/estimate/extremes/rows.hpp"

namespace lightwell::extremes {
namespace {

TEST(ExtremeSpots, HotPixelIsOneLight) {
  const SpotRow row = hot_pixel(20);
  EXPECT_EQ(row.lost, 0) << row.worst_case;
  // The direction of a single pixel is its middle.
  EXPECT_LE(row.worst_direction_deg, 0.001) << row.worst_case;
  EXPECT_LE(row.worst_energy, 1e-5);
  EXPECT_EQ(row.tally.lies(), 0) << row.tally.worst_case << row.tally.unsound_case << row.tally.silent_case;
}

class SunOf : public testing::TestWithParam<const char*> {};

TEST_P(SunOf, IsDetectedOnPoleSeamEdgeAndBetweenLenses) {
  const Place places[] = {Place::pole, Place::seam, Place::lens_edge, Place::between_lenses};
  const std::vector<SpotRow> rows = suns(GetParam(), 640, places);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(rows[i].lost, 0) << name_of(places[i]) << " " << rows[i].worst_case;
    // Pixels of 0.4 to 0.56 degrees are about as wide as the sun: pixels below half of the peak are not in the core, so
    // that the centroid is off by up to 0.3 degrees.
    EXPECT_LE(rows[i].worst_direction_deg, 0.3) << name_of(places[i]) << " " << rows[i].worst_case;
    // Relative to the energy in the pixels. Pixels below 2 % of the peak are not included.
    EXPECT_LE(rows[i].worst_energy, 0.02) << name_of(places[i]);
    EXPECT_EQ(rows[i].tally.flagged, 0) << name_of(places[i]);
    EXPECT_EQ(rows[i].tally.missed, 0) << name_of(places[i]) << " " << rows[i].tally.worst_case;
    EXPECT_EQ(rows[i].tally.lies(), 0) << rows[i].tally.unsound_case << rows[i].tally.silent_case;
  }
}

INSTANTIATE_TEST_SUITE_P(EveryRig, SunOf, testing::Values("pair", "double_sphere", "equirect"));

TEST(ExtremeSpots, SunOnThePoleOfAWideEquirectangularImageIsALight) {
  // Each of the 1280 pixels around the pole contains a part of the sun.
  const Place places[] = {Place::pole};
  const SpotRow row = suns("equirect", 1280, places)[0];
  EXPECT_EQ(row.lost, 0) << row.worst_case;
  EXPECT_EQ(row.tally.lies(), 0) << row.tally.worst_case;
}

TEST(ExtremeSpots, DirectionErrorIsBelowATenthOfADegree) {
  // Pixels of 0.17 degrees: a lamp of half a degree is three pixels wide.
  const RigParameters fine = rig_of("pair", 1280, 960);
  for (const double diameter : {0.5, 2.0}) {
    const SpotRow row = light_direction(fine, diameter, 10, Setting::balanced);
    EXPECT_EQ(row.lost, 0) << row.worst_case;
    EXPECT_LE(row.worst_direction_deg, 0.1) << row.worst_case;
    EXPECT_EQ(row.tally.lies(), 0) << row.tally.silent_case;
  }
  // Pixels of 0.34 degrees: partly covered pixels determine the direction of a lamp of half a degree.
  const RigParameters coarse = rig_of("pair", 640, 480);
  for (const Setting setting : kSettings)
    for (const double diameter : {5.0, 2.0, 1.0, 0.5}) {
      const SpotRow row = light_direction(coarse, diameter, 20, setting);
      EXPECT_EQ(row.lost, 0) << row.worst_case;
      EXPECT_LE(row.worst_direction_deg, 0.1) << to_string(setting) << " " << row.worst_case;
    }
}

}  // namespace
}  // namespace lightwell::extremes
