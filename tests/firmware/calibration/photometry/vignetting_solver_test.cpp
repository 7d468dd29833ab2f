// Tests of solve_vignetting().
#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calibration/model/response.hpp"
#include "calibration/solve/photometry/vignetting.hpp"

namespace lightwell::photometry {
namespace {

using ::testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kField = 95 * kDegree;

PhotometricCalibration lens(double v1, double v2, double v3) {
  PhotometricCalibration p;
  p.vignetting = {v1, v2, v3};
  return p;
}

std::vector<LampObservation> observations(const PhotometricCalibration& truth, double from = 0, double to = 95,
                                          int count = 40) {
  std::vector<LampObservation> out;
  for (int i = 0; i < count; ++i) {
    const double angle = (from + (to - from) * i / (count - 1)) * kDegree;
    out.push_back({angle, 7 * vignetting(truth, angle), 0});
  }
  return out;
}

TEST(VignettingSolver, ExactObservationsAreFittedExactly) {
  const auto found = solve_vignetting(observations(lens(-0.25, 0.05, -0.006)), kField);
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_NEAR(found->vignetting[0], -0.25, 1e-9);
  EXPECT_NEAR(found->vignetting[1], 0.05, 1e-9);
  EXPECT_NEAR(found->vignetting[2], -0.006, 1e-9);
  EXPECT_NEAR(found->level, 7, 1e-9) << "the level is estimated, not given";
}

TEST(VignettingSolver, OutliersAreRejected) {
  std::vector<LampObservation> seen = observations(lens(-0.08, 0.005, 0));
  for (const std::size_t k : {3U, 17U, 18U, 39U}) seen[k].value *= 0.5;
  const auto found = solve_vignetting(seen, kField);
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_NEAR(found->vignetting[0], -0.08, 1e-6);
  EXPECT_EQ(found->outliers, 4);
}

TEST(VignettingSolver, StandardDeviationsAreUsedAsWeights) {
  // Every second observation has an error of 5 %, with that standard deviation.
  std::vector<LampObservation> seen = observations(lens(-0.08, 0.005, 0));
  for (std::size_t k = 0; k < seen.size(); ++k) {
    seen[k].deviation = k % 2 == 0 ? 0.001 : 0.5;
    if (k % 2 == 1) seen[k].value *= 1.05;
  }
  const auto found = solve_vignetting(seen, kField);
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_NEAR(found->vignetting[0], -0.08, 0.001);
}

std::string refused(const std::vector<LampObservation>& seen, double field = kField) {
  const auto found = solve_vignetting(seen, field);
  EXPECT_FALSE(found.ok());
  EXPECT_EQ(found.status().code(), StatusCode::invalid_argument);
  return found.status().message();
}

TEST(VignettingSolver, RefusesInsufficientAngles) {
  const PhotometricCalibration truth = lens(-0.08, 0.005, 0);
  EXPECT_THAT(refused(observations(truth, 0, 95, 5)), HasSubstr("at least 8"));
  EXPECT_THAT(refused(observations(truth, 0, 60)), HasSubstr("no observation is further from the axis than 60.0 deg"));
  EXPECT_THAT(refused(observations(truth, 40, 95)), HasSubstr("nearer to the axis"));
  EXPECT_THAT(refused(observations(truth, 0, 120)), HasSubstr("outside the field"));
  std::vector<LampObservation> gap = observations(truth, 0, 20, 20);
  const std::vector<LampObservation> far = observations(truth, 80, 95, 20);
  gap.insert(gap.end(), far.begin(), far.end());
  EXPECT_THAT(refused(gap), HasSubstr("nothing between 20.0 and 80.0 deg"));
  EXPECT_THAT(refused(observations(truth), 0), HasSubstr("half the field"));
}

TEST(VignettingSolver, RefusesInvalidValues) {
  std::vector<LampObservation> seen = observations(lens(-0.08, 0.005, 0));
  seen[20].value = 0;
  EXPECT_THAT(refused(seen), HasSubstr("not positive"));
  seen[20].value = std::nan("");
  EXPECT_THAT(refused(seen), HasSubstr("not positive"));
}

TEST(VignettingSolver, RefusesAFieldWithoutLightAtTheEdge) {
  // Vignetting of 0.01 at the edge is below the limit of a calibration.
  std::vector<LampObservation> seen = observations(lens(0, 0, 0));
  for (LampObservation& s : seen) s.value = 1 - 0.99 * std::pow(s.angle_rad / kField, 2);
  EXPECT_THAT(refused(seen), HasSubstr("lower max_angle_deg"));
}

}  // namespace
}  // namespace lightwell::photometry
