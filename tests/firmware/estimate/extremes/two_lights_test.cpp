// Two lamps approach from 20 degrees to 0 and separate again, 0.1 degrees per frame.
#include <gtest/gtest.h>

#include "firmware/estimate/extremes/rows.hpp"

namespace lightwell::extremes {
namespace {

void expect_stable(const TwoLightsRow& row) {
  // The total energy is constant; rounding changes it by at most a twentieth of the limit.
  EXPECT_LE(row.worst_energy, 0.005);
  // A change between two selections with errors of at most 1 % each.
  EXPECT_LE(row.worst_jump, 0.02) << row.worst_case;
  EXPECT_EQ(row.flickers, 0) << "the selection changed and changed back within ten frames";
  // One track per lamp, and a new one after separation.
  EXPECT_LE(row.tracks, 3);
  EXPECT_EQ(row.tally.refused, 0);
  EXPECT_EQ(row.tally.missed, 0) << row.tally.worst_case;
  EXPECT_EQ(row.tally.lies(), 0) << row.tally.unsound_case << row.tally.silent_case;
}

TEST(ExtremeTwoLights, EqualLightsMergeAndSeparateWithoutJumps) {
  for (const double epsilon : {0.01, 0.0})
    expect_stable(two_lights(choice(Setting::balanced, epsilon), PixelFormat::rgb_f32, 1));
}

TEST(ExtremeTwoLights, UnequalLightsKeepTheirTracks) {
  for (const Setting setting : {Setting::fast, Setting::exact}) {
    const TwoLightsRow row = two_lights(choice(setting, 0), PixelFormat::rgb_f32, 0.6);
    expect_stable(row);
    EXPECT_EQ(row.swaps, 0);
  }
}

TEST(ExtremeTwoLights, NoisyLightsMergeAndSeparateWithoutJumps) {
  const TwoLightsRow unlike = two_lights(choice(Setting::balanced, 0.01), PixelFormat::rgb8, 0.6);
  expect_stable(unlike);
  EXPECT_EQ(unlike.swaps, 0);
}

}  // namespace
}  // namespace lightwell::extremes
