// Maximum-entropy radiance: it reproduces the irradiance of the faces, is nowhere negative and is close to the truth
// between the faces.
#include "estimate/marker/max_entropy_radiance.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/harmonics.hpp>

#include "estimate/marker/shading.hpp"
#include "firmware/estimate/marker/lit_body.hpp"

namespace lightwell::marker::test {
namespace {

constexpr int kBand = 4;

/// Irradiance of the result at a normal, green channel.
double irradiance_at(const MaxEntropyRadiance& light, Vec3d normal, const std::vector<Vec3d>& toward = {}) {
  double e = evaluate(irradiance_of(light.radiance), vec_cast<float>(normal)).g;
  for (std::size_t k = 0; k < toward.size(); ++k) e += light.lights[k][1] * std::max(0.0, dot(toward[k], normal));
  return e;
}

std::vector<SurfaceSample> samples_of(const std::vector<Vec3d>& normals, const std::vector<double>& irradiance) {
  std::vector<SurfaceSample> out;
  for (std::size_t i = 0; i < normals.size(); ++i)
    for (int k = 0; k < 4; ++k)
      out.push_back(
          {normals[i] * kInradius, normals[i], {irradiance[i], irradiance[i], irradiance[i]}, {}, static_cast<int>(i)});
  return out;
}

/// Three lamps in different directions in a dim room.
LitBody room() {
  LitBody body;
  body.ambient = 0.4;
  body.lamps = {
      {towards(60, 20), 0, {1, 1, 1}}, {towards(-80, 50), 0, {0.6, 0.6, 0.6}}, {towards(10, -30), 0, {0.4, 0.4, 0.4}}};
  return body;
}

double truth(const LitBody& body, Vec3d normal) {
  double e = body.ambient;
  for (const PointLight& lamp : body.lamps) e += lamp.irradiance[1] * std::max(0.0, dot(lamp.direction, normal));
  return e;
}

TEST(MaxEntropyRadiance, EqualIrradiancesGiveUniformRadiance) {
  LitBody body;
  body.ambient = 2;
  const auto light = max_entropy_radiance(body.shading().samples, {}, kBand);
  ASSERT_TRUE(light);
  for (const Vec3d& normal : fibonacci_directions(100))
    EXPECT_NEAR(irradiance_at(*light, normal), 2, 2e-3) << "tolerance: error of the sum over directions";
}

TEST(MaxEntropyRadiance, ReproducesTheIrradianceOfTheFaces) {
  const LitBody body = room();
  const Shading shading = body.shading();
  const auto light = max_entropy_radiance(shading.samples, {}, kBand);
  ASSERT_TRUE(light);
  for (const SurfaceSample& s : shading.samples) {
    // Three standard deviations of a face: kSurfaceSigmaFloor times the largest irradiance.
    EXPECT_NEAR(irradiance_at(*light, s.normal), s.irradiance[1], 3 * 0.015 * 2);
  }
}

TEST(MaxEntropyRadiance, IsCloseToTheTruthBetweenTheFaces) {
  const LitBody body = room();
  const auto light = max_entropy_radiance(body.shading().samples, {}, kBand);
  ASSERT_TRUE(light);
  double squares = 0, off = 0;
  for (const Vec3d& normal : fibonacci_directions(400)) {
    if (dot(normal, towards(0, body.camera_elevation_deg)) < 0.5) continue;
    squares += std::pow(truth(body, normal), 2);
    off += std::pow(irradiance_at(*light, normal) - truth(body, normal), 2);
  }
  EXPECT_LT(std::sqrt(off / squares), 0.1) << "relative RMS error over normals within 60 degrees of the camera";
}

TEST(MaxEntropyRadiance, IsNonnegativeForInconsistentFaces) {
  const LitBody body = room();
  // A black face among bright ones: no light reproduces that.
  std::vector<SurfaceSample> samples = body.shading().samples;
  for (SurfaceSample& s : samples)
    if (s.surface == 1) s.irradiance = {};
  const auto light = max_entropy_radiance(samples, {}, kBand);
  ASSERT_TRUE(light);
  for (const Vec3d& normal : fibonacci_directions(200)) {
    EXPECT_TRUE(std::isfinite(irradiance_at(*light, normal)));
    EXPECT_GT(irradiance_at(*light, normal), -0.02) << "tolerance: ringing by the last band";
  }
}

TEST(MaxEntropyRadiance, OneFaceGivesASymmetricRadiance) {
  const auto light = max_entropy_radiance(samples_of({{0, 1, 0}}, {3}), {}, kBand);
  ASSERT_TRUE(light);
  EXPECT_NEAR(irradiance_at(*light, {0, 1, 0}), 3, 0.05);
  EXPECT_NEAR(irradiance_at(*light, {1, 0, 0}), irradiance_at(*light, {0, 0, 1}), 1e-2) << "rotational symmetry";
}

TEST(MaxEntropyRadiance, PeakIsMovedToTheLightAndTheSumIsConserved) {
  LitBody body;
  body.ambient = 0.3;
  body.lamps = {{towards(20, 30), 0, {2, 2, 2}}};
  const Shading shading = body.shading();
  const std::vector<Vec3d> toward = {body.lamps[0].direction, -body.lamps[0].direction};
  const auto split = max_entropy_radiance(shading.samples, toward, kBand),
             whole = max_entropy_radiance(shading.samples, {}, kBand);
  ASSERT_TRUE(split && whole);
  EXPECT_GT(split->lights[0][1], 0.1);
  EXPECT_LT(split->lights[0][1], 2) << "at most the lamp's irradiance";
  EXPECT_LT(split->lights[1][1], 0.25 * split->lights[0][1]) << "no peak in directions that no face observes";
  for (const SurfaceSample& s : shading.samples)
    EXPECT_NEAR(irradiance_at(*split, s.normal, toward), irradiance_at(*whole, s.normal), 0.05)
        << "tolerance: a peak of 20 degrees replaced by a point";
}

TEST(MaxEntropyRadiance, ScalesWithTheLight) {
  const LitBody body = room();
  const Shading shading = body.shading();
  const auto light = max_entropy_radiance(shading.samples, {}, kBand);
  ASSERT_TRUE(light);
  for (const double scale : {1e-20, 1e20}) {
    std::vector<SurfaceSample> samples = shading.samples;
    for (SurfaceSample& s : samples)
      for (double& e : s.irradiance) e *= scale;
    const auto scaled = max_entropy_radiance(samples, {}, kBand);
    ASSERT_TRUE(scaled);
    for (const Vec3d& normal : fibonacci_directions(20))
      EXPECT_NEAR(irradiance_at(*scaled, normal) / scale, irradiance_at(*light, normal), 1e-4);
  }
}

TEST(MaxEntropyRadiance, ReproducesHundredsOfSamplesOfABall) {
  const LitBody body = room();
  std::vector<Vec3d> normals;
  std::vector<double> irradiance;
  for (const Vec3d& normal : fibonacci_directions(400)) {
    if (dot(normal, towards(0, 26)) < 0.2) continue;
    normals.push_back(normal);
    irradiance.push_back(truth(body, normal));
  }
  const auto light = max_entropy_radiance(samples_of(normals, irradiance), {}, kBand);
  ASSERT_TRUE(light);
  for (std::size_t i = 0; i < normals.size(); ++i)
    EXPECT_NEAR(irradiance_at(*light, normals[i]), irradiance[i], 3 * 0.015 * 2);
}

TEST(MaxEntropyRadiance, WithoutLightGivesNoResult) {
  EXPECT_FALSE(max_entropy_radiance({}, {}, kBand));
  EXPECT_FALSE(max_entropy_radiance(samples_of({{0, 1, 0}, {1, 0, 0}}, {0, 0}), {}, kBand));
  EXPECT_FALSE(max_entropy_radiance(samples_of({{0, 1, 0}}, {std::numeric_limits<double>::quiet_NaN()}), {}, kBand));
  EXPECT_FALSE(max_entropy_radiance(samples_of({{0, 1, 0}}, {std::numeric_limits<double>::infinity()}), {}, kBand));
}

}  // namespace
}  // namespace lightwell::marker::test
