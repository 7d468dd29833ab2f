// Where colours meet in pixels that share chroma, the bound has what their light may be wrong by.
#include "estimate/panorama/shared_chroma.hpp"

#include <cmath>
#include <random>
#include <span>
#include <vector>

#include "brackets.hpp"
#include "estimate/panorama/sphere_integrator.hpp"

namespace lightwell::estimate {
namespace {

using namespace testing_scenes;

/// Full scale is a radiance of 3 (firmware/sim/sensor.hpp).
const std::vector<double> kExposure{3.3e-3};

/// Squares of two colours, `step` rad wide.
RadianceOf checker(Radiance first, Radiance second, double step) {
  return [=](Vec3d d) {
    const int cell = static_cast<int>(std::floor(std::acos(std::clamp(d.y, -1.0, 1.0)) / step)) +
                     static_cast<int>(std::floor((std::atan2(d.x, d.z) + 4) / step));
    return cell % 2 == 0 ? first : second;
  };
}

FrameIntegral integral_of(const RadianceOf& scene, PixelFormat format) {
  const RigParameters rig = rig_of("pair", 320, 240, format);
  const RigTable table = *make_rig_table(rig);
  const Bracket bracket = bracket_of(rig, table, format, std::span(&scene, 1), kExposure);
  RowReader reader(rig, table);
  EXPECT_TRUE(reader.bind(bracket.frames).ok());
  SphereIntegrator integrator(rig, table, 8);
  return integrator.integrate(reader, bracket.frames, UnseenFill::mirror, {1, 0});
}

TEST(SharedChroma, BoundsTheErrorOfChecksOfTwoColours) {
  std::mt19937 random(5);
  const auto uniform = [&](double least, double most) {
    return std::uniform_real_distribution<double>(least, most)(random);
  };
  double ratios = 0;
  int count = 0;
  for (int k = 0; k < 10; ++k) {
    // Bright and dark, near white and saturated.
    const auto color = [&](double luminance) {
      const double least = k % 2 == 0 ? 0.02 : 0.4;
      const Radiance c{static_cast<float>(uniform(least, 1)), static_cast<float>(uniform(least, 1)),
                       static_cast<float>(uniform(least, 1))};
      return c * (static_cast<float>(luminance) / std::max({c.r, c.g, c.b}));
    };
    const RadianceOf scene = checker(color(2.5), color(uniform(0.02, 2.5)), uniform(0.1, 0.5));
    const FrameIntegral own = integral_of(scene, PixelFormat::rgb8);
    EXPECT_EQ(own.shared_chroma, 0);
    for (const PixelFormat format : {PixelFormat::nv12, PixelFormat::yuyv}) {
      const FrameIntegral shared = integral_of(scene, format);
      Projection difference;
      for (std::size_t i = 0; i < kRowCount; ++i)
        for (std::size_t c = 0; c < 3; ++c) difference.c[i][c] = shared.projection.c[i][c] - own.projection.c[i][c];
      const double error = irradiance_rms(difference).plain, bound = shared.shared_chroma / std::sqrt(6.0);
      // Codes of YCbCr are rounded: half a code is up to 1 % of a channel.
      EXPECT_LE(error, bound + 4e-3 * irradiance_rms(own.projection).plain) << to_string(format) << ", scene " << k;
      ratios += error > 0 ? bound / error : 0;
      ++count;
    }
  }
  // It is not arbitrarily wide.
  EXPECT_LT(ratios / count, 6);
}

TEST(SharedChroma, IgnoresNoiseAndEdgesWithoutColour) {
  const Radiance bright{2.5F, 2.4F, 2.3F}, dark{0.1F, 0.1F, 0.1F};
  for (const PixelFormat format : {PixelFormat::nv12, PixelFormat::yuyv})
    for (const auto& scene : {checker(bright, bright, 0.3), checker(bright, dark, 0.3), checker(dark, dark, 0.3)}) {
      const FrameIntegral integral = integral_of(scene, format);
      EXPECT_LT(integral.shared_chroma / std::sqrt(6.0) / irradiance_rms(integral.projection).plain, 1e-3);
    }
}

}  // namespace
}  // namespace lightwell::estimate
