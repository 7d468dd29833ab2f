// Lighting against scenes with a closed form and against the double oracles.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <lightwell/lighting.hpp>
#include <lightwell/lobes.hpp>

#include "host_sdk/scenes.hpp"
#include "reference/cap.hpp"
#include "reference/ggx.hpp"
#include "reference/harmonics.hpp"

namespace lightwell {
namespace {

using test::constant_scene;
using test::directions;
using test::one_light;

constexpr float kPi = std::numbers::pi_v<float>;
/// Tolerance: sums of at most 49 single-precision products, a few 1e-7 of the largest term.
constexpr double kExact = 1e-5;
constexpr float kRoughnesses[] = {0.02F, 0.1F, 0.3F, 0.5F, 0.8F, 1};

reference::V3 v3(Vec3f v) {
  return reference::normalised({static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)});
}

double cos_of(Vec3f a, Vec3f b) { return reference::dot(v3(a), v3(b)); }

TEST(Lighting, ConstantRadianceGivesPiTimesItAsIrradiance) {
  const Lighting lighting = Lighting::of(constant_scene({1, 20, 300}));
  for (const Vec3f normal : directions()) {
    const Answer<Irradiance> e = lighting.irradiance(normal);
    EXPECT_EQ(e.validity, Validity::valid);
    EXPECT_NEAR(e.value.r / kPi, 1, kExact);
    EXPECT_NEAR(e.value.g / kPi / 20, 1, kExact);
    EXPECT_NEAR(e.value.b / kPi / 300, 1, kExact);
  }
}

TEST(Lighting, ConstantRadianceIsTheSameAtEveryRoughness) {
  const Lighting lighting = Lighting::of(constant_scene({1, 20, 300}));
  for (const Vec3f direction : directions())
    for (const float roughness : {0.0F, 0.02F, 0.1F, 0.3F, 0.5F, 0.8F, 1.0F}) {
      const Answer<Radiance> l = lighting.radiance(direction, roughness);
      EXPECT_NEAR(l.value.r, 1, kExact) << roughness;
      EXPECT_NEAR(l.value.b / 300, 1, kExact) << roughness;
    }
}

TEST(Lighting, DirectionalLightFollowsTheCosine) {
  for (const Vec3f towards : directions()) {
    const Lighting lighting = Lighting::of(one_light(towards, {10, 20, 30}));
    for (const Vec3f normal : directions()) {
      const double expected = std::max(0.0, cos_of(towards, normal));
      const Irradiance e = lighting.irradiance(normal * 3.0F).value;
      EXPECT_NEAR(e.r, 10 * expected, 10 * kExact);
      EXPECT_NEAR(e.g, 20 * expected, 20 * kExact);
      EXPECT_NEAR(e.b, 30 * expected, 30 * kExact);
    }
  }
}

TEST(Lighting, DirectionalLightGivesTheGgxLobe) {
  for (const float roughness : kRoughnesses) {
    const reference::GgxKernel kernel(static_cast<double>(roughness));
    const double peak = kernel.at_cosine(1);
    for (const Vec3f towards : directions()) {
      const Lighting lighting = Lighting::of(one_light(towards, {1, 2, 3}));
      for (const Vec3f direction : directions()) {
        // With the light's direction rounded to float, which matters at the edge of the lobe.
        const double expected = kernel.at_cosine(cos_of(lighting.lights()[0].direction, direction));
        const double tolerance = kExact * std::max(expected, 1e-6 * peak);
        EXPECT_NEAR(lighting.radiance(direction, roughness).value.r, expected, tolerance) << roughness;
      }
    }
  }
}

TEST(Lighting, NarrowLobeIsAccurateBesideItsPeak) {
  // Where a single-precision cosine has lost its digits: 0.01° to 1° from the peak of a lobe of 0.6°.
  const Vec3f towards{0, 1, 0};
  const Lighting lighting = Lighting::of(one_light(towards, {1, 1, 1}));
  const reference::GgxKernel kernel(0.1);
  for (const float angle : {0.0002F, 0.001F, 0.005F, 0.02F}) {
    const Vec3f direction{std::sin(angle), std::cos(angle), 0};
    const reference::V3 d = v3(direction);
    // 1 - cos without cancellation, of the direction as rounded.
    const double versine = 2 * std::pow(std::sin(std::atan2(d.x, d.y) / 2), 2);
    const double expected = kernel.at_versine(versine);
    EXPECT_NEAR(lighting.radiance(direction, 0.1F).value.r / expected, 1, kExact) << angle;
  }
}

TEST(Lighting, EachHarmonicIsScaledByItsLobe) {
  const int band = kMaxBand;
  for (int l = 0; l <= band; ++l)
    for (int m = -l; m <= l; ++m) {
      Descriptor descriptor;
      descriptor.radiance.band = band;
      descriptor.radiance.c[static_cast<std::size_t>(sh_index(l, m))] = {1, 2, 3};
      const Lighting lighting = Lighting::of(descriptor);
      for (const Vec3f d : directions()) {
        const double y = reference::harmonics(v3(d), band)[static_cast<std::size_t>(reference::harmonic_index(l, m))];
        EXPECT_NEAR(lighting.irradiance(d).value.r, reference::cosine_lobe(l) * y, kExact);
        EXPECT_NEAR(lighting.irradiance(d).value.b, 3 * reference::cosine_lobe(l) * y, 3 * kExact);
      }
    }
}

/// All bands are sent and the light does not ring, so that no band is estimated and no window is applied.
TEST(Lighting, EachHarmonicOfSmoothLightIsScaledByTheGgxLobe) {
  std::vector<float> roughnesses{0};
  roughnesses.insert(roughnesses.end(), std::begin(kRoughnesses), std::end(kRoughnesses));
  for (int l = 0; l <= kMaxBand; ++l)
    for (int m = -l; m <= l; ++m) {
      Descriptor descriptor;
      descriptor.radiance.band = kMaxBand;
      std::vector<double> c(static_cast<std::size_t>(sh_count(kMaxBand)), 0.002);
      c[0] = 10;
      c[static_cast<std::size_t>(sh_index(l, m))] += 1;
      for (std::size_t i = 0; i < c.size(); ++i) {
        const auto v = static_cast<float>(c[i]);
        descriptor.radiance.c[i] = {v, v, v};
      }
      const Lighting lighting = Lighting::of(descriptor);
      for (const float roughness : roughnesses) {
        std::vector<double> k(kMaxBand + 1, 1);
        if (roughness > 0) k = reference::ggx_legendre(static_cast<double>(roughness), kMaxBand);
        for (const Vec3f d : directions()) {
          const auto y = reference::harmonics(v3(d), kMaxBand);
          double expected = 0;
          for (int band = 0, i = 0; band <= kMaxBand; ++band)
            for (; i < sh_count(band); ++i) {
              const auto at = static_cast<std::size_t>(i);
              expected += k[static_cast<std::size_t>(band)] * c[at] * y[at];
            }
          EXPECT_NEAR(lighting.radiance(d, roughness).value.g, expected, 10 * kExact) << roughness << " " << l << m;
        }
      }
    }
}

TEST(Lighting, IrradianceIsThatOfTheHarmonicsAsSent) {
  // A light in bands 0, 1, 2, 4 rings: radiance() is windowed, irradiance is the sum of A_l c_lm Y_lm to the
  // bit.
  Descriptor descriptor;
  descriptor.radiance.band = 4;
  const auto y = reference::harmonics({0.6, 0.64, 0.48}, 4);
  for (const int l : {0, 1, 2, 4})
    for (int i = l * l; i < sh_count(l); ++i) {
      const auto v = static_cast<float>(y[static_cast<std::size_t>(i)]);
      descriptor.radiance.c[static_cast<std::size_t>(i)] = {v, 2 * v, 3 * v};
    }
  const Lighting lighting = Lighting::of(descriptor);
  EXPECT_EQ(lighting.descriptor().radiance, descriptor.radiance);
  bool raw_rings = false;
  for (const Vec3f d : directions()) {
    const Vec3f n = normalized(d);
    EXPECT_NEAR(lighting.irradiance(n).value.r, evaluate(irradiance_of(descriptor.radiance), n).r, 1e-6);
    raw_rings |= evaluate(descriptor.radiance, n).r < 0;
    for (const float roughness : {0.0F, 0.2F, 0.5F, 1.0F}) EXPECT_GE(lighting.radiance(n, roughness).value.r, 0);
  }
  EXPECT_TRUE(raw_rings) << "else this shows nothing";
}

TEST(Lighting, CapIsClippedAtTheHorizon) {
  for (const double rho : {0.01, 0.2, 0.8, 1.5}) {
    const Lighting lighting = Lighting::of(one_light({0, 1, 0}, {1, 1, 1}, static_cast<float>(rho)));
    double before = 1;
    constexpr int kSteps = 720;
    for (int i = 0; i <= kSteps; ++i) {
      const double angle = std::numbers::pi * i / kSteps;
      const Vec3f normal{static_cast<float>(std::sin(angle)), static_cast<float>(std::cos(angle)), 0};
      const auto radius = static_cast<double>(static_cast<float>(rho));
      const double e = lighting.irradiance(normal).value.r;
      const double expected = reference::cap_irradiance(radius, angle) / reference::cap_vector_irradiance(radius);
      // The angle itself is rounded to single precision in the normal.
      EXPECT_NEAR(e, expected, kExact) << rho << " " << angle;
      // Continuous: steps are within the largest slope, one per rad.
      EXPECT_NEAR(e, before, std::numbers::pi / kSteps + kExact) << rho << " " << angle;
      before = e;
    }
  }
}

TEST(Lighting, LightsAndHarmonicsAdd) {
  Descriptor descriptor = constant_scene({1, 1, 1});
  descriptor.lights = {test::light({0, 1, 0}, {5, 5, 5}, 0, 1), test::light({1, 0, 0}, {2, 2, 2}, 0, 2)};
  const Lighting lighting = Lighting::of(descriptor);
  EXPECT_NEAR(lighting.irradiance({0, 1, 0}).value.g, kPi + 5, 7 * kExact);
  EXPECT_NEAR(lighting.irradiance({1, 1, 0}).value.g, kPi + 7 * std::numbers::sqrt2 / 2, 7 * kExact);
  EXPECT_NEAR(lighting.irradiance({0, -1, 0}).value.g, kPi, 7 * kExact);
}

TEST(Lighting, RingingIsNotClamped) {
  // Band 1 alone is negative on one side; the SDK returns that value instead of clamping it.
  Descriptor descriptor;
  descriptor.radiance.band = 1;
  descriptor.radiance.c[1] = {1, 1, 1};
  EXPECT_LT(Lighting::of(descriptor).irradiance({0, -1, 0}).value.r, -0.5F);
}

}  // namespace
}  // namespace lightwell
