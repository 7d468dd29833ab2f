// Exposure and white balance against closed forms, published values, and the picture value of a white patch.
#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <lightwell/conventions.hpp>
#include <lightwell/exposure.hpp>

#include "host_sdk/engine_views.hpp"
#include "host_sdk/scenes.hpp"

namespace lightwell {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
/// A few operations in single precision.
constexpr double kTight = 1e-6;

double ev(double n, double t, double iso) {
  const auto out = ev100({n, t, iso});
  EXPECT_TRUE(out.ok()) << out.status().message();
  return out.ok() ? *out : kNan;
}

TEST(Exposure, ExposureValuesOfKnownCameras) {
  EXPECT_NEAR(ev(1, 1, 100), 0, 1e-12);
  // Sunny 16: f/16 at one over the ISO number is EV 14.97 = log2(256 * 125) at 100 with 1/125 s.
  EXPECT_NEAR(ev(16, 1 / 125.0, 100), 14.965784, 1e-6);
  EXPECT_NEAR(ev(4, 1 / 60.0, 100) - ev(4, 1 / 60.0, 200), 1, 1e-12) << "twice the sensitivity is one stop";
  EXPECT_NEAR(ev(4, 1 / 120.0, 100) - ev(4, 1 / 60.0, 100), 1, 1e-12) << "half the time is one stop";
  EXPECT_NEAR(ev(8, 1 / 60.0, 100) - ev(4, 1 / 60.0, 100), 2, 1e-12) << "twice the number is two stops";
}

TEST(Exposure, SaturatingLuminanceMatchesIso12232) {
  EXPECT_NEAR(saturating_luminance(0), 1.2, 1e-12);
  EXPECT_NEAR(saturating_luminance(15), 39321.6, 1e-8);  // 1.2 * 2^15
  for (const double e : {-3.0, 0.0, 7.5, 16.0}) {
    EXPECT_NEAR(ev100_of_saturating_luminance(saturating_luminance(e)), e, 1e-12);
    EXPECT_NEAR(exposure(e) * saturating_luminance(e), 1, 1e-12);
    EXPECT_NEAR(exposure(e) / exposure(e + 1), 2, 1e-12);
  }
}

TEST(Exposure, InvalidCameraIsRejectedByName) {
  for (const double bad : {0.0, -1.0, kNan, std::numeric_limits<double>::infinity()}) {
    EXPECT_NE(ev100({bad, 0.01, 100}).status().message().find("f_number"), std::string::npos);
    EXPECT_NE(ev100({4, bad, 100}).status().message().find("shutter_s"), std::string::npos);
    EXPECT_NE(ev100({4, 0.01, bad}).status().message().find("iso"), std::string::npos);
    PassThroughCamera camera;
    camera.calibration = bad;
    EXPECT_NE(mapping_of(camera).status().message().find("calibration"), std::string::npos);
    VarjoWhiteBalance varjo;
    varjo.white_balance_color_gains[1] = bad;
    EXPECT_NE(mapping_of(varjo).status().message().find("white_balance_color_gains"), std::string::npos);
    EXPECT_FALSE(white_adaptation({bad, 0.3}, kD65).ok());
    EXPECT_FALSE(mapping_of_patch({1, 1, 1}, {0.5F, 0.5F, 0.5F}, {0.5F, static_cast<float>(bad), 0.5F}).ok());
    EXPECT_FALSE(mapping_of_patch({1, static_cast<float>(bad), 1}, {0.5F, 0.5F, 0.5F}, {0.5F, 0.5F, 0.5F}).ok());
  }
  PassThroughCamera camera;
  camera.ev100 = kNan;
  EXPECT_NE(mapping_of(camera).status().message().find("ev100"), std::string::npos);
}

TEST(Exposure, ColourTemperatures) {
  // D65 is daylight of 6504 K; illuminant A is a black body of 2856 K (CIE 15).
  const auto d65 = chromaticity_of(6504, Locus::daylight);
  ASSERT_TRUE(d65.ok());
  EXPECT_NEAR(d65->x, 0.3127, 1e-4);
  EXPECT_NEAR(d65->y, 0.3291, 2e-4);
  const auto a = chromaticity_of(2856, Locus::planckian);
  ASSERT_TRUE(a.ok());
  EXPECT_NEAR(a->x, 0.44758, 6e-4);  // accuracy of the cubic fit
  EXPECT_NEAR(a->y, 0.40745, 6e-4);
  EXPECT_NEAR(correlated_temperature(kD65), 6504, 5);
  EXPECT_NEAR(correlated_temperature({0.44758, 0.40745}), 2856, 5);
  EXPECT_NEAR(correlated_temperature({0.34567, 0.35850}), 5003, 5);  // D50
  for (const double bad : {0.0, 1000.0, 30000.0, kNan}) {
    EXPECT_FALSE(chromaticity_of(bad, Locus::daylight).ok());
    EXPECT_FALSE(chromaticity_of(bad, Locus::planckian).ok());
  }
  EXPECT_FALSE(chromaticity_of(3000, Locus::daylight).ok());
  // The pieces of the fit are continuous.
  for (const auto& [seam, locus] :
       {std::pair{7000.0, Locus::daylight}, std::pair{2222.0, Locus::planckian}, std::pair{4000.0, Locus::planckian}}) {
    EXPECT_NEAR(chromaticity_of(seam, locus)->x, chromaticity_of(seam + 0.01, locus)->x, 3e-4);
    EXPECT_NEAR(chromaticity_of(seam, locus)->y, chromaticity_of(seam + 0.01, locus)->y, 3e-4);
  }
}

TEST(Exposure, WhiteIsD65) {
  const Chromaticity white = chromaticity_of(5, 5, 5);
  EXPECT_NEAR(white.x, 0.3127, 1e-6);
  EXPECT_NEAR(white.y, 0.3290, 1e-6);
  EXPECT_NEAR(chromaticity_of(1, 0, 0).x, 0.64, 1e-6);  // Rec. 709's red
  EXPECT_NEAR(chromaticity_of(0, 0, 1).y, 0.06, 1e-6);
  EXPECT_EQ(chromaticity_of(0, 0, 0), kD65);
}

TEST(Exposure, BradfordMatchesPublishedMatrices) {
  // sRGB adapted to D50, as in every ICC profile (Lindbloom, "RGB/XYZ Matrices"): from linear r, g, b to XYZ. Ours
  // gives r, g, b; sRGB's own matrix makes XYZ of them.
  const double d50[3][3] = {
      {0.4360747, 0.3850649, 0.1430804}, {0.2225045, 0.7168786, 0.0606169}, {0.0139322, 0.0971045, 0.7141733}};
  const double srgb[3][3] = {
      {0.4124564, 0.3575761, 0.1804375}, {0.2126729, 0.7151522, 0.0721750}, {0.0193339, 0.1191920, 0.9503041}};
  const auto m = white_adaptation(kD65, {0.34567, 0.35850});
  ASSERT_TRUE(m.ok());
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      double xyz = 0;
      for (std::size_t k = 0; k < 3; ++k) xyz += srgb[i][k] * static_cast<double>(m->m[k][j]);
      // Tolerance: white points with four digits.
      EXPECT_NEAR(xyz, d50[i][j], 3e-4) << i << j;
    }
}

