// The reference for other engines compared with tables in their documentation and with light in closed form.
#include <cstddef>

#include <gtest/gtest.h>

#include "reference/engines/ar_platforms.hpp"
#include "reference/engines/condon_shortley.hpp"
#include "reference/engines/frames.hpp"
#include "reference/engines/renderers.hpp"
#include "reference/harmonics.hpp"
#include "reference/test_support.hpp"

namespace lightwell::reference::engines {
namespace {

/// The tables have six decimals.
constexpr double printed = 6e-7;
constexpr double y00 = 0.28209479177387814;

void expect_same(const Rgb& e, double r, double g, double b, double tolerance) {
  EXPECT_NEAR(e[0], r, tolerance);
  EXPECT_NEAR(e[1], g, tolerance);
  EXPECT_NEAR(e[2], b, tolerance);
}

TEST(Engines, CondonShortleyDiffersInOddOrders) {
  for (const V3& d : fibonacci_normals(64)) {
    const auto ours = harmonics(d, 3);
    for (int l = 0; l <= 3; ++l)
      for (int m = -l; m <= l; ++m) {
        const double sign = m % 2 == 0 ? 1 : -1;
        EXPECT_NEAR(condon_shortley(l, m, d), sign * ours[static_cast<std::size_t>(harmonic_index(l, m))], rounding);
      }
  }
}

TEST(Engines, FilamentsTableOfTheFunctions) {
  // IndirectLight.h, column A_l^m, at directions where only one term remains: A times its polynomial.
  const double a[9] = {0.282095, -0.488602, 0.488602, -0.488602, 1.092548, -1.092548, 0.315392, -1.092548, 0.546274};
  const double r = std::sqrt(0.5);
  const V3 at[9] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 0}, {r, r, 0}, {0, r, r}, {0, 0, 1}, {r, 0, r}, {1, 0, 0}};
  const double polynomial[9] = {1, 1, 1, 1, 0.5, 0.5, 2, 0.5, 1};
  for (int l = 0, i = 0; l <= 2; ++l)
    for (int m = -l; m <= l; ++m, ++i)
      EXPECT_NEAR(condon_shortley(l, m, at[i]), a[i] * polynomial[i], 2 * printed) << i;
}

TEST(Engines, ArCoresTableOfFactors) {
  // HelloArActivity.sphericalHarmonicFactors, one coefficient at a time: what a white surface reflects.
  const double factor[9] = {0.282095,  -0.325735, 0.325735,  -0.325735, 0.273137,
                            -0.273137, 0.078848,  -0.273137, 0.136569};
  for (const V3& n : fibonacci_normals(32)) {
    const double polynomial[9] = {
        1, n.y, n.z, n.x, n.y * n.x, n.y * n.z, 3 * n.z * n.z - 1, n.z * n.x, n.x * n.x - n.y * n.y};
    for (std::size_t i = 0; i < 9; ++i) {
      ArCoreEstimate e;
      e.ambient_spherical_harmonics[3 * i + 1] = 1;
      expect_same(arcore_irradiance(e, n), 0, pi * factor[i] * polynomial[i], 0, 2 * pi * printed);
    }
  }
}

