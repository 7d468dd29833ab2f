// Lighting estimated from a marker's faces and shadow, on samples from closed forms.
#include "estimate/marker/lighting_estimate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "firmware/estimate/marker/estimate_errors.hpp"
#include "firmware/estimate/marker/lit_body.hpp"

namespace lightwell::marker {
namespace {

using test::error_deg;
using test::kDegree;
using test::LitBody;
using test::mahalanobis;
using test::towards;

constexpr Rgb kWhite = {1, 1, 1};

TEST(LightingEstimate, DistantLampHasCorrectDirectionAndIrradiance) {
  const LitBody body{.lamps = {{towards(30, 40), 0, {2, 1.5, 1}}}};
  const LightingEstimate light = estimate_lighting(body.shading());
  ASSERT_EQ(light.lights.size(), 1U);
  EXPECT_LT(error_deg(light, towards(30, 40)), 0.2);
  EXPECT_FALSE(light.lights[0].distance_observable) << "a distant lamp has no falloff";
  EXPECT_FALSE(light.uncertain);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(light.lights[0].light.irradiance[c], body.lamps[0].irradiance[c], 0.02 * body.lamps[0].irradiance[c])
        << c;
    EXPECT_NEAR(light.ambient[0][c], 0.05, 0.02) << c;
  }
}

TEST(LightingEstimate, NearLampHasCorrectDistance) {
  for (const double azimuth : {0.0, 45.0, 90.0}) {
    const LitBody body{.lamps = {{towards(azimuth, 35), 1 / 0.3, kWhite}}};
    const LightingEstimate light = estimate_lighting(body.shading());
    ASSERT_EQ(light.lights.size(), 1U) << azimuth;
    EXPECT_TRUE(light.lights[0].distance_observable) << azimuth;
    EXPECT_NEAR(light.lights[0].distance_m(), 0.3, 0.05 * 0.3) << azimuth;
    EXPECT_NEAR(light.lights[0].distance_m(), 0.3, 3 * light.lights[0].distance_sigma_m()) << azimuth;
    // Path-traced pictures give 3 % (README).
    EXPECT_LT(light.lights[0].distance_sigma_m(), 0.06 * 0.3) << azimuth;
    EXPECT_LT(error_deg(light, towards(azimuth, 35)), 0.5) << azimuth;
  }
}

TEST(LightingEstimate, TrackedNearLampFollowsTheDistance) {
  LightingEstimate light = estimate_lighting(LitBody{.lamps = {{towards(45, 35), 1 / 0.3, kWhite}}}.shading());
  for (const double distance : {0.305, 0.31, 0.32}) {
    const LitBody body{.lamps = {{towards(45, 35), 1 / distance, kWhite}}};
    light = estimate_lighting(body.shading(), &light);
    ASSERT_TRUE(light.tracked) << distance;
    ASSERT_EQ(light.lights.size(), 1U) << distance;
    EXPECT_TRUE(light.lights[0].distance_observable) << distance;
    EXPECT_NEAR(distance * light.lights[0].light.inverse_distance, 1, 0.02) << distance;
    EXPECT_LT(light.lights[0].inverse_distance_sigma, 1) << distance;
  }
}

TEST(LightingEstimate, TrackingKeepsTheUncertaintyOfTheSearch) {
  const auto trace = [](const std::array<double, 3>& m) { return m[0] + m[2]; };
  int with_alternatives = 0;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  for (unsigned seed = 0; seed < 60; ++seed) {
    const Vec3d one = towards(360 * unit(random) - 180, 10 + 70 * unit(random)),
                two = towards(360 * unit(random) - 180, 10 + 70 * unit(random));
    const LitBody body{.lamps = {{one, 0, kWhite}, {two, 0, {0.5, 0.5, 0.5}}},
                       .turn_deg = 72 * unit(random),
                       .sample_noise = 0.005,
                       .seed = seed};
    const Shading shading = body.shading();
    const LightingEstimate searched = estimate_lighting(shading), tracked = estimate_lighting(shading, &searched);
    if (!tracked.tracked || searched.lights.empty()) continue;
    const LightEstimate &before = searched.lights[0], &after = tracked.lights.at(0);
    // The minima of the two fits differ slightly.
    EXPECT_GT(trace(after.direction_covariance), 0.9 * trace(before.direction_covariance)) << seed;
    // Counts the cases in which other directions and models contribute much to the covariance.
    with_alternatives += before.fit_variance < 0.8 * trace(before.direction_covariance) ? 1 : 0;
  }
  EXPECT_GE(with_alternatives, 1) << "no case tests the contribution of other directions and models";
}

TEST(LightingEstimate, TrackedDistantLampStaysDistant) {
  const LitBody body{.lamps = {{towards(30, 40), 0, kWhite}}};
  const LightingEstimate first = estimate_lighting(body.shading());
  const LightingEstimate light = estimate_lighting(body.shading(), &first);
  ASSERT_TRUE(light.tracked);
  ASSERT_EQ(light.lights.size(), 1U);
  EXPECT_FALSE(light.lights[0].distance_observable);
  EXPECT_TRUE(std::isinf(light.lights[0].inverse_distance_sigma));
  EXPECT_LT(error_deg(light, towards(30, 40)), 0.2);
}

TEST(LightingEstimate, TwoLampsOfDifferentColourAreSeparated) {
  for (const double apart : {60.0, 90.0, 120.0}) {
    const Vec3d left = towards(-apart / 2, 35), right = towards(apart / 2, 30);
    // Two lamps close together illuminate the same faces; their shadows on the table separate them.
    const LitBody body{.lamps = {{left, 0, {1, 0.7, 0.4}}, {right, 0, {0.4, 0.6, 0.8}}}, .table = apart < 80};
    const LightingEstimate light = estimate_lighting(body.shading());
    ASSERT_EQ(light.lights.size(), 2U) << apart;
    EXPECT_LT(error_deg(light, left, 0), 2) << apart;
    EXPECT_LT(error_deg(light, right, 1), 2) << apart;
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(light.lights[0].light.irradiance[c] / body.lamps[0].irradiance[c], 1, 0.1) << apart;
      EXPECT_NEAR(light.lights[1].light.irradiance[c] / body.lamps[1].irradiance[c], 1, 0.1) << apart;
    }
  }
}