TEST(Exposure, AdaptationToTheSameWhiteIsTheIdentityAndInverts) {
  const Chromaticity a{0.44758, 0.40745};
  const auto none = white_adaptation(a, a), there = white_adaptation(kD65, a), back = white_adaptation(a, kD65);
  ASSERT_TRUE(none.ok() && there.ok() && back.ok());
  const ColorMatrix round = *back * *there;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      EXPECT_NEAR(none->m[i][j], i == j ? 1 : 0, kTight);
      EXPECT_NEAR(round.m[i][j], i == j ? 1 : 0, 1e-5);
    }
}

TEST(Exposure, LightOfTheCamerasWhiteIsNeutralWithTheSameLuminance) {
  for (const Chromaticity white : {kD65, Chromaticity{0.44758, 0.40745}, Chromaticity{0.28, 0.29}}) {
    PassThroughCamera camera;
    camera.ev100 = 9;
    camera.white = white;
    const auto mapping = mapping_of(camera);
    ASSERT_TRUE(mapping.ok());
    // That light in our colour, of the luminance that saturates.
    const auto to_white = white_adaptation(kD65, white);
    ASSERT_TRUE(to_white.ok());
    const auto saturating = static_cast<float>(saturating_luminance(9));
    const Radiance seen = *mapping * (*to_white * Radiance{saturating, saturating, saturating});
    EXPECT_NEAR(seen.r, 1, 1e-5);
    EXPECT_NEAR(seen.g, 1, 1e-5);
    EXPECT_NEAR(seen.b, 1, 1e-5);
  }
}

