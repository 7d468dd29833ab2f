// Tests of absolute_scale.hpp.
#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calibration/solve/photometry/picture.hpp"

namespace lightwell::photometry {
namespace {

using ::testing::HasSubstr;

const PatchMean kPatch{{0.2, 0.4, 0.3}, {1e-4, 1e-4, 1e-4}, 1000};
constexpr std::array<double, 3> kBalance{2, 1, 4.0 / 3};

TEST(AbsoluteScale, FollowsTheEquationOfRadiance) {
  // radiance = x / (exposure gain vignetting) * balance * scale: 0.4 / (0.01 * 2 * 0.8) = 25 in each channel.
  const auto found = solve_absolute_scale(kPatch, kBalance, {0.01, 2, 0.8}, *luminance_reading(100, 0.04));
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_NEAR(found->nits_per_unit, 100.0 / 25, 1e-5);
  EXPECT_NEAR(found->deviation / found->nits_per_unit, 0.04, 0.0001)
      << "the meter's uncertainty; the patch's is negligible";
}

TEST(AbsoluteScale, ALuxMeterOnAGreyCardIsALuminanceMeter) {
  const auto reading = illuminance_reading(1000, 0.18, 0.03, 0.04);
  ASSERT_TRUE(reading.ok());
  EXPECT_NEAR(reading->nits, 1000 * 0.18 / std::numbers::pi, 1e-9);
  EXPECT_NEAR(reading->deviation, 0.05, 1e-12);
}

TEST(AbsoluteScale, RefusesInvalidReadings) {
  for (const double bad : {0.0, -1.0, std::nan(""), static_cast<double>(INFINITY)}) {
    EXPECT_FALSE(luminance_reading(bad).ok());
    EXPECT_FALSE(illuminance_reading(bad, 0.18).ok());
  }
  EXPECT_THAT(illuminance_reading(100, 1.2).status().message(), HasSubstr("albedo must be above 0 and at most 1"));
  EXPECT_THAT(illuminance_reading(100, 0).status().message(), HasSubstr("albedo"));
  EXPECT_FALSE(luminance_reading(100, -0.1).ok());
  const MeterReading reading{100, 0.04};
  EXPECT_THAT(solve_absolute_scale(kPatch, kBalance, {0, 1, 1}, reading).status().message(),
              HasSubstr("exposure and gain"));
  EXPECT_THAT(solve_absolute_scale(kPatch, kBalance, {0.01, 1, 0}, reading).status().message(),
              HasSubstr("into the middle"));
  EXPECT_FALSE(solve_absolute_scale({{0, 0.4, 0.3}, {}, 100}, kBalance, {0.01, 1, 1}, reading).ok());
}

}  // namespace
}  // namespace lightwell::photometry
