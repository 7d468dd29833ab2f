// Images of any size, lenses with a small field of view, missing cameras, and very many frames.
#include <gtest/gtest.h>

#include "firmware/estimate/extremes/rows.hpp"

namespace lightwell::extremes {
namespace {

TEST(ExtremeSizes, BoundHoldsFromOnePixelOn) {
  const SightRow row = sizes();
  EXPECT_EQ(row.tally.unsound, 0) << row.tally.unsound_case;
  EXPECT_EQ(row.tally.silent, 0) << row.tally.silent_case;
  EXPECT_EQ(row.tally.missed, 0) << row.tally.worst_case;
}

TEST(ExtremeCoverage, PartialCoverageIsReportedAndFlagged) {
  const SightRow row = coverage();
  EXPECT_EQ(row.tally.unsound, 0) << row.tally.unsound_case;
  EXPECT_EQ(row.tally.silent, 0) << row.tally.silent_case;
  EXPECT_EQ(row.tally.flagged, row.tally.answers);
  // Tolerance: a rim of half a pixel of 0.3 degrees around a hemisphere.
  EXPECT_LE(row.worst, 0.0013) << row.worst_case;
}

TEST(ExtremeCoverage, WithOneCameraMissingIsThatOfTheOther) {
  const SightRow row = camera_gone();
  EXPECT_EQ(row.tally.unsound, 0) << row.tally.unsound_case;
  EXPECT_EQ(row.tally.silent, 0) << row.tally.silent_case;
  EXPECT_EQ(row.tally.flagged, row.tally.answers);
  // Tolerance: a rim of half a pixel of 0.8 degrees around a hemisphere.
  EXPECT_LE(row.worst, 0.0035) << row.worst_case;
}

TEST(ExtremeFrames, ManyFramesCauseNoDrift) {
  const DriftRow row = many_frames(20'000);
  EXPECT_EQ(row.tally.refused, 0);
  EXPECT_EQ(row.tally.unsound, 0);
  EXPECT_EQ(row.tally.flagged, 0);
  // The same image gives identical results.
  EXPECT_EQ(row.still, 0);
  // Influence of the frames before the third cycle: exp(-100 / 7.5) of the noise.
  EXPECT_LE(row.noisy, 1e-5);
  EXPECT_EQ(row.lamp, 0) << "without noise, earlier frames must have no influence";
  EXPECT_GT(row.highest_track, 0U) << "the lamp was not detected";
}

}  // namespace
}  // namespace lightwell::extremes
