// Pictures of any size, lenses that see little, cameras that are gone, and very many frames.
#include <gtest/gtest.h>

#include "firmware/estimate/extremes/rows.hpp"

namespace lightwell::extremes {
namespace {

TEST(ExtremeSizes, FromOnePixelOnTheBoundHoldsOrIsInfiniteAndFlagged) {
  const SightRow row = sizes();
  EXPECT_EQ(row.tally.unsound, 0) << row.tally.unsound_case;
  EXPECT_EQ(row.tally.silent, 0) << row.tally.silent_case;
  EXPECT_EQ(row.tally.missed, 0) << row.tally.worst_case;
}

TEST(ExtremeCoverage, OfZeroOneAndFortyNinePercentIsStatedAndFlagged) {
  const SightRow row = coverage();
  EXPECT_EQ(row.tally.unsound, 0) << row.tally.unsound_case;
  EXPECT_EQ(row.tally.silent, 0) << row.tally.silent_case;
  EXPECT_EQ(row.tally.flagged, row.tally.answers);
  // A rim of half a pixel of 0.3 degrees around a hemisphere.
  EXPECT_LE(row.worst, 0.0013) << row.worst_case;
}

TEST(ExtremeCoverage, OfAPairWhoseOneCameraIsGoneIsThatOfTheOther) {
  const SightRow row = camera_gone();
  EXPECT_EQ(row.tally.unsound, 0) << row.tally.unsound_case;
  EXPECT_EQ(row.tally.silent, 0) << row.tally.silent_case;
  EXPECT_EQ(row.tally.flagged, row.tally.answers);
  // A rim of half a pixel of 0.8 degrees around a hemisphere.
  EXPECT_LE(row.worst, 0.0035) << row.worst_case;
}

TEST(ExtremeFrames, ManyOfThemDoNotDrift) {
  const DriftRow row = many_frames(20'000);
  EXPECT_EQ(row.tally.refused, 0);
  EXPECT_EQ(row.tally.unsound, 0);
  EXPECT_EQ(row.tally.flagged, 0);
  // The same picture after the noise of the first has gone: to the bit.
  EXPECT_EQ(row.still, 0);
  // The smoother's memory of what was before the third cycle: exp(-100 / 7.5) of the noise.
  EXPECT_LE(row.noisy, 1e-5);
  EXPECT_EQ(row.lamp, 0) << "without noise nothing is remembered";
  EXPECT_GT(row.highest_track, 0U) << "the lamp is a light";
}

}  // namespace
}  // namespace lightwell::extremes
