// Two lamps close from 20 degrees to 0 and part again, a tenth of a degree a frame.
#include <gtest/gtest.h>

#include "firmware/estimate/extremes/rows.hpp"

namespace lightwell::extremes {
namespace {

void expect_calm(const TwoLightsRow& row) {
  // What both together send stays what it is; a coefficient is rounded by a twentieth of the limit at most.
  EXPECT_LE(row.worst_energy, 0.005);
  // A change between two choices that each keep the limit of 1 %.
  EXPECT_LE(row.worst_jump, 0.02) << row.worst_case;
  EXPECT_EQ(row.flickers, 0) << "the choice leaves and comes back within ten frames";
  // One number each, and a new one for the lamp that parts.
  EXPECT_LE(row.tracks, 3);
  EXPECT_EQ(row.tally.refused, 0);
  EXPECT_EQ(row.tally.missed, 0) << row.tally.worst_case;
  EXPECT_EQ(row.tally.lies(), 0) << row.tally.unsound_case << row.tally.silent_case;
}

TEST(ExtremeTwoLights, AlikeCloseAndPartWithoutJumpsOrFlicker) {
  for (const double epsilon : {0.01, 0.0})
    expect_calm(two_lights(choice(Setting::balanced, epsilon), PixelFormat::rgb_f32, 1));
}

TEST(ExtremeTwoLights, UnlikeKeepTheirNumbersWhereverTheyAreTold) {
  for (const Setting setting : {Setting::fast, Setting::exact}) {
    const TwoLightsRow row = two_lights(choice(setting, 0), PixelFormat::rgb_f32, 0.6);
    expect_calm(row);
    EXPECT_EQ(row.swaps, 0);
  }
}

TEST(ExtremeTwoLights, ThroughANoisySensorCloseAndPartWithoutFlicker) {
  const TwoLightsRow unlike = two_lights(choice(Setting::balanced, 0.01), PixelFormat::rgb8, 0.6);
  expect_calm(unlike);
  EXPECT_EQ(unlike.swaps, 0);
}

}  // namespace
}  // namespace lightwell::extremes
