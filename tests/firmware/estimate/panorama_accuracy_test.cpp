// Accuracy on the eight real panoramas of blender-data, with an ideal sensor.
#include <cmath>

#include <gtest/gtest.h>

#include <lightwell/codec.hpp>

#include "reference/bright_region.hpp"
#include "scenes.hpp"
#include "sim/panorama.hpp"
#include "sim/scene.hpp"

namespace lightwell {
namespace {

using namespace testing_scenes;

class RealPanoramas : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    const Result<std::string> path = sim::scene_path(GetParam());
    ASSERT_TRUE(path.ok()) << path.status().message();
    Result<sim::Panorama> loaded = sim::load_panorama(*path);
    ASSERT_TRUE(loaded.ok()) << loaded.status().message();
    panorama_ = std::move(*loaded);
    // The loader has set negative values to zero; the oracle uses the same values.
    truth_ = {panorama_.width, panorama_.height, {panorama_.rgb.begin(), panorama_.rgb.end()}};
  }

  Descriptor estimate_with(const RigParameters& rig) const {
    const sim::Scene scene(panorama_);
    Picture p;
    p.frame.info.exposure_s = 1;
    for (const LensParameters& lens : rig.lenses)
      p.pixels.push_back(sim::render_radiance(scene, scene.state_at(0), lens, sim::samples_for(lens, panorama_)));
    for (std::size_t k = 0; k < rig.lenses.size(); ++k)
      p.frame.add_view({static_cast<int>(k), PixelFormat::rgb_f32, rig.lenses[k].width, rig.lenses[k].height,
                        packed_stride(PixelFormat::rgb_f32, rig.lenses[k].width),
                        std::as_bytes(std::span(p.pixels[k]))});
    return estimated(*estimator_of(rig), p);
  }

  void expect_right(const Descriptor& before_wire) const {
    Encoder encoder;
    const auto bytes = encoder.encode(before_wire);
    ASSERT_TRUE(bytes.ok());
    const Result<Descriptor> d = decode_descriptor(*bytes);
    ASSERT_TRUE(d.ok());
    std::vector<reference::Rgb> got;
    const auto normals = reference::fibonacci_normals(2048);
    for (const reference::V3& n : normals) {
      const Irradiance e = irradiance_at(*d, vec_cast<float>(Vec3d{n.x, n.y, n.z}));
      got.push_back({e.r, e.g, e.b});
    }
    const reference::IrradianceError e = reference::irradiance_error(reference::irradiance_at(truth_, normals), got);
    EXPECT_LE(e.rms, 0.02);
    EXPECT_LE(std::max(e.rms, e.luminance_weighted), d->bound.total);
    EXPECT_TRUE(std::isfinite(d->bound.total));
    const auto brightest = reference::bright_region(truth_);
    ASSERT_TRUE(brightest.has_value());
    if (brightest->peak_to_mean <= 100) return;
    double nearest = 180;
    for (const Light& l : d->lights)
      nearest = std::min(nearest, degrees_between(l.direction, {brightest->direction.x, brightest->direction.y,
                                                                brightest->direction.z}));
    EXPECT_LE(nearest, 0.5) << "degrees from the brightest region";
  }

  sim::Panorama panorama_;
  reference::Panorama truth_;
};

TEST_P(RealPanoramas, BackToBackPair) { expect_right(estimate_with(rig_of("pair", 640, 480))); }
TEST_P(RealPanoramas, DoubleSphereLenses) { expect_right(estimate_with(rig_of("double_sphere", 640, 480))); }

TEST_P(RealPanoramas, AsEquirectangularImage) {
  RigParameters rig = rig_of("equirect", panorama_.width, panorama_.height);
  Picture p;
  p.frame.info.exposure_s = 1;
  p.pixels.push_back(panorama_.rgb);
  p.frame.add_view({0, PixelFormat::rgb_f32, panorama_.width, panorama_.height,
                    packed_stride(PixelFormat::rgb_f32, panorama_.width), std::as_bytes(std::span(p.pixels[0]))});
  expect_right(estimated(*estimator_of(rig), p));
}

INSTANTIATE_TEST_SUITE_P(BlenderData, RealPanoramas,
                         testing::Values("city", "courtyard", "forest", "interior", "night", "studio", "sunrise",
                                         "sunset"),
                         [](const auto& p) { return std::string(p.param); });

}  // namespace
}  // namespace lightwell