TEST(LightingEstimate, UniformLightHasNoLightsAndIsUncertain) {
  const LitBody body{.lamps = {}, .ambient = 0.7};
  const LightingEstimate light = estimate_lighting(body.shading());
  EXPECT_TRUE(light.lights.empty());
  EXPECT_TRUE(light.uncertain) << "a lamp behind the body would look the same";
  EXPECT_NEAR(light.ambient[0][1], 0.7, 0.01);
}

TEST(LightingEstimate, AGradientThatMayHideAStrongerLightIsUncertain) {
  const Vec3d lamp = towards(100, 40);
  const LitBody body{.lamps = {{lamp, 0, {0.3, 0.3, 0.3}}}, .table = true};
  for (const double gradient : {0.05, 1.2}) {
    Shading shading = body.shading();
    for (SurfaceSample& sample : shading.samples)
      for (double& v : sample.irradiance) v += gradient * (1 + dot(sample.normal, towards(0, 20)));
    const LightingEstimate light = estimate_lighting(shading, nullptr, 1);
    ASSERT_FALSE(light.lights.empty()) << gradient;
    EXPECT_LT(error_deg(light, lamp), 3) << gradient;
    EXPECT_EQ(light.uncertain, gradient > 0.5) << "as a lamp it has an irradiance of " << 2 * gradient;
  }
}

TEST(LightingEstimate, LampBehindTheBodyIsObservedByItsShadow) {
  for (const double azimuth : {135.0, 180.0}) {
    LitBody body{.lamps = {{towards(azimuth, 35), 1 / 0.61, kWhite}}, .turn_deg = 36, .camera_elevation_deg = 10};
    const LightingEstimate faces = estimate_lighting(body.shading());
    EXPECT_TRUE(faces.uncertain) << azimuth;
    body.table = true;
    const LightingEstimate shadow = estimate_lighting(body.shading());
    ASSERT_FALSE(shadow.lights.empty()) << azimuth;
    EXPECT_EQ(shadow.surround_model, SurroundModel::ground_plane_with_shadow) << azimuth;
    EXPECT_FALSE(shadow.uncertain) << azimuth;
    EXPECT_LT(error_deg(shadow, towards(azimuth, 35)), 2) << azimuth;
  }
}

TEST(LightingEstimate, LampsOfSimilarStrengthAreTwoLights) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    // Behind the body, 35 degrees apart: faces and shadow are nearly explained by one lamp between them.
    const LitBody body{.lamps = {{towards(160, 35), 1 / 1.2, kWhite}, {towards(-155, 30), 1 / 1.6, {0.8, 0.8, 0.8}}},
                       .ambient = 0.4,
                       .turn_deg = 17,
                       .camera_elevation_deg = 40,
                       .table = true,
                       .table_albedo = 0.3,
                       .table_texture = 0.02,
                       .sample_noise = 0.003,
                       .surface_noise = 0.005,
                       .seed = seed};
    const LightingEstimate light = estimate_lighting(body.shading());
    ASSERT_EQ(light.lights.size(), 2U) << seed;
    EXPECT_LT(std::min(error_deg(light, body.lamps[0].direction), error_deg(light, body.lamps[0].direction, 1)), 4)
        << seed;
  }
}

