// Invalid input is flagged, and no descriptor contains NaN.
#include <gtest/gtest.h>

#include "firmware/estimate/extremes/rows.hpp"

namespace lightwell::extremes {
namespace {

void expect_honest(const Tally& tally) {
  EXPECT_GT(tally.answers, 0);
  EXPECT_EQ(tally.unsound, 0) << tally.unsound_case;
  EXPECT_EQ(tally.silent, 0) << tally.silent_case;
  EXPECT_EQ(tally.missed, 0) << tally.worst_case;
}

TEST(ExtremeNumbers, BlackFloatsAreFlaggedDark) { expect_honest(all_black(PixelFormat::rgb_f32)); }
TEST(ExtremeNumbers, BlackCodesAreFlaggedDark) { expect_honest(all_black(PixelFormat::rgb8)); }

TEST(ExtremeNumbers, SaturationIsFlaggedClippedAndALowerBound) {
  const Tally tally = all_saturated();
  expect_honest(tally);
  EXPECT_EQ(tally.flagged, tally.answers);
}

TEST(ExtremeNumbers, InvalidPixelIsFlaggedAndReplaced) { expect_honest(nonsense(Extent::one_pixel)); }
TEST(ExtremeNumbers, InvalidRowIsFlaggedAndReplaced) { expect_honest(nonsense(Extent::one_row)); }
TEST(ExtremeNumbers, InvalidFrameIsFlagged) { expect_honest(nonsense(Extent::everywhere)); }

TEST(ExtremeNumbers, HugeAndTinyRadianceIsValidOrFlagged) { expect_honest(huge()); }
TEST(ExtremeNumbers, ALampOfTwelveDecadesIsEncoded) { expect_honest(bright_pixel_on_the_wire()); }
TEST(ExtremeNumbers, RandomBitsGiveValidDescriptors) { expect_honest(random_bits(60)); }

TEST(ExtremeNumbers, ImpossibleExposuresAreRefused) {
  const SightRow row = exposures();
  expect_honest(row.tally);
  // 0, -0, -1, NaN and two infinities, as exposure and as gain, with floats and codes, for six configurations.
  EXPECT_GE(row.tally.refused, 6 * 2 * 2 * 6);
}

}  // namespace
}  // namespace lightwell::extremes
