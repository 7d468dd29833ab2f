// Reflections of real panoramas without an environment map are nowhere black where there is light, at any roughness.
#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/geometry.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/lobes.hpp>

#include "estimate/panorama/panorama_estimator.hpp"
#include "measure/panorama_truth.hpp"
#include "measure/shots.hpp"
#include "sim/panorama.hpp"
#include "sim/sensor.hpp"

namespace lightwell {
namespace {

constexpr int kDirections = 300;

TEST(Reflections, AreNowhereBlackInEightPanoramas) {
  const Result<std::vector<std::string>> paths = measure::eight_panoramas();
  ASSERT_TRUE(paths.ok()) << paths.status().message();
  const RigParameters rig = *sim::make_rig("pair", 640, 480, PixelFormat::rgb_f32);
  measure::Camera camera(rig, PixelFormat::rgb_f32);
  for (const std::string& path : *paths) {
    const Result<measure::PanoramaTruth> truth = measure::load_panorama_truth(path);
    ASSERT_TRUE(truth.ok()) << truth.status().message();
    Result<sim::Panorama> panorama = sim::load_panorama(path);
    ASSERT_TRUE(panorama.ok()) << panorama.status().message();
    const sim::Scene scene(std::move(*panorama));
    const double second[] = {1};
    const measure::Shot shot = camera.expose(camera.render(scene, scene.state_at(0)), second, 0);
    auto estimator = make_panorama_estimator(rig, {});
    ASSERT_TRUE(estimator.ok());
    Result<measure::Delivered> delivered = measure::deliver(**estimator, shot);
    ASSERT_TRUE(delivered.ok());
    const Lighting light = Lighting::of(std::move(delivered->descriptor));
    for (const double roughness : {0.0, 0.1, 0.25, 0.4, 0.5, 0.75, 1.0}) {
      double darkest = 1e9;
      int dark = 0;
      for (int i = 0; i < kDirections; ++i) {
        const Vec3d lattice = fibonacci_direction(i, kDirections);
        const reference::V3 d{lattice.x, lattice.z, lattice.y};
        const Vec3f direction = vec_cast<float>(Vec3d{d.x, d.y, d.z});
        const Radiance got = light.radiance(direction, static_cast<float>(roughness)).value;
        EXPECT_TRUE(got.r >= 0 && got.g >= 0 && got.b >= 0) << truth->name << " " << roughness;
        // Six bands have the resolution of roughness 0.5. A mirror reflection excludes the lights, which would be
        // spread.
        double lights = 0;
        const double soft = std::max(roughness, 0.5);
        if (roughness < 0.5) {
          const GgxLobe narrow(roughness), wide(soft);
          for (const Light& l : light.lights()) {
            const double x = static_cast<double>(dot(l.direction, direction));
            lights += static_cast<double>(l.irradiance.luminance()) *
                      (wide.value(x) - (roughness > 0 ? narrow.value(x) : 0.0));
          }
        }
        const reference::Rgb want = truth->sums.radiance(d, soft);
        const double true_luminance = 0.2126 * want[0] + 0.7152 * want[1] + 0.0722 * want[2];
        const double ratio = (static_cast<double>(got.luminance()) + std::max(0.0, lights)) / true_luminance;
        darkest = std::min(darkest, ratio);
        dark += ratio < 0.3 ? 1 : 0;
      }
      RecordProperty(truth->name + "_" + std::to_string(roughness), std::to_string(darkest));
      EXPECT_GT(darkest, 0.08) << truth->name << " " << roughness;
      EXPECT_LT(dark, kDirections / 20) << truth->name << " " << roughness;
      // The view of hil/demo.
      if (truth->name == "city") {
        EXPECT_GT(darkest, 0.3) << roughness;
      }
    }
  }
}

}  // namespace
}  // namespace lightwell