TEST(LightingEstimate, AShadowCountsMoreThanFacesThatTheModelDoesNotExplain) {
  for (const double azimuth : {-100.0, -40.0, 30.0, 120.0}) {
    const LitBody body{.lamps = {{towards(azimuth, 40), 0, kWhite}},
                       .ambient = 0.4,
                       .camera_elevation_deg = 40,
                       .table = true,
                       .table_albedo = 0.3,
                       .sample_noise = 0.003};
    Shading shading = body.shading();
    // Gloss: the irradiance of each face seems to vary by a quarter from side to side.
    for (SurfaceSample& s : shading.samples)
      for (double& e : s.irradiance) e *= 1 + 5 * dot(s.position, normalized(cross(s.normal, towards(20, 30))));
    const LightingEstimate light = estimate_lighting(shading);
    ASSERT_FALSE(light.lights.empty()) << azimuth;
    EXPECT_GT(light.face_dispersion, 2) << azimuth;
    EXPECT_LT(error_deg(light, body.lamps[0].direction), 4) << azimuth;
  }
}

TEST(LightingEstimate, GlossOnOneFaceIsNoLightBelowTheTable) {
  int shadows = 0, trials = 0;
  for (int k = 0; k < 12; ++k) {
    const Vec3d truth = towards(90 + 15.0 * k, 35);
    const LitBody body{.lamps = {{truth, 1 / 0.8, kWhite}},
                       .ambient = 0.3,
                       .camera_elevation_deg = 35,
                       .table = true,
                       .table_albedo = 0.3,
                       .sample_noise = 0.005,
                       .surface_noise = 0.007,
                       .seed = static_cast<unsigned>(k)};
    const Shading matte = body.shading();
    std::set<int> faces;
    for (const SurfaceSample& s : matte.samples) faces.insert(s.surface);
    for (const int face : faces) {
      Shading shading = matte;
      for (SurfaceSample& s : shading.samples)
        for (double& e : s.irradiance) e *= s.surface == face ? 1.3 : 1;
      const LightingEstimate light = estimate_lighting(shading);
      const bool shadow = light.surround_model == SurroundModel::ground_plane_with_shadow;
      ++trials, shadows += shadow ? 1 : 0;
      const auto what = [&] { return std::to_string(90 + 15 * k) + " deg, face " + std::to_string(face); };
      for (const LightEstimate& one : light.lights) {
        const double height = one.light.direction.y + test::kInradius * one.light.inverse_distance;
        // Without the shadow, the faces alone decide, and the answer says that it is uncertain.
        EXPECT_TRUE(height > 0 || (!shadow && light.uncertain)) << what() << ": " << height;
      }
      EXPECT_TRUE(light.uncertain || error_deg(light, truth) < 3) << what();
    }
  }
  // The shadow is clear: at most one answer in four is of the faces alone.
  EXPECT_GE(shadows, trials * 3 / 4);
}

TEST(LightingEstimate, GroundIsTheLightOfTheTableWithoutTheBody) {
  LitBody body{.lamps = {{towards(40, 40), 0, {1, 0.8, 0.6}}}, .ambient = 0.2, .table = true, .table_albedo = 0.35};
  const LightingEstimate light = estimate_lighting(body.shading());
  EXPECT_NE(light.surround_model, SurroundModel::distant);
  for (std::size_t c = 0; c < 3; ++c) {
    // Half of the table's exitance; the body's shadow covers a tenth of the sampled part.
    const double half = 0.35 * (0.2 + body.lamps[0].irradiance[c] * std::sin(40 * kDegree)) / 2;
    EXPECT_NEAR(light.ground[0][c], half, 0.03 * half) << c;
    EXPECT_NEAR(light.ground[2][c], -half, 0.03 * half) << "down, channel " << c;
  }
  body.table = false;
  EXPECT_EQ(estimate_lighting(body.shading()).ground, (std::array<Rgb, 4>{}));
}

