// Standard deviations of a fit, on samples from closed forms with known errors.
#include "estimate/marker/light_fit.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "firmware/estimate/marker/lit_body.hpp"

namespace lightwell::marker {
namespace {

using test::LitBody;
using test::towards;

/// Reduced chi square of matte faces on a plain table with exact lights.
constexpr double kUsualChiSquare = 0.25;

/// A fit from a start 3 degrees off. `noise`: relative standard deviation of each sample.
Fit fit_of(double noise) {
  const LitBody body{.lamps = {{towards(30, 40), 0, {1, 1, 1}}}, .sample_noise = noise, .seed = 3};
  const Shading shading = body.shading();
  const Observations observations(shading);
  return fit_lights(observations, {{towards(33, 40), 0, {}}}, {Distance::infinite}, ObservationSet::faces,
                    shading.hull);
}

double reduced_chi_square(const Fit& fit) { return fit.chi_square / (fit.observations - fit.parameters); }

double sigma_of(const Fit& fit) { return std::sqrt(fit.covariance.at(0)(0, 0) + fit.covariance.at(0)(1, 1)); }

TEST(LightFit, SigmaGrowsWithTheRootOfChiSquare) {
  const Fit exact = fit_of(0);
  EXPECT_LT(reduced_chi_square(exact), kUsualChiSquare);
  EXPECT_EQ(exact.dispersion(), 1);
  int below = 0, above = 0;
  double previous = 0;
  for (const double noise : {0.001, 0.002, 0.004, 0.007, 0.01, 0.015}) {
    const Fit fit = fit_of(noise);
    const double reduced = reduced_chi_square(fit), factor = std::max(1.0, std::sqrt(reduced / kUsualChiSquare));
    (reduced < kUsualChiSquare ? below : above)++;
    // 10 %: the samples' weights and the direction change with the noise.
    EXPECT_NEAR(sigma_of(fit) / (factor * sigma_of(exact)), 1, 0.1) << noise << ", chi square " << reduced;
    EXPECT_GE(sigma_of(fit), 0.9 * previous) << noise;
    previous = sigma_of(fit);
  }
  EXPECT_GE(below, 1);
  EXPECT_GE(above, 2);
}

TEST(LightFit, FitsWithoutDegreesOfFreedomHaveAFiniteDispersion) {
  Fit fit;
  fit.parameters = fit.observations = 7;
  EXPECT_EQ(fit.dispersion(), 1);
  fit.chi_square = 1, fit.parameters = 9;
  EXPECT_EQ(fit.dispersion(), 1 / kUsualChiSquare);
}

TEST(LightFit, FinerSamplesOfThePlaneShareTheErrorsOfTheShadowsModel) {
  GroundPlane plane;
  plane.point = {0, -0.05, 0};
  plane.normal = {0, 1, 0};
  plane.step_m = 0.02;
  plane.samples = {{.position = {0.1, -0.05, 0}, .radiance = 1}, {.position = {0.12, -0.05, 0}, .radiance = 1}};
  const Eigen::ArrayXd usual = GroundObservations(plane, std::nullopt).own_variance;
  ASSERT_GT(usual.minCoeff(), 0);
  plane.density = 4;
  const Eigen::ArrayXd dense = GroundObservations(plane, std::nullopt).own_variance;
  // Four samples in the place of one weigh as much as it. 1e-9: rounding.
  for (Eigen::Index i = 0; i < 2; ++i) EXPECT_NEAR(dense[i] / usual[i], 4, 1e-9) << i;
}

}  // namespace
}  // namespace lightwell::marker
