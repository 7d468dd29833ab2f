// Rooms of generated light: scaled, turned, and with a thousand lamps.
#include <gtest/gtest.h>

#include "firmware/estimate/extremes/rows.hpp"

namespace lightwell::extremes {
namespace {

TEST(ExtremeRooms, RadianceTimesSixteenDecadesIsTheAnswerTimesAsMuch) {
  const ScaleRow row = radiance_scaled(3, Steps::powers_of_two);
  // The 1e-5 before the wire. Factors of two scale every float of the picture to the bit.
  EXPECT_LE(row.worst, 1e-5) << row.worst_case;
  EXPECT_EQ(row.tally.refused, 0);
  EXPECT_EQ(row.tally.flagged, 0) << "such light is not out of range";
  EXPECT_EQ(row.tally.lies(), 0) << row.tally.worst_case << row.tally.unsound_case << row.tally.silent_case;
}

TEST(ExtremeRooms, WhereDecadesRoundPixelsTheIrradianceScalesStill) {
  const ScaleRow row = radiance_scaled(2, Steps::decades);
  // A pixel that rounding puts on the other side of a threshold moves light between a cap and the bands; what is lit by
  // both together feels an eighth of the limit at most, which is 2 % at fast.
  EXPECT_LE(row.worst_irradiance, 2.5e-3) << row.worst_irradiance_case;
  EXPECT_EQ(row.tally.lies(), 0) << row.tally.worst_case << row.tally.unsound_case << row.tally.silent_case;
}

TEST(ExtremeRooms, TheSameCodesExposedSixteenDecadesLongerAreAsMuchLessLight) {
  const ScaleRow row = exposure_scaled(1);
  EXPECT_LE(row.worst, 1e-5) << row.worst_case;
  EXPECT_EQ(row.tally.refused, 0);
  EXPECT_EQ(row.tally.lies(), 0) << row.tally.unsound_case << row.tally.silent_case;
}

TEST(ExtremeRooms, AProbeThatTurnsAnyWaySeesTheRoomTurned) {
  const TurnRow row = turned_rooms(3, 3);
  // One truth is within both bounds: the difference is at most their sum.
  EXPECT_EQ(row.beyond_both_bounds, 0);
  // Twice the limit of 1 % that each answer keeps.
  EXPECT_LE(row.worst, 0.02);
  // A quarter of the pixel of one degree: pixels at half the peak fall in or out as the grid lies.
  EXPECT_LE(row.worst_direction_deg, 0.25);
  EXPECT_EQ(row.tally.lies(), 0) << row.tally.worst_case << row.tally.unsound_case << row.tally.silent_case;
}

TEST(ExtremeRooms, AThousandLampsAreWithinTheBoundAndNoMoreThanAllowed) {
  const Tally tally = thousand_lights(2);
  EXPECT_EQ(tally.refused, 0);
  EXPECT_EQ(tally.missed, 0) << tally.worst_case;
  EXPECT_EQ(tally.lies(), 0) << tally.unsound_case << tally.silent_case;
}

}  // namespace
}  // namespace lightwell::extremes
