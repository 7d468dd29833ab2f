// Lights in known directions, written by hand in each engine's axes, and conversions without an estimate.
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include <lightwell/conventions.hpp>

#include "host_sdk/engine_views.hpp"
#include "host_sdk/scenes.hpp"

namespace lightwell {
namespace {

using test::EngineView;
using test::every_engine;
using test::MainLightIs;

constexpr float kTight = 1e-6F;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

void expect_direction(const std::array<float, 3>& v, float x, float y, float z, const char* whose) {
  EXPECT_NEAR(v[0], x, kTight) << whose;
  EXPECT_NEAR(v[1], y, kTight) << whose;
  EXPECT_NEAR(v[2], z, kTight) << whose;
}

std::array<float, 3> xyz(const DomPoint& p) { return {p.x, p.y, p.z}; }

template <std::size_t N>
void expect_list(const std::array<float, N>& a, const std::array<double, N>& b, const char* whose) {
  for (std::size_t i = 0; i < N; ++i) EXPECT_NEAR(static_cast<double>(a[i]), b[i], 2e-6) << whose << ", " << i;
}

/// Red of each of nine coefficients that stand r g b r g b.
std::array<float, 9> red(const std::array<float, 27>& interleaved) {
  std::array<float, 9> out{};
  for (std::size_t i = 0; i < 9; ++i) out[i] = interleaved[3 * i];
  return out;
}

// --- Where the main light is ---

TEST(ConventionFixtures, LightToTheRight) {
  const Lighting lighting = Lighting::of(test::one_light({1, 0, 0}, {3, 2, 1}));
  expect_direction(xyz(to_webxr(lighting).value.primaryLightDirection), 1, 0, 0, "WebXR");
  expect_direction(to_arcore(lighting).value.environmentalHdrMainLightDirection, 1, 0, 0, "ARCore");
  expect_direction(to_openxr(lighting, XrSphericalHarmonicsKind::ambient).value.directionalLight.direction, 1, 0, 0,
                   "OpenXR");
  expect_direction(to_three(lighting).value.position, 1, 0, 0, "three.js");
  // These store the direction in which the light shines: to the left.
  expect_direction(to_arkit(lighting).value.primaryLightDirection, -1, 0, 0, "ARKit");
  expect_direction(to_filament(lighting).value.direction, -1, 0, 0, "Filament");
  expect_direction(to_unity(lighting, UnityPipeline::universal).value.forward, -1, 0, 0, "Unity");
  expect_direction(to_unreal(lighting).value.forward, 0, -1, 0, "Unreal");
}

TEST(ConventionFixtures, TheSunAtTheZenith) {
  const Lighting lighting = Lighting::of(test::one_light({0, 1, 0}, {3, 2, 1}));
  expect_direction(xyz(to_webxr(lighting).value.primaryLightDirection), 0, 1, 0, "WebXR");
  expect_direction(to_arcore(lighting).value.environmentalHdrMainLightDirection, 0, 1, 0, "ARCore");
  expect_direction(to_openxr(lighting, XrSphericalHarmonicsKind::ambient).value.directionalLight.direction, 0, 1, 0,
                   "OpenXR");
  expect_direction(to_three(lighting).value.position, 0, 1, 0, "three.js");
  expect_direction(to_arkit(lighting).value.primaryLightDirection, 0, -1, 0, "ARKit");
  expect_direction(to_filament(lighting).value.direction, 0, -1, 0, "Filament");
  expect_direction(to_unity(lighting, UnityPipeline::universal).value.forward, 0, -1, 0, "Unity");
  expect_direction(to_unreal(lighting).value.forward, 0, 0, -1, "Unreal");
}

TEST(ConventionFixtures, LightStraightAhead) {
  const Lighting lighting = Lighting::of(test::one_light({0, 0, -1}, {3, 2, 1}));
  expect_direction(xyz(to_webxr(lighting).value.primaryLightDirection), 0, 0, -1, "WebXR");
  expect_direction(to_three(lighting).value.position, 0, 0, -1, "three.js");
  expect_direction(to_filament(lighting).value.direction, 0, 0, 1, "Filament");
  // Forward is +Z in Unity and +X in Unreal; the light shines backwards.
  expect_direction(to_unity(lighting, UnityPipeline::universal).value.forward, 0, 0, -1, "Unity");
  expect_direction(to_unreal(lighting).value.forward, -1, 0, 0, "Unreal");
}

// --- The same in harmonics: E Y_i(direction) by hand, Y = 0.282095, 0.488603 (y, z, x), 1.092548 (xy, yz),
// 0.315392 (3z²-1), 1.092548 xz, 0.546274 (x²-y²) ---

constexpr std::array<double, 9> kLampAtPlusX{0.282095, 0, 0, 0.488603, 0, 0, -0.315392, 0, 0.546274};
constexpr std::array<double, 9> kLampAtPlusXWithPhase{0.282095, 0, 0, -0.488603, 0, 0, -0.315392, 0, 0.546274};

TEST(ConventionFixtures, LightToTheRightInHarmonics) {
  const Lighting lighting = Lighting::of(test::one_light({1, 0, 0}, {1, 0, 0}));
  const auto openxr = to_openxr(lighting, XrSphericalHarmonicsKind::total).value.sphericalHarmonics;
  std::array<float, 9> reds{};
  for (std::size_t i = 0; i < 9; ++i) reds[i] = openxr.coefficients[i][0];
  expect_list(reds, kLampAtPlusXWithPhase, "OpenXR");
  const auto arkit = to_arkit(lighting).value.sphericalHarmonicsCoefficients;
  std::copy_n(arkit.begin(), 9, reds.begin());
  expect_list(reds, kLampAtPlusX, "ARKit");
  expect_list(red(to_three(lighting, ThreeLights::physical, MainLight::in_harmonics).value.sh), kLampAtPlusX,
              "three.js");
  // Right is +Y in Unreal: -Y_1^-1, and x²-y² is negative.
  expect_list(to_unreal(lighting, MainLight::in_harmonics).value.R,
              {0.282095, -0.488603, 0, 0, 0, 0, -0.315392, 0, -0.546274}, "Unreal");
  // Factors 0.282095, 0.325735, 0.273137, 0.078848, 0.136569: basis constants times A_l / pi.
  const auto unity = to_unity(lighting, UnityPipeline::universal, MainLight::in_harmonics).value.sphericalHarmonicsL2;
  std::copy_n(unity.begin(), 9, reds.begin());
  expect_list(reds, {0.0795775, 0, 0, 0.159155, 0, 0, -0.0248680, 0, 0.0746041}, "Unity");
  const auto filament = to_filament(lighting, MainLight::in_harmonics).value.irradiance;
  for (std::size_t i = 0; i < 9; ++i) reds[i] = filament[i][0];
  expect_list(reds, {0.0795775, 0, 0, 0.159155, 0, 0, -0.0248680, 0, 0.0746041}, "Filament");
}

TEST(ConventionFixtures, LightAheadInHarmonicsOfLeftHandedEngines) {
  const Lighting lighting = Lighting::of(test::one_light({0, 0, -1}, {1, 0, 0}));
  std::array<float, 9> reds{};
  const auto unity = to_unity(lighting, UnityPipeline::universal, MainLight::in_harmonics).value.sphericalHarmonicsL2;
  std::copy_n(unity.begin(), 9, reds.begin());
  expect_list(reds, {0.0795775, 0, 0.159155, 0, 0, 0, 0.0497359, 0, 0}, "Unity");
  expect_list(to_unreal(lighting, MainLight::in_harmonics).value.R,
              {0.282095, 0, 0, -0.488603, 0, 0, -0.315392, 0, 0.546274}, "Unreal");
}

TEST(ConventionFixtures, TheSunAtTheZenithInHarmonicsOfLeftHandedEngines) {
  const Lighting lighting = Lighting::of(test::one_light({0, 1, 0}, {1, 0, 0}));
  std::array<float, 9> reds{};
  const auto unity = to_unity(lighting, UnityPipeline::universal, MainLight::in_harmonics).value.sphericalHarmonicsL2;
  std::copy_n(unity.begin(), 9, reds.begin());
  expect_list(reds, {0.0795775, 0.159155, 0, 0, 0, 0, -0.0248680, 0, -0.0746041}, "Unity");
  expect_list(to_unreal(lighting, MainLight::in_harmonics).value.R, {0.282095, 0, 0.488603, 0, 0, 0, 0.630783, 0, 0},
              "Unreal");
}

TEST(ConventionFixtures, ARedWallOnTheLeftIsOnTheLeftInEveryEngine) {
  // Radiance red 2 - x, green 1: brighter red towards -X.
  Descriptor descriptor = test::constant_scene({2, 1, 1});
  descriptor.radiance.band = 1;
  descriptor.radiance.c[3].r = -1 / 0.48860251F;
  for (const EngineView& engine : every_engine(Lighting::of(descriptor))) {
    const auto& f = engine.frame;
    const auto left = engine.irradiance(-1.0 * f.right), right = engine.irradiance(f.right);
    // pi 2 +- (2 pi / 3) 1.
    EXPECT_NEAR(left[0], reference::pi * (2 + 2.0 / 3), 1e-5) << engine.name;
    EXPECT_NEAR(right[0], reference::pi * (2 - 2.0 / 3), 1e-5) << engine.name;
    EXPECT_NEAR(left[1], right[1], 1e-5) << engine.name;
    for (const auto& across : {f.up, f.forward})
      EXPECT_NEAR(engine.irradiance(across)[0], 2 * reference::pi, 1e-5) << engine.name;
  }
}

// --- Units, one by one ---

TEST(ConventionFixtures, IntensitiesOfALightOfPiLux) {
  // pi lux: a white surface that faces the light has radiance 1.
  constexpr float pi = 3.14159265F;
  const Lighting lighting = Lighting::of(test::one_light({0, 1, 0}, {pi, pi, pi / 2}));
  EXPECT_NEAR(to_unity(lighting, UnityPipeline::universal).value.intensity, 1, kTight);
  EXPECT_NEAR(to_unity(lighting, UnityPipeline::high_definition).value.intensity, pi, kTight);
  EXPECT_NEAR(to_three(lighting).value.intensity, pi, kTight);
  EXPECT_NEAR(to_three(lighting, ThreeLights::legacy).value.intensity, 1, kTight);
  EXPECT_NEAR(to_filament(lighting).value.intensity, pi, kTight);
  EXPECT_NEAR(to_unreal(lighting).value.intensity, pi, kTight);
  EXPECT_NEAR(to_webxr(lighting).value.primaryLightIntensity.x, pi, kTight);
  EXPECT_NEAR(to_webxr(lighting).value.primaryLightIntensity.w, 1, 0);
  EXPECT_NEAR(to_arcore(lighting).value.environmentalHdrMainLightIntensity[2], pi / 2, kTight);
  for (const auto& color : {to_unity(lighting, UnityPipeline::universal).value.color, to_three(lighting).value.color,
                            to_filament(lighting).value.color, to_unreal(lighting).value.color})
    expect_direction(color, 1, 1, 0.5F, "colour");
}

TEST(ConventionFixtures, ArKitNeutralIsAThousand) {
  constexpr float pi = 3.14159265F;
  const ArKitLightEstimate one = to_arkit(Lighting::of(test::constant_scene({1, 1, 1}))).value;
  EXPECT_NEAR(one.ambientIntensity, 1000, 1e-3);
  EXPECT_NEAR(one.ambientColorTemperature, 6504, 10);  // D65; McCamy is good to some kelvin
  EXPECT_EQ(one.primaryLightIntensity, 0);
  const ArKitLightEstimate estimate = to_arkit(Lighting::of(test::one_light({0, 1, 0}, {pi, pi, pi}))).value;
  EXPECT_NEAR(estimate.primaryLightIntensity, 1000, 1e-3);
  EXPECT_NEAR(estimate.ambientIntensity, 250, 1e-3);  // pi over 4 pi
}

TEST(ConventionFixtures, WidthsOfALight) {
  const Lighting lighting = Lighting::of(test::one_light({0, 1, 0}, {1, 1, 1}, 0.1F));
  EXPECT_NEAR(to_filament(lighting).value.sunAngularRadius, 5.7295780, 1e-5);
  EXPECT_NEAR(to_unreal(lighting).value.lightSourceAngle, 11.459156, 1e-5);
}

TEST(ConventionFixtures, TimesAndStatesOfAnEstimate) {
  const Lighting lighting = Lighting::of(test::one_light({0, 1, 0}, {1, 1, 1}));
  EXPECT_EQ(to_arcore(lighting).value.timestamp, lighting.mid_exposure().ns);
  const auto total = to_openxr(lighting, XrSphericalHarmonicsKind::total).value;
  EXPECT_EQ(total.lastUpdatedTime, lighting.mid_exposure().ns);
  EXPECT_EQ(total.state, XrLightEstimateState::valid);
  EXPECT_EQ(total.sphericalHarmonics.kind, XrSphericalHarmonicsKind::total);
  EXPECT_EQ(total.directionalLight.state, XrLightEstimateState::invalid) << "it is in the harmonics already";
  const auto ambient = to_openxr(lighting, XrSphericalHarmonicsKind::ambient).value;
  EXPECT_EQ(ambient.sphericalHarmonics.kind, XrSphericalHarmonicsKind::ambient);
  EXPECT_EQ(ambient.directionalLight.state, XrLightEstimateState::valid);
  EXPECT_NEAR(ambient.ambientLight.intensity[0], 0, kTight);
  EXPECT_NEAR(total.ambientLight.intensity[0], 0.25 / 3.14159265, kTight);
  EXPECT_FLOAT_EQ(ambient.ambientLight.colorCorrection[1], 1);
  // The numbers of the registry.
  static_assert(static_cast<int>(XrLightEstimateState::valid) == 0);
  static_assert(static_cast<int>(XrSphericalHarmonicsKind::total) == 0);
  static_assert(static_cast<int>(ArLightEstimateState::AR_LIGHT_ESTIMATE_STATE_VALID) == 1);
}

TEST(ConventionFixtures, WithoutLightsTheDirectionalLightIsZero) {
  const Lighting lighting = Lighting::of(test::constant_scene({1, 2, 3}));
  EXPECT_EQ(to_webxr(lighting).value.primaryLightDirection, (DomPoint{0, 1, 0, 0}));
  EXPECT_EQ(to_webxr(lighting).value.primaryLightIntensity, (DomPoint{0, 0, 0, 1}));
  EXPECT_EQ(to_openxr(lighting, XrSphericalHarmonicsKind::ambient).value.directionalLight.state,
            XrLightEstimateState::invalid);
  EXPECT_EQ(to_unity(lighting, UnityPipeline::universal).value.intensity, 0);
  EXPECT_EQ(to_three(lighting).value.intensity, 0);
  EXPECT_EQ(to_filament(lighting).value.intensity, 0);
  EXPECT_EQ(to_unreal(lighting).value.intensity, 0);
}

TEST(ConventionFixtures, TheStrongestLightIsTheMainLightInAnyOrder) {
  Descriptor descriptor = test::one_light({1, 0, 0}, {1, 1, 1});
  descriptor.lights.push_back(test::light({0, 1, 0}, {5, 5, 5}));
  EXPECT_FLOAT_EQ(to_webxr(Lighting::of(descriptor)).value.primaryLightDirection.y, 1);
  // A colour matrix can make another light the strongest.
  descriptor.lights[0].irradiance = {0, 0, 30};
  ConversionOptions blue;
  blue.color = ColorMatrix::gains(0.1F, 0.1F, 10);
  EXPECT_FLOAT_EQ(to_webxr(Lighting::of(descriptor), ShSigns::positive, blue).value.primaryLightDirection.x, 1);
}

// --- No estimate ---

void expect_no_estimate(const Lighting& lighting, Validity why, const ConversionOptions& options = {}) {
  for (const EngineView& engine : every_engine(lighting, options)) {
    EXPECT_EQ(engine.validity, why) << engine.name;
    EXPECT_FALSE(engine.residual) << engine.name;
    for (const auto& n : reference::fibonacci_normals(16))
      for (const double e : engine.at(n)) EXPECT_EQ(e, 0) << engine.name;
  }
  EXPECT_FALSE(to_webxr(lighting, ShSigns::positive, options).has_estimate());
  EXPECT_EQ(to_webxr(lighting, ShSigns::positive, options).value.primaryLightDirection, (DomPoint{0, 1, 0, 0}));
  EXPECT_EQ(to_arcore(lighting, options).value.state, ArLightEstimateState::AR_LIGHT_ESTIMATE_STATE_NOT_VALID);
  const auto openxr = to_openxr(lighting, XrSphericalHarmonicsKind::ambient, ShSigns::positive, options).value;
  EXPECT_EQ(openxr.state, XrLightEstimateState::invalid);
  EXPECT_EQ(openxr.ambientLight.state, XrLightEstimateState::invalid);
  EXPECT_EQ(openxr.sphericalHarmonics.state, XrLightEstimateState::invalid);
  EXPECT_EQ(openxr.directionalLight.state, XrLightEstimateState::invalid);
  EXPECT_EQ(to_three(lighting, ThreeLights::physical, MainLight::apart, options).value.lightProbeIntensity, 0);
  EXPECT_EQ(to_filament(lighting, MainLight::apart, options).value.indirectIntensity, 0);
  EXPECT_EQ(to_arkit(lighting, options).value.ambientIntensity, 0);
}

TEST(ConventionFixtures, EmptyLightingIsNoEstimate) { expect_no_estimate(Lighting(), Validity::none); }

TEST(ConventionFixtures, NonFiniteLightIsNoEstimate) {
  for (const float bad : {kNan, kInf, -kInf, 3e38F}) {
    Descriptor harmonics = test::constant_scene({1, 1, 1});
    harmonics.radiance.c[0].g = bad;
    expect_no_estimate(Lighting::of(harmonics), Validity::invalid_query);
    expect_no_estimate(Lighting::of(test::one_light({0, 1, 0}, {1, bad, 1})), Validity::invalid_query);
  }
  Descriptor width = test::one_light({0, 1, 0}, {1, 1, 1}, kNan);
  expect_no_estimate(Lighting::of(width), Validity::invalid_query);
  Descriptor nowhere = test::one_light({0, 1, 0}, {1, 1, 1});
  nowhere.lights[0].direction = {};
  expect_no_estimate(Lighting::of(nowhere), Validity::invalid_query);
}

TEST(ConventionFixtures, NonFiniteColorMatrixIsRejected) {
  for (const float bad : {kNan, kInf}) {
    ConversionOptions options;
    options.color.m[1][2] = bad;
    EXPECT_FALSE(options.validate().ok());
    EXPECT_NE(options.validate().message().find("color"), std::string::npos);
    expect_no_estimate(Lighting::of(test::constant_scene({1, 1, 1})), Validity::invalid_query, options);
  }
}

TEST(ConventionFixtures, StaleLightIsConvertedAsStale) {
  const Lighting old = Lighting::of(test::constant_scene({1, 1, 1}), {312'000'000}, {250'000'000});
  const auto arcore = to_arcore(old);
  EXPECT_EQ(arcore.validity, Validity::stale);
  EXPECT_TRUE(arcore.has_estimate());
  EXPECT_EQ(arcore.value.state, ArLightEstimateState::AR_LIGHT_ESTIMATE_STATE_VALID);
}

TEST(ConventionFixtures, DarknessIsAnEstimate) {
  for (const EngineView& engine : every_engine(Lighting::of(Descriptor{}))) {
    EXPECT_EQ(engine.validity, Validity::valid) << engine.name;
    ASSERT_TRUE(engine.residual);
    EXPECT_EQ(*engine.residual, 0) << engine.name;
    for (const double e : engine.irradiance({0, 1, 0})) EXPECT_EQ(e, 0);
  }
}

}  // namespace
}  // namespace lightwell
