// Recovery of a sun that every exposure clips, from a reading of a meter or of a grey patch, through the simulated
// sensor.
#include <cmath>
#include <numbers>

#include "brackets.hpp"

namespace lightwell {
namespace {

using namespace testing_scenes;

constexpr double kSunRadius = 0.03;
constexpr float kSun = 30'000;

Vec3d sun_at(double degrees) {
  const double a = degrees * std::numbers::pi / 180;
  return {std::cos(a) * 0.5, 0.85, -std::sin(a) * 0.5};
}

/// Outdoor scene: a sun with a soft edge, so that its energy in pixels does not depend on its position, and a sky.
RadianceOf open_air(Vec3d sun, float radiance = kSun) {
  const Vec3d axis = normalized(sun);
  return [=](Vec3d d) {
    const float sky = d.y > 0 ? static_cast<float>(6 + 4 * d.y) : 2;
    const double a = angle_between(d, axis) / kSunRadius;
    const auto l = static_cast<float>(radiance * std::exp(-a * a));
    return Radiance{0.8F * sky + l, 0.9F * sky + l, sky + l};
  };
}

class ClippedRecovery : public testing::Test {
 protected:
  static constexpr PixelFormat kFormat = PixelFormat::rgb8;
  /// Full scales of 1000 and 30: the sun is clipped thirtyfold.
  const std::vector<double> exposures_{1e-5, 3.3e-4};
  RigParameters rig_ = rig_of("pair", 320, 240, kFormat);
  RigTable table_ = *make_rig_table(rig_);
  std::unique_ptr<Estimator> estimator_ = estimator_of(rig_, [] {
    EstimatorConfig c;
    c.panorama.smoothing = Smoothing::none;
    return c;
  }());
  std::uint64_t frame_ = 0;

  Descriptor estimate_scene(Estimator& estimator, const RadianceOf& scene) {
    const std::vector<RadianceOf> scenes(exposures_.size(), scene);
    const Bracket b = bracket_of(rig_, table_, kFormat, scenes, exposures_, frame_++);
    Descriptor d;
    const Status s = estimator.estimate(b.frames, d);
    EXPECT_TRUE(s.ok()) << s.message();
    return d;
  }
  Descriptor estimate_scene(const RadianceOf& scene) { return estimate_scene(*estimator_, scene); }