TEST(Exposure, RenderedWhitePatchMatchesTheCamerasPicture) {
  // White paper under 800 lux of lamp light; the camera is exposed for half of saturation, with another white point.
  const Chromaticity lamp{0.44758, 0.40745};
  const auto of_lamp = white_adaptation(kD65, lamp);
  ASSERT_TRUE(of_lamp.ok());
  const Irradiance e = *of_lamp * Irradiance{800, 800, 800};
  PassThroughCamera camera;
  camera.ev100 = ev100_of_saturating_luminance(2 * 800 / std::numbers::pi);
  camera.white = lamp;
  ConversionOptions options;
  const auto mapping = mapping_of(camera);
  ASSERT_TRUE(mapping.ok());
  options.color = *mapping;
  for (const auto& engine : test::every_engine(Lighting::of(test::one_light({0, 1, 0}, e)), options)) {
    // A point light in bands 0 to 2 gives 1/4 + 1/2 + 5/16 of its irradiance at normal incidence.
    const double held = engine.main == test::MainLightIs::apart ? 1 : 1.0625;
    const auto up = engine.at({0, 1, 0});
    for (const double channel : up) EXPECT_NEAR(channel / std::numbers::pi, 0.5 * held, 1e-5) << engine.name;
  }
}

TEST(Exposure, PatchInThePictureGivesTheGains) {
  const Irradiance e{500, 400, 300};
  const Albedo grey{0.18F, 0.18F, 0.2F};
  const std::array<float, 3> seen{0.2F, 0.25F, 0.3F};
  const auto mapping = mapping_of_patch(e, grey, seen);
  ASSERT_TRUE(mapping.ok());
  const Radiance shown = *mapping * reflected_radiance(e, grey);
  EXPECT_NEAR(shown.r, 0.2, kTight);
  EXPECT_NEAR(shown.g, 0.25, kTight);
  EXPECT_NEAR(shown.b, 0.3, kTight);
  // In relative units all light has one unknown factor, which the patch determines.
  const auto relative = mapping_of_patch(e * 0.01F, grey, seen);
  ASSERT_TRUE(relative.ok());
  const Radiance same = *relative * reflected_radiance(e * 0.01F, grey);
  EXPECT_NEAR(same.g, 0.25, kTight);
}

TEST(Exposure, VarjoMatricesAreAppliedInOrder) {
  VarjoWhiteBalance camera;
  camera.inv_ccm.m = {{{1, 2, 0}, {0, 1, 0}, {0, 0, 1}}};
  camera.white_balance_color_gains = {2, 3, 5};
  camera.ccm.m = {{{1, 0, 0}, {7, 1, 0}, {0, 0, 1}}};
  camera.ev100 = ev100_of_saturating_luminance(10);
  camera.calibration = 2;
  const auto mapping = mapping_of(camera);
  ASSERT_TRUE(mapping.ok());
  // By hand: (1, 1, 1) -> (3, 1, 1) -> (6, 3, 5) -> (6, 45, 5), times 2 / 10.
  const Radiance out = *mapping * Radiance{1, 1, 1};
  EXPECT_NEAR(out.r, 1.2, 1e-5);
  EXPECT_NEAR(out.g, 9, 1e-5);
  EXPECT_NEAR(out.b, 1, 1e-5);
}

TEST(Exposure, ColorMatrixProductAppliesTheRightFactorFirst) {
  const ColorMatrix a{{{{1, 2, 0}, {0, 1, 0}, {0, 3, 1}}}}, b = ColorMatrix::gains(2, 3, 4);
  const Radiance c{1, 10, 100};
  EXPECT_EQ((a * b) * c, a * (b * c));
  EXPECT_EQ(ColorMatrix::scale(kPi) * (Radiance{1, 1, 1}), (Radiance{kPi, kPi, kPi}));
}

}  // namespace
}  // namespace lightwell
