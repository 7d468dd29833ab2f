// Tests of LensRays and of the predefined rigs.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <lightwell/equirect.hpp>

#include "calibration/model/camera_model.hpp"
#include "calibration/model/lens_table.hpp"
#include "sim/scene.hpp"
#include "sim/sensor.hpp"

namespace lightwell::sim {
namespace {

constexpr double kPi = std::numbers::pi;

RigParameters rig(std::string_view kind, int width, int height) {
  Result<RigParameters> made = make_rig(kind, width, height, PixelFormat::rgb_f32);
  EXPECT_TRUE(made.ok()) << made.status().message();
  EXPECT_TRUE(made->validate().ok()) << made->validate().message();
  return std::move(*made);
}

Panorama soft_lamp(Vec3d towards) {
  return from_function(512, [towards](Vec3d d) {
    const auto l = static_cast<float>(std::exp(30 * (dot(d, towards) - 1)));
    return Radiance{l, l, l};
  });
}

struct Brightest {
  int x = 0, y = 0;
  float value = 0;
};

Brightest brightest(const std::vector<float>& picture, int width) {
  Brightest best;
  for (std::size_t k = 0; k < picture.size() / 3; ++k) {
    if (picture[3 * k] <= best.value) continue;
    best = {static_cast<int>(k) % width, static_cast<int>(k) / width, picture[3 * k]};
  }
  return best;
}

TEST(Rigs, TheImageCircleIsInsideThePictureWithAMarginOfOnePercent) {
  for (const char* kind : {"pair", "single", "double_sphere"}) {
    for (const LensParameters& lens : rig(kind, 640, 480).lenses) {
      const CameraModel model(lens);
      EXPECT_NEAR(model.max_angle_rad(), 95 * kPi / 180, 1e-12) << kind;
      const auto top = model.project({0, -std::sin(95 * kPi / 180), std::cos(95 * kPi / 180)});
      ASSERT_TRUE(top);
      EXPECT_NEAR(top->y + 0.5, 0.005 * 480, 1e-9) << "half of the margin must be above, half below";
    }
  }
}

TEST(Rigs, APairSeesTheWholeSphereOneLensItsCap) {
  const auto covered = [](const char* kind, int width, int height) {
    return make_rig_table(rig(kind, width, height))->covered_sr;
  };
  // Tolerances: lens_table_test.cpp.
  EXPECT_NEAR(covered("pair", 320, 240), 4 * kPi, 1.5e-4 * 4 * kPi);
  EXPECT_NEAR(covered("double_sphere", 320, 240), 4 * kPi, 1.5e-4 * 4 * kPi);
  EXPECT_NEAR(covered("equirect", 320, 160), 4 * kPi, 1e-9);
  EXPECT_NEAR(covered("single", 320, 240), 2 * kPi * (1 - std::cos(95 * kPi / 180)), 1e-4);
}

TEST(Rigs, RefuseInvalidKindsAndSizes) {
  const auto problem = [](const char* kind, int width, int height, PixelFormat format) {
    return make_rig(kind, width, height, format).status();
  };
  EXPECT_EQ(problem("pear", 640, 480, PixelFormat::rgb8).code(), StatusCode::invalid_argument);
  EXPECT_NE(problem("pear", 640, 480, PixelFormat::rgb8).message().find("'pair'"), std::string::npos);
  EXPECT_FALSE(problem("pair", 641, 480, PixelFormat::nv12).ok());
  EXPECT_FALSE(problem("pair", 640, 481, PixelFormat::nv12).ok());
  EXPECT_TRUE(problem("pair", 640, 481, PixelFormat::yuyv).ok());
  EXPECT_FALSE(problem("equirect", 640, 480, PixelFormat::rgb8).ok());
}

TEST(Render, ALampAtPlusXIsRightInLensZeroAndLeftInLensOne) {
  const RigParameters pair = rig("pair", 320, 240);
  // 80 degrees from both axes: inside both lenses, near the middle row.
  const Scene front(soft_lamp(normalized(Vec3d{1, 0, -0.2})));
  const Brightest zero = brightest(render_radiance(front, {}, pair.lenses[0]), 320);
  EXPECT_GT(zero.x, 250);
  EXPECT_NEAR(zero.y, 119.5, 1);
  const Scene back(soft_lamp(normalized(Vec3d{1, 0, 0.2})));
  const Brightest one = brightest(render_radiance(back, {}, pair.lenses[1]), 320);
  EXPECT_LT(one.x, 70);
  EXPECT_NEAR(one.y, 119.5, 1);
}

TEST(Render, UpIsUpInBothLenses) {
  const RigParameters pair = rig("double_sphere", 320, 240);
  const Scene scene(soft_lamp({0, 1, 0}));
  for (const LensParameters& lens : pair.lenses) {
    const Brightest top = brightest(render_radiance(scene, {}, lens), 320);
    EXPECT_NEAR(top.x, 159.5, 2);
    EXPECT_LT(top.y, 20);
  }
}

TEST(Render, EveryPixelShowsTheDirectionThatTheCalibrationGivesIt) {
  // A slowly varying scene: a pixel's mean differs from its centre value by 1/8 (1/70 rad)² times a second derivative
  // of 4.
  const Scene scene(from_function(1024, [](Vec3d d) {
    return Radiance{static_cast<float>(2 + d.x * d.y), static_cast<float>(2 + d.z), static_cast<float>(2 + d.y)};
  }));
  for (const char* kind : {"pair", "double_sphere", "equirect"}) {
    const RigParameters r = rig(kind, 320, kind == std::string_view("equirect") ? 160 : 240);
    const Result<RigTable> table = make_rig_table(r);
    ASSERT_TRUE(table.ok());
    for (std::size_t l = 0; l < r.lenses.size(); ++l) {
      const std::vector<float> picture = render_radiance(scene, {}, r.lenses[l], 3);
      const LensTable& t = table->lenses[l];
      for (std::size_t k = 0; k < t.direction.size(); ++k) {
        if (t.direction[k] == Vec3f{}) {
          // A pixel without a visible corner may still contain a visible sample.
          continue;
        }
        const Vec3d d = vec_cast<double>(t.direction[k]);
        // At the rim the mean of the samples differs slightly from the centre of the visible part.
        const double angle = angle_between(d, rotate(r.lenses[l].pose_cv.rotation, Vec3d{0, 0, 1}));
        const double tolerance = angle > 1.63 && kind != std::string_view("equirect") ? 1e-2 : 1e-3;
        ASSERT_NEAR(static_cast<double>(picture[3 * k]), 2 + d.x * d.y, tolerance) << kind << k;
        ASSERT_NEAR(static_cast<double>(picture[3 * k + 1]), 2 + d.z, tolerance) << kind << k;
        ASSERT_NEAR(static_cast<double>(picture[3 * k + 2]), 2 + d.y, tolerance) << kind << k;
      }
    }
  }
}

TEST(Render, OutsideTheCircleIsDark) {
  const RigParameters pair = rig("pair", 320, 240);
  const Scene scene(from_function(64, [](Vec3d) { return Radiance{1, 1, 1}; }));
  const std::vector<float> picture = render_radiance(scene, {}, pair.lenses[0]);
  EXPECT_EQ(picture[0], 0);
  EXPECT_EQ(picture[3 * (120 * 320 + 10)], 0);
  EXPECT_NEAR(picture[3 * (120 * 320 + 160)], 1, 1e-6);
  for (std::size_t k = 0; k < picture.size(); ++k)
    ASSERT_TRUE(picture[k] == 0 || std::abs(picture[k] - 1) < 1e-6F) << "rim pixels must average visible samples only";
}

TEST(Render, SupersamplingPreservesTheEnergyOfASunAtAnyPosition) {
  // One bright pixel of a panorama of width 1024, 0.35 degrees; the lens's pixels are three times as large.
  const LensParameters lens = rig("single", 160, 120).lenses[0];
  const RigTable table = *make_rig_table({{lens}, 0});
  Panorama world = from_function(1024, [](Vec3d) { return Radiance{}; });
  const int samples = samples_for(lens, world);
  EXPECT_GE(samples, 8);
  const LensRays rays(lens, samples);
  std::vector<float> picture(3 * 160 * 120);
  double least = 1e9, most = 0;
  for (int i = 500; i < 524; ++i) {
    Panorama sun = world;
    sun.rgb[3 * (256 * 1024 + static_cast<std::size_t>(i)) + 1] = 1000;
    rays.render(Scene(sun), {}, {0, 120}, picture);
    double energy = 0;
    for (std::size_t k = 0; k < table.lenses[0].solid_angle.size(); ++k)
      energy += static_cast<double>(picture[3 * k + 1] * table.lenses[0].solid_angle[k]);
    least = std::min(least, energy);
    most = std::max(most, energy);
  }
  const double true_energy = 1000 * equirect_solid_angle(256, 1024, 512);
  // The samples are a seventh of the panorama's pixel apart: error at most (1 / 7 pi)² on each axis.
  EXPECT_NEAR(least / true_energy, 1, 0.005);
  EXPECT_NEAR(most / true_energy, 1, 0.005);
}

TEST(Render, ARotatedProbeSeesTheRotatedPanorama) {
  const LensParameters lens = rig("equirect", 128, 64).lenses[0];
  const Panorama world = soft_lamp(normalized(Vec3d{1, 0.3, -1}));
  Motion motion;
  motion.turn_rad_per_s = 0.7 * 30;
  motion.cycle_frames = 10;
  const Scene scene(world, motion);
  const SceneState state = scene.state_at(3);
  const std::vector<float> picture = render_radiance(scene, state, lens, 1);
  for (int j = 0; j < 64; j += 5) {
    for (int i = 0; i < 128; i += 5) {
      const Vec3d d = equirect_direction((i + 0.5) / 128, (j + 0.5) / 64);
      EXPECT_NEAR(picture[3 * static_cast<std::size_t>(j * 128 + i)], scene.radiance(d, state).r, 1e-6);
    }
  }
}

}  // namespace
}  // namespace lightwell::sim
