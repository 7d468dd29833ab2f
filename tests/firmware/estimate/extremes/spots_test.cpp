// Hot pixels, suns and lamps, wherever they stand.
#include <utility>

#include <gtest/gtest.h>

#include "firmware/estimate/extremes/rows.hpp"

namespace lightwell::extremes {
namespace {

TEST(ExtremeSpots, OneHotPixelIsOneLightThere) {
  const SpotRow row = hot_pixel(20);
  EXPECT_EQ(row.lost, 0) << row.worst_case;
  // Its middle is all that is known of where in the pixel the light is.
  EXPECT_LE(row.worst_direction_deg, 0.001) << row.worst_case;
  EXPECT_LE(row.worst_energy, 1e-5);
  EXPECT_EQ(row.tally.lies(), 0) << row.tally.worst_case << row.tally.unsound_case << row.tally.silent_case;
}

class SunOf : public testing::TestWithParam<const char*> {};

TEST_P(SunOf, HalfADegreeIsFoundOnPoleSeamEdgeAndBetweenLenses) {
  const Place places[] = {Place::pole, Place::seam, Place::lens_edge, Place::between_lenses};
  const std::vector<SpotRow> rows = suns(GetParam(), 640, places);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(rows[i].lost, 0) << name_of(places[i]) << " " << rows[i].worst_case;
    // Pixels of 0.4 to 0.56 degrees, about as wide as the sun: one that holds less than half the brightest is not of
    // the region, so that the centroid misses by up to 0.3 of the first and 0.5 of the second.
    EXPECT_LE(rows[i].worst_direction_deg, 0.3) << name_of(places[i]) << " " << rows[i].worst_case;
    // Of what the pixels hold. Those below 2 % of the peak are not gathered.
    EXPECT_LE(rows[i].worst_energy, 0.02) << name_of(places[i]);
    EXPECT_EQ(rows[i].tally.flagged, 0) << name_of(places[i]);
    EXPECT_EQ(rows[i].tally.missed, 0) << name_of(places[i]) << " " << rows[i].tally.worst_case;
    EXPECT_EQ(rows[i].tally.lies(), 0) << rows[i].tally.unsound_case << rows[i].tally.silent_case;
  }
}

INSTANTIATE_TEST_SUITE_P(EveryRig, SunOf, testing::Values("pair", "double_sphere", "equirect"));

TEST(ExtremeSpots, ASunOverThePoleOfAWideEquirectangularPictureIsStillALight) {
  // Each of the 1280 pixels around the pole holds some of it.
  const Place places[] = {Place::pole};
  const SpotRow row = suns("equirect", 1280, places)[0];
  EXPECT_EQ(row.lost, 0) << row.worst_case;
  EXPECT_EQ(row.tally.lies(), 0) << row.tally.worst_case;
}

TEST(ExtremeSpots, LampsAnywhereAreWithinATenthOfADegree) {
  // Pixels of 0.17 degrees, so that a lamp of half a degree is three wide.
  const RigParameters fine = rig_of("pair", 1280, 960);
  for (const double diameter : {0.5, 2.0}) {
    const SpotRow row = light_direction(fine, diameter, 10, Setting::balanced);
    EXPECT_EQ(row.lost, 0) << row.worst_case;
    EXPECT_LE(row.worst_direction_deg, 0.1) << row.worst_case;
    EXPECT_EQ(row.tally.lies(), 0) << row.tally.silent_case;
  }
  // Pixels of 0.34 degrees: the pixels that a lamp of half a degree covers in part tell where it is.
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
