// Generated rooms: scaled, rotated, and with a thousand lamps.
#include <gtest/gtest.h>

#include "firmware/estimate/extremes/rows.hpp"

namespace lightwell::extremes {
namespace {

TEST(ExtremeRooms, ScaleWithRadianceOverSixteenDecades) {
  const ScaleRow row = radiance_scaled(3, Steps::powers_of_two);
  // Required precision before encoding: 1e-5. Powers of two scale every float of the image exactly.
  EXPECT_LE(row.worst, 1e-5) << row.worst_case;
  EXPECT_EQ(row.tally.refused, 0);
  EXPECT_EQ(row.tally.flagged, 0) << "this radiance is in the valid range";
  EXPECT_EQ(row.tally.lies(), 0) << row.tally.worst_case << row.tally.unsound_case << row.tally.silent_case;
}

TEST(ExtremeRooms, IrradianceScalesInSpiteOfPixelRounding) {
  const ScaleRow row = radiance_scaled(2, Steps::decades);
  // A pixel that crosses a threshold by rounding moves light between a cap and the bands; their total irradiance
  // changes by at most an eighth of the limit, which is 2 % at `fast`.
  EXPECT_LE(row.worst_irradiance, 2.5e-3) << row.worst_irradiance_case;
  EXPECT_EQ(row.tally.lies(), 0) << row.tally.worst_case << row.tally.unsound_case << row.tally.silent_case;
}

TEST(ExtremeRooms, ScaleWithExposureOverSixteenDecades) {
  const ScaleRow row = exposure_scaled(1);
  EXPECT_LE(row.worst, 1e-5) << row.worst_case;
  EXPECT_EQ(row.tally.refused, 0);
  EXPECT_EQ(row.tally.lies(), 0) << row.tally.unsound_case << row.tally.silent_case;
}

TEST(ExtremeRooms, AreRotationInvariant) {
  const TurnRow row = turned_rooms(3, 3);
  // The truth is within both bounds, so that the difference is at most their sum.
  EXPECT_EQ(row.beyond_both_bounds, 0);
  // Twice the limit of 1 % of each descriptor.
  EXPECT_LE(row.worst, 0.02);
  // A quarter of a pixel of one degree: whether pixels at half the peak belong to the core depends on the grid.
  EXPECT_LE(row.worst_direction_deg, 0.25);
  EXPECT_EQ(row.tally.lies(), 0) << row.tally.worst_case << row.tally.unsound_case << row.tally.silent_case;
}

TEST(ExtremeRooms, AThousandLightsStayWithinBoundAndLimit) {
  const Tally tally = thousand_lights(2);
  EXPECT_EQ(tally.refused, 0);
  EXPECT_EQ(tally.missed, 0) << tally.worst_case;
  EXPECT_EQ(tally.lies(), 0) << tally.unsound_case << tally.silent_case;
}

}  // namespace
}  // namespace lightwell::extremes