  /// Irradiance at a normal, from the scene itself.
  Irradiance truth(const RadianceOf& scene, Vec3d n) const {
    Vec3d sum;
    for (const LensTable& lens : table_.lenses) {
      for (std::size_t i = 0; i < lens.direction.size(); ++i) {
        const Vec3d d = vec_cast<double>(lens.direction[i]);
        const double w = lens.solid_angle[i] * std::max(0.0, dot(d, n));
        if (!(w > 0)) continue;
        const Radiance l = scene(d);
        sum += Vec3d{l.r, l.g, l.b} * w;
      }
    }
    return {static_cast<float>(sum.x), static_cast<float>(sum.y), static_cast<float>(sum.z)};
  }
  double error(const Descriptor& d, const RadianceOf& scene) const {
    double squared = 0, total = 0;
    for (const reference::V3& n : reference::fibonacci_normals(128)) {
      const Irradiance t = truth(scene, {n.x, n.y, n.z}), e = irradiance_at(d, vec_cast<float>(Vec3d{n.x, n.y, n.z}));
      for (int k = 0; k < 3; ++k) {
        squared += (t[k] - e[k]) * (t[k] - e[k]);
        total += t[k] * t[k];
      }
    }
    return std::sqrt(squared / total);
  }
  RecoveryFault apply_reading(const Descriptor& d, const RadianceOf& scene, Vec3d normal, double reading_factor = 1) {
    Recovery r;
    const RecoveryFault fault = recover(
        d, estimator_->clipped_lights(),
        {vec_cast<float>(normalized(normal)), reading_factor * truth(scene, normalized(normal)).luminance()}, r);
    if (fault == RecoveryFault::none) estimator_->set_recovery(r);
    return fault;
  }
};

TEST_F(ClippedRecovery, AMeterReadingRecoversTheSun) {
  const RadianceOf scene = open_air(sun_at(0));
  const Descriptor before = estimate_scene(scene);
  EXPECT_TRUE(before.flags.has(Flag::clipped));
  EXPECT_FALSE(before.flags.has(Flag::recovered));
  EXPECT_TRUE(std::isinf(before.bound.total));
  EXPECT_GT(error(before, scene), 0.5) << "the sun must be clipped strongly for this test";
  ASSERT_EQ(estimator_->clipped_lights().size(), 1U);
  ASSERT_EQ(apply_reading(before, scene, {0, 1, 0}), RecoveryFault::none);

  const Descriptor after = estimate_scene(scene);
  EXPECT_TRUE(after.flags.has(Flag::clipped));
  EXPECT_TRUE(after.flags.has(Flag::recovered));
  EXPECT_LT(error(after, scene), 0.03);
  EXPECT_TRUE(std::isfinite(after.bound.total));
  EXPECT_LE(error(after, scene), after.bound.total);
}

TEST_F(ClippedRecovery, BoundIncludesTheErrorOfTheMeter) {
  const RadianceOf scene = open_air(sun_at(0));
  for (const double reading_factor : {0.95, 1.05}) {
    const Descriptor before = estimate_scene(scene);
    ASSERT_EQ(apply_reading(before, scene, {0, 1, 0}, reading_factor), RecoveryFault::none);
    const Descriptor after = estimate_scene(scene);
    EXPECT_GT(error(after, scene), 0.02);
    EXPECT_LE(error(after, scene), after.bound.total) << reading_factor;
  }
}

TEST_F(ClippedRecovery, WrongReadingsAreRefused) {
  const RadianceOf scene = open_air(sun_at(0));
  const Descriptor d = estimate_scene(scene);
  EXPECT_EQ(apply_reading(d, scene, {0, -1, 0}), RecoveryFault::faces_away);
  EXPECT_EQ(apply_reading(d, scene, {-0.9, -0.3, 0}), RecoveryFault::faces_away);
  EXPECT_EQ(apply_reading(d, scene, {0, 1, 0}, 1e-3), RecoveryFault::below_observed);
  EXPECT_EQ(apply_reading(d, scene, {0, 1, 0}, 0), RecoveryFault::no_reading);
  const Descriptor after = estimate_scene(scene);
  EXPECT_FALSE(after.flags.has(Flag::recovered));
  EXPECT_TRUE(std::isinf(after.bound.total));
}

TEST_F(ClippedRecovery, FollowsAMovingSun) {
  ASSERT_EQ(apply_reading(estimate_scene(open_air(sun_at(0))), open_air(sun_at(0)), {0, 1, 0}), RecoveryFault::none);
  for (int k = 0; k <= 12; ++k) {
    const RadianceOf scene = open_air(sun_at(2.0 * k));
    const Descriptor d = estimate_scene(scene);
    EXPECT_TRUE(d.flags.has(Flag::recovered)) << k;
    EXPECT_LT(error(d, scene), 0.04) << k;
  }
}

TEST_F(ClippedRecovery, EndsWhenTheSunIsNoLongerClipped) {
  const RadianceOf bright = open_air(sun_at(0)), dim = open_air(sun_at(0), 300);
  ASSERT_EQ(apply_reading(estimate_scene(bright), bright, {0, 1, 0}), RecoveryFault::none);
  EXPECT_TRUE(estimate_scene(bright).flags.has(Flag::recovered));
  const Descriptor behind_a_cloud = estimate_scene(dim);
  EXPECT_FALSE(behind_a_cloud.flags.has(Flag::clipped));
  EXPECT_FALSE(behind_a_cloud.flags.has(Flag::recovered));
  EXPECT_LT(error(behind_a_cloud, dim), 0.03);
  EXPECT_TRUE(estimator_->clipped_lights().empty());
  const Descriptor again = estimate_scene(bright);
  EXPECT_TRUE(again.flags.has(Flag::clipped));
  EXPECT_FALSE(again.flags.has(Flag::recovered)) << "the recovery ended when the sun was not clipped";
}

TEST_F(ClippedRecovery, IsDiscardedWhenTheScaleChanges) {
  const RadianceOf scene = open_air(sun_at(0));
  ASSERT_EQ(apply_reading(estimate_scene(scene), scene, {0, 1, 0}), RecoveryFault::none);
  estimator_->set_scale({Units::absolute, 2});
  EXPECT_FALSE(estimate_scene(scene).flags.has(Flag::recovered));
}

TEST_F(ClippedRecovery, AClippedSkyIsNoLight) {
  const auto sky = [](Vec3d d) { return d.y > 0 ? Radiance{5000, 5000, 5000} : Radiance{2, 2, 2}; };
  const Descriptor d = estimate_scene(sky);
  EXPECT_TRUE(d.flags.has(Flag::clipped));
  EXPECT_TRUE(estimator_->clipped_lights().empty());
  EXPECT_EQ(apply_reading(d, sky, {0, 1, 0}), RecoveryFault::nothing_clipped);
}

TEST_F(ClippedRecovery, AGreyPatchRecoversTheSunInEveryFrame) {
  // The patch is horizontal, below the probe; lens 0 points along -Z and sees it in the lower part of its image.
  const double albedo = 0.18;
  GreyPatch patch;
  patch.albedo = albedo;
  const LensTable& lens = table_.lenses[0];
  const auto on_patch = [](Vec3d d) { return d.y < -0.75 && d.z < -0.1 && std::abs(d.x) < 0.3; };
  int left = lens.width, right = 0, top = lens.height, bottom = 0;
  for (int y = 0; y < lens.height; ++y) {
    for (int x = 0; x < lens.width; ++x) {
      const std::size_t i =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(lens.width) + static_cast<std::size_t>(x);
      const Vec3d d = vec_cast<double>(lens.direction[i]);
      if (!(lens.solid_angle[i] > 0) || !(d.y < -0.78 && d.y > -0.95 && d.z < -0.12 && std::abs(d.x) < 0.1)) continue;
      left = std::min(left, x), right = std::max(right, x), top = std::min(top, y), bottom = std::max(bottom, y);
    }
  }
  ASSERT_GT(right, left + 3);
  ASSERT_GT(bottom, top + 3);
  patch.x = left + 1, patch.y = top + 1, patch.width = right - left - 1, patch.height = bottom - top - 1;
  PanoramaOptions options;
  options.grey_patch = patch;
  auto made = make_panorama_estimator(rig_, options);
  ASSERT_TRUE(made.ok()) << made.status().message();
  for (const double degrees : {0.0, 40.0, 80.0}) {
    const RadianceOf bare = open_air(sun_at(degrees), degrees == 40.0 ? 2 * kSun : kSun);
    const double e = truth(bare, {0, 1, 0}).luminance();
    const auto grey = static_cast<float>(e * albedo / std::numbers::pi);
    const RadianceOf scene = [=](Vec3d d) { return on_patch(d) ? Radiance{grey, grey, grey} : bare(d); };
    const Descriptor d = estimate_scene(**made, scene);
    EXPECT_TRUE(d.flags.has(Flag::recovered)) << degrees;
    EXPECT_LT(error(d, scene), 0.04) << degrees;
    EXPECT_LE(error(d, scene), d.bound.total) << degrees;
  }
}

TEST_F(ClippedRecovery, AnInvalidGreyPatchIsRefused) {
  const auto refused = [&](auto&& change) {
    PanoramaOptions options;
    options.grey_patch = GreyPatch{0, 10, 10, 20, 20, {0, 1, 0}, 0.18};
    change(*options.grey_patch);
    return make_panorama_estimator(rig_, options).status();
  };
  EXPECT_TRUE(refused([](GreyPatch&) {}).ok());
  EXPECT_FALSE(refused([](GreyPatch& p) { p.lens = 2; }).ok());
  EXPECT_FALSE(refused([](GreyPatch& p) { p.width = 400; }).ok());
  EXPECT_FALSE(refused([](GreyPatch& p) { p.x = -1; }).ok());
  EXPECT_FALSE(refused([](GreyPatch& p) { p.normal = {0, 0, 0}; }).ok());
  EXPECT_FALSE(refused([](GreyPatch& p) { p.albedo = 0; }).ok());
  EXPECT_FALSE(refused([](GreyPatch& p) { p.albedo = std::nan(""); }).ok());
}

}  // namespace
}  // namespace lightwell
