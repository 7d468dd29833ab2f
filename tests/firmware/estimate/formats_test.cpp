// The same scene in every pixel format, as a single exposure and as a bracket, gives the same light.
#include <cmath>

#include "scenes.hpp"
#include "sim/scene.hpp"
#include "sim/sensor.hpp"

namespace lightwell {
namespace {

using namespace testing_scenes;

sim::Panorama room() {
  // A room of two walls, floor and ceiling, and a soft lamp: range 1 to 400.
  return sim::from_function(512, [](Vec3d d) {
    Radiance l{1, 1, 1};
    if (d.x < -0.7) l = {2, 0.6F, 0.5F};
    if (d.x > 0.7) l = {0.5F, 1.5F, 0.6F};
    if (d.y < -0.6) l = {0.4F, 0.35F, 0.3F};
    const double a = angle_between(d, normalized(Vec3d{0.3, 0.8, -0.5}));
    const auto glow = static_cast<float>(400 * std::exp(-a * a / (2 * 0.08 * 0.08)));
    return l + Radiance{glow, 0.9F * glow, 0.7F * glow};
  });
}

std::vector<reference::Rgb> true_irradiance() {
  const sim::Panorama p = room();
  return reference::irradiance_at({p.width, p.height, {p.rgb.begin(), p.rgb.end()}},
                                  reference::fibonacci_normals(2048));
}

struct Exposed {
  std::vector<std::vector<std::byte>> bytes;
  std::vector<Frame> frames;
};

Exposed expose(const RigParameters& rig, PixelFormat format, const std::vector<double>& exposures) {
  const sim::Scene scene(room());
  Exposed out;
  std::vector<std::vector<float>> radiance;
  for (const LensParameters& lens : rig.lenses)
    radiance.push_back(sim::render_radiance(scene, scene.state_at(0), lens, 2));
  const sim::SensorModel model = sim::sensor_of(rig, format, 1);
  for (std::size_t e = 0; e < exposures.size(); ++e) {
    Frame frame;
    frame.info.exposure_s = exposures[e];
    frame.info.bracket_index = static_cast<int>(e);
    frame.info.bracket_size = static_cast<int>(exposures.size());
    for (std::size_t k = 0; k < rig.lenses.size(); ++k) {
      const sim::Sensor sensor(rig.lenses[k], model);
      std::vector<std::byte> pixels(sensor.bytes());
      sensor.expose(radiance[k], {exposures[e], 1, e, static_cast<int>(k)}, pixels);
      out.bytes.push_back(std::move(pixels));
      frame.add_view(
          {static_cast<int>(k), format, rig.lenses[k].width, rig.lenses[k].height, sensor.stride(), out.bytes.back()});
    }
    out.frames.push_back(std::move(frame));
  }
  return out;
}

double error_against(const std::vector<reference::Rgb>& truth, const Descriptor& d) {
  std::vector<reference::Rgb> got;
  for (const reference::V3& n : reference::fibonacci_normals(2048)) {
    const Irradiance e = irradiance_at(d, vec_cast<float>(Vec3d{n.x, n.y, n.z}));
    got.push_back({e.r, e.g, e.b});
  }
  const reference::IrradianceError e = reference::irradiance_error(truth, got);
  return std::max(e.rms, e.luminance_weighted);
}

class Formats : public testing::TestWithParam<PixelFormat> {};

TEST_P(Formats, BracketOfThreeReproducesTheScene) {
  const RigParameters rig = rig_of("pair", 320, 240, GetParam());
  // Full scale is a radiance of 0.01 / exposure (firmware/sim/sensor.hpp): 1000, 30 and 2.
  const Exposed e = expose(rig, GetParam(), {1e-5, 3.3e-4, 5e-3});
  Descriptor d;
  ASSERT_TRUE(estimator_of(rig)->estimate(e.frames, d).ok());
  EXPECT_FALSE(d.flags.any());

  const double error = error_against(true_irradiance(), d);
  EXPECT_LT(error, 0.03) << "required accuracy with the simulated 8-bit sensor";
  EXPECT_LE(error, d.bound.total);
  EXPECT_LT(d.bound.total, 0.06) << "the bound is too wide";
  ASSERT_FALSE(d.lights.empty());
  EXPECT_LT(degrees_between(d.lights[0].direction, {0.3, 0.8, -0.5}), 0.5);
}

TEST_P(Formats, SingleLongExposureIsFlaggedClipped) {
  const RigParameters rig = rig_of("pair", 320, 240, GetParam());
  const Exposed e = expose(rig, GetParam(), {5e-3});
  Descriptor d;
  ASSERT_TRUE(estimator_of(rig)->estimate(e.frames, d).ok());
  EXPECT_TRUE(d.flags.has(Flag::clipped));
  EXPECT_TRUE(std::isinf(d.bound.total));
  EXPECT_GT(d.saturated, 0.005F);
  EXPECT_LT(d.saturated, 0.1F);
}

TEST_P(Formats, BoundHoldsForTooShortExposures) {
  const RigParameters rig = rig_of("pair", 320, 240, GetParam());
  for (const double exposure : {1e-5, 3e-6, 1e-6}) {
    const Exposed e = expose(rig, GetParam(), {exposure});
    Descriptor d;
    ASSERT_TRUE(estimator_of(rig)->estimate(e.frames, d).ok());
    EXPECT_LE(error_against(true_irradiance(), d), d.bound.total) << exposure;
  }
}

TEST_P(Formats, AllSaturatedIsFlaggedAndALowerBound) {
  const RigParameters rig = rig_of("pair", 320, 240, GetParam());
  const Exposed e = expose(rig, GetParam(), {1.0});
  Descriptor d;
  ASSERT_TRUE(estimator_of(rig)->estimate(e.frames, d).ok());
  EXPECT_TRUE(d.flags.has(Flag::clipped));
  EXPECT_GT(d.saturated, 0.99F);
  EXPECT_GT(d.radiance.c[0].g, 0);
}

INSTANTIATE_TEST_SUITE_P(EveryFormat, Formats,
                         testing::Values(PixelFormat::rgb8, PixelFormat::nv12, PixelFormat::yuyv,
                                         PixelFormat::bayer_rggb10, PixelFormat::bayer_rggb12),
                         [](const auto& p) { return std::string(to_string(p.param)); });

}  // namespace
}  // namespace lightwell
