// GroundTruth of lightwell-eval against the reference implementations.
#include <cmath>

#include <gtest/gtest.h>

#include "reference/bright_region.hpp"
#include "reference/ggx.hpp"
#include "reference/irradiance.hpp"
#include "tools/lightwell_eval/ground_truth.hpp"

namespace lightwell::eval {
namespace {

namespace ref = reference;

/// A sky, a red wall, and a sun of two degrees in a generic direction.
Radiance place(Vec3d d) {
  const double sun = angle_between(d, normalized(Vec3d{0.3, 0.5, -0.8})) < 0.018 ? 5e4 : 0;
  const double sky = d.y > 0 ? 2 + 3 * d.y : 0.4;
  return {static_cast<float>(sky + sun + (d.x < -0.5 ? 4 : 0)), static_cast<float>(sky + sun),
          static_cast<float>(1.5 * sky + sun)};
}

class GroundTruthTest : public ::testing::Test {
 protected:
  GroundTruthTest() : panorama_(sim::from_function(512, place)), truth_(panorama_) {
    oracle_.width = panorama_.width;
    oracle_.height = panorama_.height;
    oracle_.rgb.assign(panorama_.rgb.begin(), panorama_.rgb.end());
  }
  static ref::V3 v3(Vec3d d) { return {d.x, d.y, d.z}; }

  sim::Panorama panorama_;
  GroundTruth truth_;
  ref::Panorama oracle_;
};

TEST_F(GroundTruthTest, NormalsMatchTheReference) {
  const std::vector<ref::V3> normals = ref::fibonacci_normals(2048);
  ASSERT_EQ(truth_normals().size(), normals.size());
  for (std::size_t k = 0; k < normals.size(); ++k) EXPECT_LT(ref::length(normals[k] - v3(truth_normals()[k])), 1e-12);
}

TEST_F(GroundTruthTest, IrradianceMatchesTheReference) {
  std::vector<ref::V3> normals;
  for (std::size_t k = 0; k < 2048; k += 16) normals.push_back(v3(truth_normals()[k]));
  const std::vector<ref::Rgb> truth = ref::irradiance_at(oracle_, normals);
  std::vector<ref::Rgb> got;
  for (std::size_t k = 0; k < 2048; k += 16) got.push_back(truth_.irradiances()[k]);
  EXPECT_LT(ref::irradiance_error(truth, got).rms, 1e-4);
}

TEST_F(GroundTruthTest, TheBrightestRegionMatchesTheReference) {
  const auto region = ref::bright_region(oracle_);
  ASSERT_TRUE(region);
  EXPECT_LT(ref::angle_deg(region->direction, v3(truth_.brightest())), 1e-6);
  EXPECT_NEAR(truth_.peak_to_mean() / region->peak_to_mean, 1, 1e-6);
}

TEST_F(GroundTruthTest, ReflectionsMatchTheReference) {
  for (const Vec3d d :
       {Vec3d{0, 1, 0}, Vec3d{-1, 0, 0}, normalized(Vec3d{0.3, 0.4, -0.8}), normalized(Vec3d{0.2, -0.7, 0.3})}) {
    for (const double roughness : {0.3271, 0.5}) {
      const ref::Rgb truth = ref::radiance_ggx(oracle_, v3(d), roughness);
      const Color got = truth_.radiance(d, roughness);
      // Tolerance: the sun is up to half a degree from the centre of its patch, on the slope of a lobe 12 degrees wide.
      for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(got[c] / truth[c], 1, 1e-2) << roughness;
    }
  }
}

TEST(GroundTruthOfDarkness, HasNoBrightestRegion) {
  const GroundTruth truth(sim::from_function(32, [](Vec3d) { return Radiance{}; }));
  EXPECT_EQ(truth.peak_to_mean(), 0);
}

}  // namespace
}  // namespace lightwell::eval
