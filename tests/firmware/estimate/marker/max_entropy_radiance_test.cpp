// Light that faces alone tell: it explains them, it is never negative, and it is no more than that.
#include "estimate/marker/max_entropy_radiance.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/harmonics.hpp>

#include "estimate/marker/fibonacci_directions.hpp"
#include "firmware/estimate/marker/lit_body.hpp"

namespace lightwell::marker::test {
namespace {

constexpr int kBand = 4;

/// What the answer makes of a surface that faces there, green.
double lit(const MaxEntropyRadiance& light, Vec3d normal, const std::vector<Vec3d>& toward = {}) {
  double e = evaluate(irradiance_of(light.radiance), vec_cast<float>(normal)).g;
  for (std::size_t k = 0; k < toward.size(); ++k) e += light.lamps[k][1] * std::max(0.0, dot(toward[k], normal));
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

/// Three panes of light from different sides over a dim room.
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

TEST(MostEvenLight, FacesThatGetTheSameAreInEvenLight) {
  LitBody body;
  body.ambient = 2;
  const auto light = max_entropy_radiance(body.shading().samples, {}, {}, kBand);
  ASSERT_TRUE(light);
  for (const Vec3d& normal : fibonacci_directions(100))
    EXPECT_NEAR(lit(*light, normal), 2, 2e-3) << "the directions are a sum's";
}

TEST(MostEvenLight, ExplainsTheFacesItWasMadeFrom) {
  const LitBody body = room();
  const Shading shading = body.shading();
  const auto light = max_entropy_radiance(shading.samples, {}, {}, kBand);
  ASSERT_TRUE(light);
  for (const SurfaceSample& s : shading.samples) {
    // Three deviations of what a face may be off by: ErrorModel's share of the brightest.
    EXPECT_NEAR(lit(*light, s.normal), s.irradiance[1], 3 * 0.015 * 2);
  }
}

TEST(MostEvenLight, IsNearTheTruthBetweenTheFaces) {
  const LitBody body = room();
  const auto light = max_entropy_radiance(body.shading().samples, {}, {}, kBand);
  ASSERT_TRUE(light);
  double squares = 0, off = 0;
  for (const Vec3d& normal : fibonacci_directions(400)) {
    if (dot(normal, towards(0, body.camera_elevation_deg)) < 0.5) continue;
    squares += std::pow(truth(body, normal), 2);
    off += std::pow(lit(*light, normal) - truth(body, normal), 2);
  }
  EXPECT_LT(std::sqrt(off / squares), 0.1) << "what is asked of rooms, over normals within 60 degrees of the camera";
}

TEST(MostEvenLight, IsNeverLessThanNothingWhateverTheFacesGet) {
  const LitBody body = room();
  // A face that is black among bright ones: no light explains that.
  std::vector<SurfaceSample> samples = body.shading().samples;
  for (SurfaceSample& s : samples)
    if (s.surface == 1) s.irradiance = {};
  const auto light = max_entropy_radiance(samples, {}, {}, kBand);
  ASSERT_TRUE(light);
  for (const Vec3d& normal : fibonacci_directions(200)) {
    EXPECT_TRUE(std::isfinite(lit(*light, normal)));
    EXPECT_GT(lit(*light, normal), -0.02) << "a band's end rings by less";
  }
}

TEST(MostEvenLight, OneFaceTellsHowMuchAndNotWhereFrom) {
  const auto light = max_entropy_radiance(samples_of({{0, 1, 0}}, {3}), {}, {}, kBand);
  ASSERT_TRUE(light);
  EXPECT_NEAR(lit(*light, {0, 1, 0}), 3, 0.05);
  EXPECT_NEAR(lit(*light, {1, 0, 0}), lit(*light, {0, 0, 1}), 1e-2) << "all sides are alike";
}

TEST(MostEvenLight, WhatStandsOutAboutALampIsTheLampsAndTheSumStays) {
  LitBody body;
  body.ambient = 0.3;
  body.lamps = {{towards(20, 30), 0, {2, 2, 2}}};
  const Shading shading = body.shading();
  const std::vector<Vec3d> toward = {body.lamps[0].direction, -body.lamps[0].direction};
  const auto split = max_entropy_radiance(shading.samples, {}, toward, kBand),
             whole = max_entropy_radiance(shading.samples, {}, {}, kBand);
  ASSERT_TRUE(split && whole);
  EXPECT_GT(split->lamps[0][1], 0.1);
  EXPECT_LT(split->lamps[0][1], 2) << "no more than the lamp has";
  EXPECT_LT(split->lamps[1][1], 0.25 * split->lamps[0][1]) << "little stands out where no face looks";
  for (const SurfaceSample& s : shading.samples)
    EXPECT_NEAR(lit(*split, s.normal, toward), lit(*whole, s.normal), 0.05)
        << "20 degrees of light taken for its middle";
}

TEST(MostEvenLight, ScalesWithTheLight) {
  const LitBody body = room();
  const Shading shading = body.shading();
  const auto light = max_entropy_radiance(shading.samples, {}, {}, kBand);
  ASSERT_TRUE(light);
  for (const double scale : {1e-20, 1e20}) {
    std::vector<SurfaceSample> samples = shading.samples;
    for (SurfaceSample& s : samples)
      for (double& e : s.irradiance) e *= scale;
    const auto scaled = max_entropy_radiance(samples, {}, {}, kBand);
    ASSERT_TRUE(scaled);
    for (const Vec3d& normal : fibonacci_directions(20))
      EXPECT_NEAR(lit(*scaled, normal) / scale, lit(*light, normal), 1e-4);
  }
}

TEST(MostEvenLight, HundredsOfSamplesOfABallAreOneLight) {
  const LitBody body = room();
  std::vector<Vec3d> normals;
  std::vector<double> irradiance;
  for (const Vec3d& normal : fibonacci_directions(400)) {
    if (dot(normal, towards(0, 26)) < 0.2) continue;
    normals.push_back(normal);
    irradiance.push_back(truth(body, normal));
  }
  const auto light = max_entropy_radiance(samples_of(normals, irradiance), {}, {}, kBand);
  ASSERT_TRUE(light);
  for (std::size_t i = 0; i < normals.size(); ++i) EXPECT_NEAR(lit(*light, normals[i]), irradiance[i], 3 * 0.015 * 2);
}

TEST(MostEvenLight, OfNothingNothingIsTold) {
  EXPECT_FALSE(max_entropy_radiance({}, {}, {}, kBand));
  EXPECT_FALSE(max_entropy_radiance(samples_of({{0, 1, 0}, {1, 0, 0}}, {0, 0}), {}, {}, kBand));
  EXPECT_FALSE(max_entropy_radiance(samples_of({{0, 1, 0}}, {std::numeric_limits<double>::quiet_NaN()}), {}, {}, kBand));
  EXPECT_FALSE(max_entropy_radiance(samples_of({{0, 1, 0}}, {std::numeric_limits<double>::infinity()}), {}, {}, kBand));
}

}  // namespace
}  // namespace lightwell::marker::test
