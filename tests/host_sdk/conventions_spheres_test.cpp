// Irradiance of a sphere lit by each engine with converted values, against Lighting: equal except for what the engine
// cannot represent.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/conventions.hpp>

#include "host_sdk/engine_views.hpp"
#include "host_sdk/scenes.hpp"
#include "reference/cap.hpp"
#include "reference/harmonics.hpp"
#include "reference/irradiance.hpp"

namespace lightwell {
namespace {

using reference::Rgb;
using reference::V3;
using test::EngineView;
using test::every_engine;
using test::MainLightIs;

/// Tolerance: coefficients in single precision, sums of a few dozen terms.
constexpr double kExact = 1e-5;

const std::vector<V3>& normals() {
  static const std::vector<V3> all = reference::fibonacci_normals(2048);
  return all;
}

V3 v3(Vec3f v) { return {v.x, v.y, v.z}; }

struct Scene {
  std::string name;
  Descriptor descriptor;
};

/// All nine functions and more, in three colours; bright enough to be positive.
Descriptor room(int band) {
  Descriptor descriptor = test::constant_scene({30, 20, 10});
  descriptor.radiance.band = band;
  for (int i = 1; i < sh_count(band); ++i) {
    const float v = std::sin(static_cast<float>(3 * i));
    descriptor.radiance.c[static_cast<std::size_t>(i)] = {4 * v, 3 * std::cos(static_cast<float>(i)), -2 * v};
  }
  return descriptor;
}

Descriptor with(Descriptor descriptor, std::vector<Light> lights) {
  descriptor.lights = std::move(lights);
  return descriptor;
}

std::vector<Scene> scenes() {
  const Light sun = test::light({0.3F, 0.8F, -0.5F}, {90, 80, 60}, 0.0047F, 1);
  const Light point = test::light({-0.7F, 0.2F, 0.6F}, {20, 30, 10}, 0, 2);
  const Light window = test::light({0.1F, 0.1F, 0.9F}, {40, 45, 50}, 0.6F, 3);
  const Light sky = test::light({0, 1, 0.2F}, {200, 220, 260}, 1.5F, 4);
  return {{"harmonics alone", room(2)},
          {"bands above 2", room(6)},
          {"one light without background", with({}, {sun})},
          {"a point and a room", with(room(2), {point})},
          {"several lights", with(room(4), {sun, point, window})},
          {"the main light is a wide window", with(room(2), {window, point})},
          {"half the sky is one light", with(room(4), {sky, window, sun, point})},
          {"band zero and a light", with(test::constant_scene({1, 2, 3}), {point})}};
}

/// What bands 0 to 2 hold of a cap at cosine c from its axis, for vector irradiance 1: sum of A_l (2l+1)/(4 pi) z_l
/// P_l(c) with z = 2 / (1 + cos rho), 1, cos rho, the integrals of P_l over the cap.
double cap_in_three_bands(double c, double rho) {
  const double a = std::cos(rho);
  return 0.25 * (2 / (1 + a)) + 0.5 * c + 5.0 / 16 * a * (3 * c * c - 1) / 2;
}

/// The irradiance that an engine can represent: bands 0 to 2 of everything; for a separate main light, the clamped
/// cosine of a point light instead of its three bands.
Rgb expected(const Descriptor& descriptor, MainLightIs main, const V3& n) {
  std::vector<Rgb> nine(9);
  for (int i = 0; i < std::min(9, descriptor.radiance.count()); ++i) {
    const Radiance& c = descriptor.radiance.c[static_cast<std::size_t>(i)];
    nine[static_cast<std::size_t>(i)] = {c.r, c.g, c.b};
  }
  Rgb sum = reference::irradiance_from_sh(nine, n);
  const auto strongest = std::max_element(
      descriptor.lights.begin(), descriptor.lights.end(),
      [](const Light& a, const Light& b) { return a.irradiance.luminance() < b.irradiance.luminance(); });
  for (auto light = descriptor.lights.begin(); light != descriptor.lights.end(); ++light) {
    const double c = reference::dot(reference::normalised(v3(light->direction)), n);
    double factor = cap_in_three_bands(c, light->angular_radius_rad);
    if (light == strongest && main == MainLightIs::apart) factor += std::max(0.0, c) - cap_in_three_bands(c, 0);
    const Irradiance& e = light->irradiance;
    sum[0] += factor * e.r;
    sum[1] += factor * e.g;
    sum[2] += factor * e.b;
  }
  return sum;
}

TEST(Conventions, SphereIrradianceInEachEngineMatchesLighting) {
  for (const Scene& scene : scenes())
    for (const EngineView& engine : every_engine(Lighting::of(scene.descriptor))) {
      ASSERT_EQ(engine.validity, Validity::valid);
      std::vector<Rgb> truth, shown;
      for (const V3& n : normals()) {
        truth.push_back(expected(scene.descriptor, engine.main, n));
        shown.push_back(engine.at(n));
      }
      EXPECT_LT(reference::irradiance_error(truth, shown).largest, kExact) << engine.name << ": " << scene.name;
    }
}

TEST(Conventions, SphereIrradianceMatchesForRandomLight) {
  // Random bands, lights, sizes and colours, over the whole range of float.
  std::mt19937 random(7);
  std::uniform_real_distribution<float> signed_unit(-1, 1), unit(0, 1);
  const auto few = reference::fibonacci_normals(64);
  for (int trial = 0; trial < 60; ++trial) {
    const float brightness = std::pow(10.0F, -20 + 50 * unit(random));
    Descriptor scene;
    scene.radiance.band = static_cast<int>(random() % 7);
    for (int i = 0; i < scene.radiance.count(); ++i)
      scene.radiance.c[static_cast<std::size_t>(i)] =
          Radiance{signed_unit(random), signed_unit(random), signed_unit(random)} * brightness;
    for (std::size_t lights = random() % (trial == 0 ? 1 : 9) + (trial == 59 ? kMaxLights - 9 : 0); lights > 0;
         --lights) {
      const Vec3f towards{signed_unit(random), signed_unit(random), signed_unit(random)};
      const Irradiance e = Irradiance{unit(random), unit(random), unit(random)} * (10 * brightness);
      scene.lights.push_back(test::light(towards, e, unit(random) * 1.57F));
    }
    for (const EngineView& engine : every_engine(Lighting::of(scene))) {
      std::vector<Rgb> truth, shown;
      for (const V3& n : few) {
        truth.push_back(expected(scene, engine.main, n));
        shown.push_back(engine.at(n));
      }
      EXPECT_LT(reference::irradiance_error(truth, shown).largest, kExact) << engine.name << ", trial " << trial;
    }
  }
}

TEST(Conventions, RepresentableLightIsExact) {
  // Band 2 and one separate point light are representable, so the result of Lighting is exact.
  const Lighting lighting = Lighting::of(with(room(2), {test::light({-0.7F, 0.2F, 0.6F}, {20, 30, 10})}));
  for (const EngineView& engine : every_engine(lighting)) {
    if (engine.main != MainLightIs::apart) continue;
    std::vector<Rgb> truth, shown;
    for (const V3& n : normals()) {
      const Irradiance e =
          lighting.irradiance({static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)}).value;
      truth.push_back({e.r, e.g, e.b});
      shown.push_back(engine.at(n));
    }
    EXPECT_LT(reference::irradiance_error(truth, shown).largest, kExact) << engine.name;
    ASSERT_TRUE(engine.residual) << engine.name;
    EXPECT_LT(*engine.residual, kExact) << engine.name;
  }
}

TEST(Conventions, MeanIrradianceIsConserved) {
  // The mean irradiance over all normals is pi times the mean radiance (bands above 0 cancel), so it detects a light
  // that is counted twice or lost, independently of other representation errors.
  for (const Scene& scene : scenes())
    for (const EngineView& engine : every_engine(Lighting::of(scene.descriptor))) {
      Rgb shown{}, whole{};
      for (const V3& n : normals()) {
        const Rgb e = engine.at(n);
        for (std::size_t k = 0; k < 3; ++k) shown[k] += e[k] / static_cast<double>(normals().size());
      }
      for (int k = 0; k < 3; ++k) {
        const auto at = static_cast<std::size_t>(k);
        whole[at] = scene.descriptor.radiance.c[0][k] * 0.28209479177387814 * reference::pi;
        for (const Light& light : scene.descriptor.lights) {
          const double rho = light.angular_radius_rad;
          // pi times mean radiance: the cap's solid angle over 4 for radiance one; 1/4 of a point's irradiance.
          whole[at] += light.irradiance[k] * 0.25 * 2 / (1 + std::cos(rho));
        }
        // Tolerance: the lattice integrates a clamped cosine to 1e-5.
        EXPECT_NEAR(shown[at], whole[at], 1e-4 * whole[at]) << engine.name << ": " << scene.name;
      }
    }
}

TEST(Conventions, ResidualMatchesTheMeasuredError) {
  for (const Scene& scene : scenes()) {
    const Lighting lighting = Lighting::of(scene.descriptor);
    std::vector<Rgb> truth;
    for (const V3& n : normals()) {
      const Irradiance e =
          lighting.irradiance({static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)}).value;
      truth.push_back({e.r, e.g, e.b});
    }
    for (const EngineView& engine : every_engine(lighting)) {
      std::vector<Rgb> shown;
      for (const V3& n : normals()) shown.push_back(engine.at(n));
      const double measured = reference::irradiance_error(truth, shown).rms;
      ASSERT_TRUE(engine.residual);
      // Tolerance: 512 normals against 2,048, few of which see a partially occluded sun.
      EXPECT_NEAR(*engine.residual, measured, 0.05 * measured + 1e-4) << engine.name << ": " << scene.name;
    }
  }
}

