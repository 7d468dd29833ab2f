// Spread of a light's direction by other models than the best one.
#include "estimate/marker/direction_spread.hpp"

#include <cmath>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "firmware/estimate/marker/lit_body.hpp"

namespace lightwell::marker {
namespace {

using test::kDegree;
using test::towards;

/// A fit of these lights whose BIC is `bic`.
Fit fit_of(std::vector<PointLight> lights, double bic) {
  Fit out;
  out.model.lights = std::move(lights);
  out.ground_deviance = bic;
  return out;
}

PointLight light(double azimuth_deg, double irradiance) {
  return {towards(azimuth_deg, 40), 0, {irradiance, irradiance, irradiance}};
}

TEST(ModelSpread, WithoutOtherModelsIsZero) {
  const DirectionSpread spread = model_spread({fit_of({light(0, 1)}, 0), {}}, 0);
  EXPECT_EQ(spread.covariance.norm(), 0);
  EXPECT_EQ(spread.elsewhere, 0);
}

TEST(ModelSpread, WhichOfTwoLightsIsStrongerDoesNotMatter) {
  const FitCandidates candidates{fit_of({light(0, 1), light(100, 0.9)}, 0),
                                 {fit_of({light(1, 0.9), light(101, 1)}, 0)}};
  for (std::size_t which : {0u, 1u}) {
    const DirectionSpread spread = model_spread(candidates, which);
    EXPECT_EQ(spread.elsewhere, 0) << which;
    EXPECT_LT(std::sqrt(spread.covariance.trace()), 1 * kDegree) << which;
  }
}

TEST(ModelSpread, AModelWithoutTheLightCountsByItsStrongest) {
  const FitCandidates candidates{fit_of({light(0, 1), light(100, 0.9)}, 0),
                                 {fit_of({light(-60, 0.2), light(100, 1)}, 0)}};
  const DirectionSpread spread = model_spread(candidates, 0);
  EXPECT_NEAR(spread.elsewhere, 0.5, 1e-12);
  const double angle = angle_between(light(0, 1).direction, light(100, 1).direction);
  EXPECT_NEAR(spread.covariance.trace(), angle * angle / 2, 1e-9);
}

TEST(ModelSpread, AModelThatIsLessLikelyCountsLess) {
  const auto elsewhere = [](double bic) {
    return model_spread({fit_of({light(0, 1)}, 0), {fit_of({light(100, 1)}, bic)}}, 0).elsewhere;
  };
  EXPECT_GT(elsewhere(2), elsewhere(8));
  EXPECT_GT(elsewhere(8), 0);
  EXPECT_EQ(elsewhere(100), 0);
}

}  // namespace
}  // namespace lightwell::marker
