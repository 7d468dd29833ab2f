// A lens whose vignetting is not calibrated: an error that all samples of the faces share.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/quantile.hpp>

#include "estimate/marker/lighting_estimate.hpp"
#include "estimate/marker/observations.hpp"
#include "firmware/estimate/marker/lit_body.hpp"

namespace lightwell::marker {
namespace {

using test::LitBody;
using test::towards;

/// 40 degrees from the axis a quarter of the light is lost.
constexpr double kLoss = 0.5;

/// The body is 30 degrees off the axis, and 10 degrees wide. `loss`: per squared angle, of the picture.
Shading seen_beside_the_axis(const LitBody& body, double loss, double believed_sigma) {
  Shading out = body.shading();
  for (SurfaceSample& s : out.samples) {
    const double angle = 0.52 + s.position.x / 0.6;
    s.squared_angle = angle * angle;
    for (double& e : s.irradiance) e *= 1 - loss * s.squared_angle;
  }
  out.vignetting_sigma = believed_sigma;
  return out;
}

/// Errors of lamps all around the camera, rad.
std::vector<double> errors(double loss, double believed_sigma) {
  std::vector<double> out;
  for (const double azimuth : {-60.0, -40.0, -20.0, 0.0, 20.0, 40.0, 60.0})
    for (const double elevation : {30.0, 50.0}) {
      LitBody body;
      body.lamps = {PointLight{towards(azimuth, elevation), 0, {1, 1, 1}}};
      const LightingEstimate found = estimate_lighting(seen_beside_the_axis(body, loss, believed_sigma), nullptr, 1);
      out.push_back(found.lights.empty() ? 1 : angle_between(found.lights[0].light.direction, body.lamps[0].direction));
    }
  return out;
}

TEST(Vignetting, ThatIsNotCalibratedTurnsDirectionsLess) {
  const double unaware = median(errors(kLoss, 0)), aware = median(errors(kLoss, kLoss)),
               none = median(errors(0, kLoss));
  EXPECT_LT(aware, 0.6 * unaware) << unaware;
  EXPECT_LT(none, 0.005) << "without vignetting, the directions are those of the exact picture";
}

TEST(Vignetting, IsWhitenedAsItsCovariance) {
  LitBody body;
  body.lamps = {PointLight{towards(30, 40), 0, {1, 1, 1}}};
  const Shading shading = seen_beside_the_axis(body, 0, kLoss);
  const Observations with(shading);
  Shading known = shading;
  known.vignetting_sigma = 0;
  const Observations without(known);
  // One standard deviation of it, relative to the mean of the samples.
  double middle = 0;
  for (const SurfaceSample& s : with.face_samples()) middle += s.squared_angle / with.samples();
  Eigen::VectorXd effect(with.samples());
  for (Eigen::Index i = 0; i < effect.size(); ++i) {
    const SurfaceSample& s = with.face_samples()[static_cast<std::size_t>(i)];
    effect[i] = kLoss * (s.squared_angle - middle) * s.irradiance[0];
  }
  Eigen::VectorXd whitened = effect, as_noise = effect;
  with.whiten(0, whitened);
  without.whiten(0, as_noise);
  // v' (C + v v')^-1 v = q / (1 + q) with q = v' C^-1 v (Sherman & Morrison 1950).
  const double q = as_noise.squaredNorm();
  EXPECT_GT(q, 1);
  EXPECT_NEAR(whitened.squaredNorm(), q / (1 + q), 1e-9);
}

}  // namespace
}  // namespace lightwell::marker