TEST(LightingEstimate, GroundPlaneWithoutShadowIsNotUsed) {
  LitBody body{.lamps = {{towards(20, 40), 0, kWhite}}, .table = true};
  Shading shading = body.shading();
  for (std::size_t i = 0; i < shading.ground->samples.size(); ++i)
    shading.ground->samples[i].radiance = i % 2 == 0 ? 0.01 : 0.05;
  const LightingEstimate light = estimate_lighting(shading);
  EXPECT_NE(light.surround_model, SurroundModel::ground_plane_with_shadow) << "a chequered cloth";
  ASSERT_FALSE(light.lights.empty());
  EXPECT_LT(error_deg(light, towards(20, 40)), 0.5);
}

TEST(LightingEstimate, ErrorsLieWithinThreeSigma) {
  int trials = 0, within = 0;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  for (unsigned seed = 0; seed < 60; ++seed) {
    const Vec3d truth = towards(360 * unit(random) - 180, 10 + 70 * unit(random));
    const double inverse = seed % 2 == 0 ? 1 / 0.61 : 0;
    const LitBody body{.lamps = {{truth, inverse, kWhite}},
                       .turn_deg = 72 * unit(random),
                       .table = seed % 3 == 0,
                       .sample_noise = 0.005,
                       .surface_noise = 0.007,
                       .floor_noise = 0.005,
                       .seed = seed};
    const LightingEstimate light = estimate_lighting(body.shading());
    ++trials;
    // An estimate without lights and with the flag makes no claim that could be wrong.
    within += light.lights.empty() ? (light.uncertain ? 1 : 0) : (mahalanobis(light.lights[0], truth) < 11.83 ? 1 : 0);
  }
  // 11.83: the 99.73 % quantile of chi square with two degrees of freedom (three sigma of one variable).
  EXPECT_GE(within, trials * 95 / 100) << within << " of " << trials;
}

TEST(LightingEstimate, OutliersAreRejected) {
  const LitBody body{.lamps = {{towards(30, 40), 0, kWhite}}, .sample_noise = 0.003};
  Shading shading = body.shading();
  for (const std::size_t i : {1U, 2U, 14U})
    for (double& e : shading.samples[i].irradiance) e *= 0.6;
  const LightingEstimate light = estimate_lighting(shading);
  EXPECT_GE(light.outliers, 3);
  ASSERT_EQ(light.lights.size(), 1U);
  EXPECT_LT(error_deg(light, towards(30, 40)), 1.0);
}

TEST(LightingEstimate, IsIndependentOfUnits) {
  const LitBody body{.lamps = {{towards(30, 40), 0, kWhite}}, .sample_noise = 0.003};
  const LightingEstimate plain = estimate_lighting(body.shading());
  for (const double scale : {1e-12, 1e9}) {
    Shading shading = body.shading();
    for (SurfaceSample& s : shading.samples)
      for (std::size_t c = 0; c < 3; ++c) s.irradiance[c] *= scale, s.sigma[c] *= scale;
    const LightingEstimate scaled = estimate_lighting(shading);
    ASSERT_EQ(scaled.lights.size(), plain.lights.size()) << scale;
    EXPECT_LT(angle_between(scaled.lights[0].light.direction, plain.lights[0].light.direction), 1e-3) << scale;
  }
}

TEST(LightingEstimate, DegenerateInputIsUncertainAndFinite) {
  const LitBody body{.lamps = {{towards(30, 40), 0, kWhite}}};
  const Shading whole = body.shading();
  const auto check = [](const Shading& shading, const char* what) {
    const LightingEstimate light = estimate_lighting(shading);
    EXPECT_TRUE(light.uncertain) << what;
    for (const LightEstimate& estimate : light.lights) {
      EXPECT_TRUE(std::isfinite(estimate.light.direction.x) && std::isfinite(estimate.light.irradiance[0])) << what;
      EXPECT_TRUE(std::isfinite(estimate.direction_covariance[0]) && std::isfinite(estimate.direction_covariance[2]))
          << what;
    }
    for (const Rgb& a : light.ambient)
      for (const double v : a) EXPECT_TRUE(std::isfinite(v)) << what;
  };
  check({}, "nothing");
  Shading one = whole;
  one.samples.resize(1);
  check(one, "one sample");
  Shading face = whole;
  face.samples.resize(12);
  check(face, "one face");
  Shading black = whole;
  for (SurfaceSample& s : black.samples) s.irradiance = {};
  check(black, "black");
  Shading equal = whole;
  for (SurfaceSample& s : equal.samples) s.irradiance = kWhite;
  check(equal, "all equal");
}

}  // namespace
}  // namespace lightwell::marker
