// The few numbers of AR platforms' light estimation: against black bodies integrated by Planck's law, closed forms, and
// each other.
#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <lightwell/light_estimate.hpp>

#include "host_sdk/scenes.hpp"
#include "reference/colour/black_body.hpp"

namespace lightwell {
namespace {

using reference::BlackBody;
using reference::Uv;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();

Chromaticity chromaticity(Uv c) {
  const reference::Xy xy = reference::xy_of(c);
  return {xy.x, xy.y};
}

class ColorTemperatureTest : public ::testing::Test {
 protected:
  BlackBody black_body_{COLOUR_MATCHING_FUNCTIONS};
};

TEST_F(ColorTemperatureTest, OfBlackBodiesAndOfColoursBesideThem) {
  for (double kelvin = 1010; kelvin < 99'000; kelvin *= 1.171)
    for (const double duv : {-0.049, -0.02, -0.003, 0.0, 0.001, 0.01, 0.03, 0.049}) {
      const Uv colour = black_body_.beside(kelvin, duv);
      const auto t = color_temperature(chromaticity(colour));
      ASSERT_TRUE(t) << kelvin << " K, Duv " << duv;
      EXPECT_NEAR(t->kelvin, black_body_.nearest_kelvin(colour), 3e-4 * t->kelvin) << kelvin << " K, Duv " << duv;
      EXPECT_NEAR(t->duv, duv, 1e-6) << kelvin << " K, Duv " << duv;
    }
}

TEST_F(ColorTemperatureTest, OfPublishedIlluminants) {
  // CIE 15:2004, tables T.3 and 11.1: chromaticities, of fluorescent lamps with four digits, and temperatures, K.
  const struct {
    double x, y, kelvin, tolerance;
  } known[] = {{0.44758, 0.40745, 2856, 1}, {0.34567, 0.35850, 5003, 3}, {0.31272, 0.32903, 6504, 4},
               {0.29902, 0.31485, 7504, 4}, {0.3721, 0.3751, 4230, 8},   {0.4402, 0.4031, 2940, 3}};
  for (const auto& k : known) EXPECT_NEAR(color_temperature(Chromaticity{k.x, k.y})->kelvin, k.kelvin, k.tolerance);
}

TEST_F(ColorTemperatureTest, HasNoMeaningFarFromTheLocusAndBeyondItsEnds) {
  for (const double kelvin : {1500.0, 5000.0, 40'000.0}) {
    EXPECT_FALSE(color_temperature(chromaticity(black_body_.beside(kelvin, 0.051)))) << kelvin;
    EXPECT_FALSE(color_temperature(chromaticity(black_body_.beside(kelvin, -0.051)))) << kelvin;
  }
  EXPECT_FALSE(color_temperature(chromaticity(black_body_.uv(990))));
  EXPECT_FALSE(color_temperature(chromaticity(black_body_.uv(101'500))));
  EXPECT_FALSE(color_temperature(0, 0, 0)) << "black";
  EXPECT_FALSE(color_temperature(0, 1, 0)) << "green";
  EXPECT_FALSE(color_temperature(1, 0, 1)) << "magenta";
  EXPECT_FALSE(color_temperature(kNan, 1, 1));
  EXPECT_FALSE(color_temperature(kInfinity, 1, 1));
  EXPECT_FALSE(color_temperature(Chromaticity{0.3, -1}));
  EXPECT_NEAR(color_temperature(5, 5, 5)->kelvin, 6504, 4) << "white";
  EXPECT_GT(color_temperature(0.9F, 1, 0.9F)->duv, 0) << "greenish";
  EXPECT_LT(color_temperature(1, 0.9F, 1)->duv, 0) << "pinkish";
}

// --- The estimate ---

LightEstimate estimated(const Descriptor& d, const LightEstimateOptions& options = {}) {
  const auto out = estimate_light(Lighting::of(d), options);
  EXPECT_EQ(out.validity, Validity::valid);
  return out.value;
}

TEST(LightEstimate, OfAConstantSurrounding) {
  // A luminance L from everywhere: pi L lux on every surface.
  const LightEstimate e = estimated(test::constant_scene({100, 100, 100}));
  EXPECT_NEAR(e.mean_illuminance, 100 * std::numbers::pi, 1e-3);
  EXPECT_NEAR(e.ambient_lumens, e.mean_illuminance, 1e-3) << "lumens are lux at the default";
  EXPECT_NEAR(e.color_temperature, 6504, 4);
  EXPECT_EQ(e.ambient_color, (std::array<float, 3>{1, 1, 1}));
  EXPECT_FALSE(has(e.available, LightRequest::main_light_direction));
  EXPECT_EQ(e.main_light_lumens, 0);
}

TEST(LightEstimate, OfALampIsAQuarterOfItsIlluminanceOverAllOrientations) {
  for (const float rho : {0.001F, 0.5F, 1.5F}) {
    // Vector irradiance of a cap of luminance L: pi L sin² rho; spherical illuminance: 2 pi L (1 - cos rho).
    const double r = static_cast<double>(rho), luminance = 50;
    const auto lux = static_cast<float>(std::numbers::pi * luminance * std::sin(r) * std::sin(r));
    const LightEstimate e = estimated(test::one_light({1, 0, 0}, {lux, lux, lux}, rho));
    EXPECT_NEAR(e.mean_illuminance, 2 * std::numbers::pi * luminance * (1 - std::cos(r)) / 4,
                1e-5 * (1 + static_cast<double>(lux)));
    EXPECT_NEAR(e.main_light_lumens, lux, 1e-5F * lux);
    EXPECT_EQ(e.main_light_direction, (std::array<float, 3>{1, 0, 0}));
  }
}

TEST(LightEstimate, TheMeanIlluminanceIsThatOfTheQueries) {
  Descriptor d = test::constant_scene({30, 40, 20});
  d.radiance.band = 2;
  d.radiance.c[2] = {20, 10, 15};
  d.lights = {test::light({0.3F, 0.8F, 0.1F}, {300, 250, 200}, 0.2F)};
  const Lighting light = Lighting::of(d);
  double sum = 0;
  constexpr int kNormals = 4096;
  for (int i = 0; i < kNormals; ++i) {
    const double z = 1 - (2 * i + 1.0) / kNormals, s = std::sqrt(1 - z * z),
                 phi = i * std::numbers::pi * (3 - std::sqrt(5.0));
    const auto e = light.irradiance(
        {static_cast<float>(s * std::cos(phi)), static_cast<float>(s * std::sin(phi)), static_cast<float>(z)});
    sum += static_cast<double>(e.value.luminance());
  }
  EXPECT_NEAR(estimated(d).mean_illuminance, sum / kNormals, 1e-3 * sum / kNormals) << "lattice of 4,096 normals";
}

TEST(LightEstimate, AgreesWithArkitsConversion) {
  Descriptor d = test::constant_scene({30, 40, 20});
  d.lights = {test::light({0, 1, 0}, {300, 250, 200}, 0.2F)};
  const double ev = 9;
  const auto arkit = to_arkit(Lighting::of(d), {.color = ColorMatrix::scale(static_cast<float>(exposure(ev)))});
  LightEstimateOptions options;
  options.neutral_illuminance = static_cast<float>(std::numbers::pi / exposure(ev));
  const LightEstimate e = estimated(d, options);
  EXPECT_NEAR(e.ambient_lumens, arkit.value.ambientIntensity, 1e-4F * e.ambient_lumens);
  EXPECT_NEAR(e.main_light_lumens, arkit.value.primaryLightIntensity, 1e-4F * e.main_light_lumens);
  // McCamy's formula is accurate to some ten kelvin at this temperature.
  EXPECT_NEAR(e.color_temperature, arkit.value.ambientColorTemperature, 30);
}

TEST(LightEstimate, AGainIsLinearAndLeavesColours) {
  Descriptor d = test::constant_scene({30, 20, 10});
  d.lights = {test::light({0, 1, 0}, {300, 250, 200}, 0.2F)};
  LightEstimateOptions options;
  options.gain = 4;
  const LightEstimate one = estimated(d), four = estimated(d, options);
  EXPECT_FLOAT_EQ(four.ambient_lumens, 4 * one.ambient_lumens);
  EXPECT_FLOAT_EQ(four.mean_illuminance, 4 * one.mean_illuminance);
  EXPECT_FLOAT_EQ(four.main_light_lumens, 4 * one.main_light_lumens);
  for (std::size_t i = 0; i < 27; ++i)
    EXPECT_FLOAT_EQ(four.ambient_spherical_harmonics[i], 4 * one.ambient_spherical_harmonics[i]);
  EXPECT_EQ(four.color_temperature, one.color_temperature);
  EXPECT_EQ(four.ambient_color, one.ambient_color);
  EXPECT_EQ(four.main_light_color, one.main_light_color);
}

TEST(LightEstimate, InvalidOptionsAreRefusedByName) {
  const Lighting light = Lighting::of(test::constant_scene({1, 1, 1}));
  for (const float bad : {0.0F, -1.0F, kNan, kInfinity}) {
    LightEstimateOptions gain, neutral;
    gain.gain = bad;
    neutral.neutral_illuminance = bad;
    EXPECT_NE(gain.validate().message().find("gain"), std::string::npos);
    EXPECT_NE(neutral.validate().message().find("neutral_illuminance"), std::string::npos);
    EXPECT_EQ(estimate_light(light, gain).validity, Validity::invalid_query);
    EXPECT_EQ(estimate_light(light, neutral).value.ambient_lumens, 0);
  }
  EXPECT_FALSE(LightEstimateOptions{.requested = static_cast<LightRequest>(32)}.validate().ok());
}

TEST(LightEstimate, WhatIsNotRequestedIsNotGiven) {
  Descriptor d = test::constant_scene({30, 20, 10});
  d.lights = {test::light({0, 1, 0}, {300, 250, 200}, 0.2F)};
  EXPECT_EQ(estimated(d).available, LightRequest::all);
  const LightEstimate none = estimated(d, {.requested = LightRequest::none});
  EXPECT_EQ(none.available, LightRequest::none);
  EXPECT_EQ(none.ambient_lumens + none.mean_illuminance + none.color_temperature + none.main_light_lumens, 0);
  // The harmonics alone hold the main light, too.
  const LightEstimate blurred = estimated(d, {.requested = LightRequest::ambient_spherical_harmonics});
  EXPECT_EQ(blurred.available, LightRequest::ambient_spherical_harmonics);
  EXPECT_EQ(blurred.main_light_direction, (std::array<float, 3>{}));
  EXPECT_EQ(blurred.ambient_lumens, 0);
  const auto whole = to_three(Lighting::of(d), ThreeLights::physical, MainLight::in_harmonics);
  EXPECT_EQ(blurred.ambient_spherical_harmonics, whole.value.sh);
  const LightEstimate direction =
      estimated(d, {.requested = LightRequest::ambient_spherical_harmonics | LightRequest::main_light_direction});
  EXPECT_EQ(direction.ambient_spherical_harmonics, whole.value.sh) << "a direction alone takes no light away";
  EXPECT_EQ(direction.main_light_lumens, 0);
}

TEST(LightEstimate, OfDarknessAndOfNoLight) {
  const LightEstimate dark = estimated(test::constant_scene({0, 0, 0}));
  EXPECT_TRUE(has(dark.available, LightRequest::ambient_intensity));
  EXPECT_FALSE(has(dark.available, LightRequest::ambient_color));
  EXPECT_EQ(dark.color_temperature, 0);
  const auto none = estimate_light(Lighting());
  EXPECT_EQ(none.validity, Validity::none);
  EXPECT_EQ(none.value.available, LightRequest::none);
}

// --- Fade ---

TEST(FadeWeight, HoldsThenFallsWithoutKinks) {
  const FadeTimes times{Duration{100}, Duration{1000}};
  const auto weight = [&](std::int64_t ns) { return *fade_weight(Duration{ns}, times); };
  EXPECT_EQ(weight(-5), 1);
  EXPECT_EQ(weight(100), 1);
  EXPECT_FLOAT_EQ(weight(350), 1 - 0.25F * 0.25F * 2.5F);
  EXPECT_FLOAT_EQ(weight(600), 0.5F);
  EXPECT_EQ(weight(1100), 0);
  EXPECT_EQ(weight(std::numeric_limits<std::int64_t>::max()), 0);
  for (std::int64_t t = 0; t < 1200; t += 7) EXPECT_LE(weight(t + 7), weight(t));
  EXPECT_GT(weight(101), 0.99999F) << "its slope begins at 0";
  EXPECT_LT(weight(1099), 0.00001F);
}

TEST(FadeWeight, WithoutFadeItIsAStep) {
  const FadeTimes step{Duration{100}, Duration{0}};
  EXPECT_EQ(*fade_weight(Duration{100}, step), 1);
  EXPECT_EQ(*fade_weight(Duration{101}, step), 0);
}

TEST(FadeWeight, NegativeTimesAreRefusedByName) {
  EXPECT_NE(fade_weight(Duration{}, {Duration{-1}, Duration{}}).status().message().find("hold"), std::string::npos);
  EXPECT_NE(fade_weight(Duration{}, {Duration{}, Duration{-1}}).status().message().find("fade"), std::string::npos);
}

TEST(FadeWeight, OfALightingIsByItsAge) {
  const FadeTimes times{Duration{100'000'000}, Duration{200'000'000}};
  const Descriptor d = test::constant_scene({1, 1, 1});
  EXPECT_EQ(*fade_weight(Lighting::of(d, Duration{50'000'000}), times), 1);
  EXPECT_FLOAT_EQ(*fade_weight(Lighting::of(d, Duration{200'000'000}), times), 0.5F);
  EXPECT_EQ(*fade_weight(Lighting::of(d, Duration{900'000'000}), times), 0) << "stale light";
  EXPECT_EQ(*fade_weight(Lighting(), times), 0);
}

}  // namespace
}  // namespace lightwell