TEST(Engines, UniformRadianceGivesPiTimesItInAllEngines) {
  const double c0 = 1 / y00;  // the first coefficient of radiance 1
  ArCoreEstimate arcore;
  WebXrEstimate webxr;
  OpenXrEstimate openxr;
  std::array<double, 27> arkit{};
  UnityScene unity;
  ThreeScene three;
  FilamentScene filament;
  UnrealScene unreal;
  openxr.state = openxr.harmonics_state = 0;
  filament.indirect_intensity = 1;
  for (std::size_t k = 0; k < 3; ++k) {
    const double l = static_cast<double>(k + 1);
    arcore.ambient_spherical_harmonics[k] = webxr.spherical_harmonics_coefficients[k] = l * c0;
    openxr.coefficients[0][k] = arkit[9 * k] = three.sh[0][k] = filament.radiance[0][k] = l * c0;
    // RenderSettings.ambientProbe of an ambient light is its colour; so is Filament's "average irradiance".
    unity.sh[k][0] = filament.irradiance[0][k] = l;
  }
  unreal.r[0] = c0, unreal.g[0] = 2 * c0, unreal.b[0] = 3 * c0;
  for (const V3& n : fibonacci_normals(16)) {
    for (const Rgb& e :
         {arcore_irradiance(arcore, n), webxr_irradiance_as_browsers_give_it(webxr, n),
          webxr_irradiance_as_three_js_reads_it(webxr, n), openxr_irradiance(openxr, OpenXrBasis::condon_shortley, n),
          openxr_irradiance(openxr, OpenXrBasis::ramamoorthi_hanrahan, n), arkit_irradiance(arkit, n),
          unity_irradiance(unity, UnityPipeline::universal, n), three_irradiance(three, ThreeLights::physical, n),
          filament_irradiance(filament, n), filament_irradiance_from_radiance(filament, n),
          unreal_irradiance(unreal, n)})
      expect_same(e, pi, 2 * pi, 3 * pi, 1e-12);
  }
}

TEST(Engines, ADirectionalLightOfPiLuxGivesAWhiteSurfaceUnitRadiance) {
  // pi lux on a white matte surface that faces the light give 1 cd/m2: Lagarde & de Rousiers 2014, section 3.
  const V3 up{0, 1, 0};
  UnityScene unity{{}, {0, -1, 0}, {1, 1, 1}, pi};
  expect_same(unity_irradiance(unity, UnityPipeline::high_definition, up), pi, pi, pi, 1e-12);
  unity.light_intensity = 1;
  expect_same(unity_irradiance(unity, UnityPipeline::universal, up), pi, pi, pi, 1e-12);
  ThreeScene three{{}, 1, {0, 5, 0}, {1, 1, 1}, pi};
  expect_same(three_irradiance(three, ThreeLights::physical, up), pi, pi, pi, 1e-12);
  three.light_intensity = 1;
  expect_same(three_irradiance(three, ThreeLights::legacy, up), pi, pi, pi, 1e-12);
  FilamentScene filament;
  filament.light_direction = {0, -1, 0};
  filament.light_color = {1, 1, 1};
  filament.light_intensity_lux = pi;
  expect_same(filament_irradiance(filament, up), pi, pi, pi, 1e-12);
  UnrealScene unreal;
  unreal.light_forward = {0, 0, -1};
  unreal.light_color = {1, 1, 1};
  unreal.light_intensity_lux = pi;
  expect_same(unreal_irradiance(unreal, unreal_frame.up), pi, pi, pi, 1e-12);
  expect_same(unreal_irradiance(unreal, -1.0 * unreal_frame.up), 0, 0, 0, 1e-12);
}

TEST(Engines, UnrealsPackingIsItsFunctionsAndTheCosine) {
  for (const V3& n : fibonacci_normals(32)) {
    const auto y = unreal_basis(n);
    for (int l = 0, i = 0; l <= 2; ++l)
      for (int m = -l; m <= l; ++m, ++i) {
        UnrealScene scene;
        scene.g[static_cast<std::size_t>(i)] = 1;
        const double expected = cosine_lobe(l) * y[static_cast<std::size_t>(i)];
        expect_same(unreal_irradiance(scene, n), 0, expected, 0, 1e-12);
      }
  }
}

TEST(Engines, LeftHandedFramesMirror) {
  const auto handedness = [](const Frame& f) { return dot(cross(f.right, f.up), f.forward); };
  EXPECT_EQ(handedness(y_up_right_handed), -1);  // forward is -Z
  EXPECT_EQ(handedness(unity_frame), 1);
  EXPECT_EQ(handedness(unreal_frame), 1);
}

}  // namespace
}  // namespace lightwell::reference::engines
