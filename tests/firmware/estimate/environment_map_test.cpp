// The map of the panorama estimator: texels are means of pixels, lights included once.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include <lightwell/cap.hpp>
#include <lightwell/environment.hpp>

#include "brackets.hpp"
#include "estimate/common/environment_updates.hpp"
#include "scenes.hpp"

namespace lightwell {
namespace {

using namespace testing_scenes;

EstimatorConfig with_map(int edge, int max_lights) {
  EstimatorConfig config = everything(6, max_lights);
  config.panorama.environment_edge = edge;
  return config;
}

/// Mean of a scene over each texel of a map, by 16 x 16 samples.
std::vector<double> means_of(int edge, const RadianceOf& scene) {
  const estimate::OctahedralGrid fine(edge, 16);
  std::vector<double> out(fine.texels());
  for (std::size_t k = 0; k < fine.sample.size(); ++k)
    out[k / fine.per_texel()] += static_cast<double>(scene(vec_cast<double>(fine.sample[k].direction)).g) *
                                 fine.sample[k].solid_angle / fine.solid_angle[k / fine.per_texel()];
  return out;
}

double green(const Descriptor& d, std::size_t texel) {
  return texel_radiance(d.environment->texels[texel], d.environment->exponent).g;
}

/// Halves of different radiance, whose edge crosses texels obliquely.
Radiance halves(Vec3d d) {
  const float v = d.x + 0.4 * d.y - 0.3 * d.z > 0.1 ? 4.0F : 1.0F;
  return {v, v, v};
}

TEST(PanoramaMap, TexelsAreTheMeansOfTheirPixels) {
  const int edge = 64;
  for (const char* kind : {"equirect", "pair"}) {
    const RigParameters rig = std::string(kind) == "pair" ? rig_of(kind, 640, 480) : rig_of(kind, 1024, 512);
    const Descriptor d = estimated(rig, halves, with_map(edge, 0));
    ASSERT_TRUE(d.environment && d.environment->whole());
    const std::vector<double> expected = means_of(edge, halves);
    double squares = 0;
    for (std::size_t k = 0; k < expected.size(); ++k) squares += std::pow(green(d, k) - expected[k], 2);
    // A texel at the edge has 8 or 9 pixels across: the edge is off by a thirtieth of the texel. Sums over blocks as
    // wide as texels have 0.15.
    EXPECT_LT(std::sqrt(squares / static_cast<double>(expected.size())), 0.04) << kind;
  }
}

TEST(PanoramaMap, TexelsOfABracketAreTheMeansOfItsScene) {
  const RigParameters rig = rig_of("pair", 640, 480, PixelFormat::rgb8);
  const Result<RigTable> table = make_rig_table(rig);
  ASSERT_TRUE(table.ok());
  // Of the brighter half, the longer exposure is saturated.
  const RadianceOf scenes[] = {halves, halves};
  const double exposures[] = {0.002, 0.008};
  const Bracket bracket = bracket_of(rig, *table, PixelFormat::rgb8, scenes, exposures);
  Descriptor d;
  ASSERT_TRUE(estimator_of(rig, with_map(64, 0))->estimate(bracket.frames, d).ok());
  ASSERT_TRUE(d.environment && d.environment->whole());
  const std::vector<double> expected = means_of(64, halves);
  double squares = 0;
  for (std::size_t k = 0; k < expected.size(); ++k) squares += std::pow(green(d, k) - expected[k], 2);
  EXPECT_LT(std::sqrt(squares / static_cast<double>(expected.size())), 0.05);
}

TEST(PanoramaMap, ConstantSphereRemainsConstant) {
  for (const int edge : {16, 64}) {
    const Descriptor d = estimated(
        rig_of("pair", 640, 480),
        [](Vec3d) {
          return Radiance{3, 3, 3};
        },
        with_map(edge, 8));
    ASSERT_TRUE(d.environment);
    for (std::size_t k = 0; k < d.environment->texels.size(); ++k) EXPECT_NEAR(green(d, k), 3, 3 * 0.004) << edge;
  }
}

TEST(PanoramaMap, MapAndLightsAddUpToAWindow) {
  const int edge = 64;
  // 40 x 16 degrees.
  const auto window = [](Vec3d d) {
    const float v = d.z < 0 && std::abs(d.x) < 0.34 && std::abs(d.y) < 0.14 ? 30.0F : 1.0F;
    return Radiance{v, v, v};
  };
  const Descriptor d = estimated(rig_of("pair", 640, 480), window, with_map(edge, 8));
  ASSERT_TRUE(d.environment);
  ASSERT_EQ(d.lights.size(), 1U);
  const Light& light = d.lights[0];
  const std::vector<double> expected = means_of(edge, window),
                            cap = means_of(edge, [&](Vec3d to) {
                              const bool inside =
                                  dot(vec_cast<float>(to), light.direction) > std::cos(light.angular_radius_rad);
                              const auto l = static_cast<float>(
                                  inside ? light.irradiance.g / cap_vector_irradiance(light.angular_radius_rad) : 0);
                              return Radiance{l, l, l};
                            });
  double brightest = 0;
  for (std::size_t k = 0; k < expected.size(); ++k) {
    brightest = std::max(brightest, green(d, k));
    // Level 0 holds nothing negative: beside the window the cap alone is seen.
    EXPECT_NEAR(green(d, k) + cap[k], std::max(expected[k], cap[k]), 0.08 * 30) << k;
  }
  // The ends of the window, which the cap does not reach, stay in the map.
  EXPECT_GT(brightest, 20);
}

/// A window of 40 x 16 degrees and a lamp of 0.5 degrees, whose light is as strong.
Radiance window_and_lamp(Vec3d d) {
  float v = d.z < 0 && std::abs(d.x) < 0.34 && std::abs(d.y) < 0.14 ? 30.0F : 1.0F;
  if (dot(d, normalized(Vec3d{0.6, 0.7, 0.4})) > std::cos(0.25 * std::numbers::pi / 180)) v = 80'000;
  return {v, v, v};
}

/// Root of the mean squared difference between a mirror as a reader draws it and the scene, over directions within
/// 30 degrees of `axis`.
double mirror_error(const EnvironmentMap& mirror, std::span<const Light> caps, const RadianceOf& scene, Vec3f axis) {
  const estimate::OctahedralGrid places(64, 8);
  double squares = 0, count = 0;
  for (const auto& sample : places.sample) {
    if (dot(sample.direction, axis) < 0.87F) continue;
    double shown = environment_radiance(mirror, sample.direction, 0).g;
    for (const Light& cap : caps)
      if (dot(sample.direction, cap.direction) > std::cos(cap.angular_radius_rad))
        shown += cap.irradiance.g / cap_vector_irradiance(cap.angular_radius_rad);
    squares += std::pow(shown - static_cast<double>(scene(vec_cast<double>(sample.direction)).g), 2);
    ++count;
  }
  return std::sqrt(squares / count);
}

TEST(PanoramaMap, AWindowIsShownByTexelsAndALampByACap) {
  for (const int edge : {32, 64}) {
    const Descriptor d = estimated(rig_of("pair", 1280, 960), window_and_lamp, with_map(edge, 8));
    ASSERT_TRUE(d.environment);
    ASSERT_EQ(d.lights.size(), 2U);
    const Light& window = d.lights[0].angular_radius_rad > 0.1F ? d.lights[0] : d.lights[1];
    EXPECT_EQ(d.environment->light_tracks, std::vector<std::uint32_t>{window.track}) << edge;
    const EnvironmentMap mirror = first_level_with_lights(*d.environment);
    // Bilinear interpolation over the edge of the window is the rest; the cap adds to it what it has beside the window.
    const double as_texels = mirror_error(mirror, {}, window_and_lamp, {0, 0, -1}),
                 as_cap = mirror_error(*d.environment, {&window, 1}, window_and_lamp, {0, 0, -1});
    EXPECT_LT(as_texels, 0.6 * as_cap) << edge;
  }
}

TEST(PanoramaMap, ALightKeepsItsChoiceWhileBothAreAboutAsGood) {
  // A disc of two texels' radius that grows and shrinks by a tenth.
  const RigParameters rig = rig_of("pair", 640, 480);
  const auto estimator = estimator_of(rig, with_map(64, 1));
  std::vector<bool> as_texels;
  for (int frame = 0; frame < 20; ++frame) {
    const double radius = 0.1 * (1 + 0.1 * std::sin(frame));
    const auto disc = [radius](Vec3d d) {
      const float v = d.x > std::cos(radius) ? 50.0F : 1.0F;
      return Radiance{v, v, v};
    };
    Picture picture = picture_of(rig, disc);
    picture.frame.info.mid_exposure = {frame * std::int64_t{200'000'000}};
    const Descriptor d = estimated(*estimator, picture);
    ASSERT_TRUE(d.environment);
    as_texels.push_back(!d.environment->light_tracks.empty());
  }
  EXPECT_TRUE(std::adjacent_find(as_texels.begin(), as_texels.end(), std::not_equal_to<>()) == as_texels.end());
}

TEST(PanoramaMap, DirectionsOfAMissingLensAreDark) {
  const RigParameters rig = rig_of("pair", 640, 480);
  Picture picture = picture_of(rig, [](Vec3d) { return Radiance{3, 3, 3}; });
  Frame one;
  one.info = picture.frame.info;
  one.add_view(picture.frame.views()[0]);
  EstimatorConfig config = with_map(64, 0);
  config.panorama.unseen = UnseenFill::none;
  const auto estimator = estimator_of(rig, config);
  Descriptor d;
  ASSERT_TRUE(estimator->estimate({&one, 1}, d).ok());
  ASSERT_TRUE(d.environment);
  for (std::size_t k = 0; k < 64 * 64; ++k) {
    const Vec3f to = texel_direction(64, static_cast<int>(k % 64), static_cast<int>(k / 64));
    if (std::abs(to.z) < 0.3F) continue;
    EXPECT_NEAR(green(d, k), to.z < 0 ? 3 : 0, 3 * 0.01);
  }
}

TEST(PanoramaMap, OneHotPixelAndInvalidPixelsStayFinite) {
  const RigParameters rig = rig_of("equirect", 1024, 512);
  const auto estimator = estimator_of(rig, with_map(64, 16));
  Picture picture = picture_of(rig, [](Vec3d) { return Radiance{1, 1, 1}; });
  for (const float value :
       {1e5F, 1e20F, 1e29F, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    // A pole, the seam and the middle.
    for (const std::size_t pixel : {0, 1024 * 256, 1024 * 256 + 512}) {
      float* const hot = &picture.pixels[0][3 * pixel];
      std::fill_n(hot, 3, value);
      // Beyond the interval of whole maps.
      picture.frame.info.mid_exposure.ns += 2'000'000'000;
      const Descriptor d = estimated(*estimator, picture);
      std::fill_n(hot, 3, 1.0F);
      ASSERT_TRUE(d.environment && d.environment->whole()) << value;
      // The texel of +X; beside 1e20 it is below the range of RGB9E5.
      if (!(value > 1e6F) || std::isinf(value)) {
        EXPECT_NEAR(green(d, 64 * 32 + 48), 1, 0.01) << value << ' ' << pixel;
      }
      for (std::size_t k = 0; k < d.environment->texels.size(); ++k) ASSERT_TRUE(std::isfinite(green(d, k)));
    }
  }
}

}  // namespace
}  // namespace lightwell