TEST(Conventions, SeparateMainLightHasASmallerResidual) {
  const Lighting lighting = Lighting::of(with(room(2), {test::light({0.3F, 0.8F, -0.5F}, {90, 80, 60}, 0.3F)}));
  const auto apart = to_three(lighting);
  const auto inside = to_three(lighting, ThreeLights::physical, MainLight::in_harmonics);
  ASSERT_TRUE(apart.residual && inside.residual);
  EXPECT_LT(*apart.residual, 0.5F * *inside.residual);
  EXPECT_GT(*apart.residual, 1e-4F);  // its width is lost
}

TEST(Conventions, ResidualIsOptional) {
  ConversionOptions quick;
  quick.residual = Residual::left_out;
  for (const EngineView& engine : every_engine(Lighting::of(room(2)), quick)) EXPECT_FALSE(engine.residual);
}

TEST(Conventions, ColorMatrixIsAppliedToEveryPartOfTheLight) {
  ConversionOptions options;
  options.color.m = {{{0.5F, 0.1F, 0}, {0.05F, 0.25F, 0}, {0, 0.2F, 2}}};
  for (const Scene& scene : scenes()) {
    const auto plain = every_engine(Lighting::of(scene.descriptor));
    const auto mapped = every_engine(Lighting::of(scene.descriptor), options);
    for (std::size_t i = 0; i < plain.size(); ++i) {
      std::vector<Rgb> truth, shown;
      for (const V3& n : normals()) {
        const Rgb e = plain[i].at(n);
        truth.push_back({0.5 * e[0] + 0.1 * e[1], 0.05 * e[0] + 0.25 * e[1], 0.2 * e[1] + 2 * e[2]});
        shown.push_back(mapped[i].at(n));
      }
      EXPECT_LT(reference::irradiance_error(truth, shown).largest, kExact) << plain[i].name << ": " << scene.name;
    }
  }
}

TEST(Conventions, DirectionalLightIsNonNegativeAndTheSumIsConserved) {
  // Chromatic adaptation makes red negative for deep blue light; the negative part goes into the harmonics.
  ConversionOptions options;
  options.color.m = {{{1, 0, -0.5F}, {0, 1, 0}, {0, 0, 1}}};
  const Descriptor scene = with(room(2), {test::light({0, 1, 0}, {1, 4, 40})});
  for (const EngineView& engine : every_engine(Lighting::of(scene), options)) {
    Rgb shown{};
    for (const V3& n : normals()) {
      const Rgb e = engine.at(n);
      for (std::size_t k = 0; k < 3; ++k) shown[k] += e[k] / static_cast<double>(normals().size());
    }
    const double red = (30 - 0.5 * 10) * reference::pi + (1 - 0.5 * 40) / 4;
    EXPECT_NEAR(shown[0], red, 1e-3 * red) << engine.name;
  }
  const WebXrLightEstimate webxr = to_webxr(Lighting::of(scene), ShSigns::positive, options).value;
  EXPECT_EQ(webxr.primaryLightIntensity.x, 0);
  EXPECT_FLOAT_EQ(webxr.primaryLightIntensity.z, 40);
}

}  // namespace
}  // namespace lightwell
