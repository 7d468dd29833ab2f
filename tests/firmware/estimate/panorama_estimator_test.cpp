#include <cmath>
#include <limits>
#include <numbers>

#include "reference/harmonics.hpp"
#include "scenes.hpp"

namespace lightwell {
namespace {

using namespace testing_scenes;

const char* const kKinds[] = {"pair", "double_sphere", "equirect"};

RigParameters small_rig(const char* kind) {
  return std::string(kind) == "equirect" ? rig_of(kind, 256, 128) : rig_of(kind, 240, 180);
}

TEST(PanoramaEstimator, ConstantSphereIsBandZeroWithoutLights) {
  for (const char* kind : kKinds) {
    const Descriptor d = estimated(small_rig(kind), [](Vec3d) { return Radiance{3, 2, 1}; });
    EXPECT_TRUE(d.lights.empty()) << kind;
    EXPECT_NEAR(d.radiance.c[0].r, 3 * std::sqrt(4 * std::numbers::pi), 1e-5 * 3 * 3.545) << kind;
    for (std::size_t i = 1; i < 25; ++i) EXPECT_NEAR(d.radiance.c[i].r, 0, 1e-5 * 3 * 3.545) << kind << " " << i;
    EXPECT_FALSE(d.flags.any()) << kind;
    EXPECT_NEAR(d.coverage, 1, 1e-3) << kind;
    EXPECT_LT(d.bound.truncation, 1e-5) << kind;
  }
}

TEST(PanoramaEstimator, ReproducesEveryHarmonicUpToItsBand) {
  const RigParameters rig = small_rig("pair");
  const auto estimator = estimator_of(rig, everything(6, 0));
  for (int i = 0; i < sh_count(6); ++i) {
    // A constant keeps radiance positive: |Y| is below 2 up to band 6.
    const Descriptor d = estimated(*estimator, picture_of(rig, [i](Vec3d p) {
      const auto y = static_cast<float>(reference::harmonics({p.x, p.y, p.z}, 6)[static_cast<std::size_t>(i)]);
      return Radiance{2 + y, 2, 2 - y};
    }));
    const double pedestal = 2 * std::sqrt(4 * std::numbers::pi);
    for (int j = 0; j < sh_count(6); ++j) {
      const double base = j == 0 ? pedestal : 0, own = i == j ? 1 : 0;
      // 1e-5 of the largest coefficient, before the wire (proto/README.md).
      EXPECT_NEAR(d.radiance.c[static_cast<std::size_t>(j)].r, base + own, 1e-5 * pedestal) << i << " " << j;
      EXPECT_NEAR(d.radiance.c[static_cast<std::size_t>(j)].b, base - own, 1e-5 * pedestal) << i << " " << j;
    }
  }
}

TEST(PanoramaEstimator, ReproducesTheIrradianceOfACosineLobe) {
  const Vec3d axis = normalized(Vec3d{0.3, 0.8, -0.5});
  const Descriptor d = estimated(small_rig("pair"), [&](Vec3d p) {
    const auto c = static_cast<float>(std::max(0.0, dot(p, axis)));
    return Radiance{c, c, c};
  });
  // Irradiance of a clipped cosine at the angle a: (2/3) (sin a + (pi - a) cos a).
  const double error = error_of(d, [&](Vec3d n) {
    const double a = angle_between(n, axis);
    const auto e = static_cast<float>(2.0 / 3 * (std::sin(a) + (std::numbers::pi - a) * std::cos(a)));
    return Irradiance{e, e, e};
  });
  // Truncation above band 4: A_6² sqrt(13) / sqrt(sum A_l⁴ (2l+1)) = 7e-4.
  EXPECT_LT(error, 8e-4);
}

TEST(PanoramaEstimator, DetectsALampInEveryDirection) {
  const RigParameters rig = small_rig("pair");
  const auto estimator = estimator_of(rig);
  // Poles, axes, the overlap of both lenses, and between.
  const Vec3d places[] = {{0, 1, 0}, {0, -1, 0},    {1, 0, 0},    {-1, 0, 0},       {0, 0, -1},
                          {0, 0, 1}, {1, 0, -0.04}, {1, 1, 0.03}, {-0.5, 0.2, 0.7}, {0.3, -0.6, -0.9}};
  const double rho = 0.05;
  for (const Vec3d& place : places) {
    const Vec3d axis = normalized(place);
    // Pixels of 0.8 degrees are coarse for a disc of 2.9 degrees: its edge is antialiased, as by a sensor.
    const Picture picture = picture_of(rig, [&](Vec3d p) {
      const double a = angle_between(p, axis), soft = std::clamp((rho - a) / 0.014 + 0.5, 0.0, 1.0);
      const auto l = static_cast<float>(1000 * soft);
      return Radiance{1 + l, 1 + l, 1 + 0.5F * l};
    });
    const Descriptor d = estimated(*estimator, picture);
    ASSERT_EQ(d.lights.size(), 1U) << place.x << " " << place.y << " " << place.z;
    const Light& light = d.lights[0];
    // A tenth of a pixel.
    EXPECT_LT(degrees_between(light.direction, axis), 0.1) << place.x << " " << place.y << " " << place.z;
    const double truth = 1000 * std::numbers::pi * std::sin(rho) * std::sin(rho);
    // Tolerance: a disc with a radius of 3.6 pixels, sampled at the middles of pixels.
    EXPECT_NEAR(light.irradiance.r / truth, 1, 0.05);
    EXPECT_NEAR(light.irradiance.b / light.irradiance.r, 0.5, 0.005);
    EXPECT_NEAR(light.angular_radius_rad, rho, 0.1 * rho);
    const double error = error_of(d, [&](Vec3d n) {
      const auto e = static_cast<float>(light.irradiance.r * cap_irradiance(dot(n, axis), rho));
      const auto pi = std::numbers::pi_v<float>;
      return Irradiance{pi + e, pi + e, pi + 0.5F * e};
    });
    EXPECT_LT(error, 0.01);
    EXPECT_LT(error, d.bound.total + 0.01) << "the truth neglects the soft edge";
  }
}

TEST(PanoramaEstimator, IsRotationInvariant) {
  const auto scene = [](Vec3d d) {
    // Soft edges: the sampled energy of a hard one would depend on the rotation.
    const float sky = 1.2F + 0.8F * static_cast<float>(std::tanh(8 * d.y)), wall = d.x < -0.7 ? 3.0F : 0.0F;
    const double a = angle_between(d, normalized(Vec3d{0.5, 0.7, -0.5}));
    const auto sun = static_cast<float>(800 * std::exp(-a * a / (2 * 0.04 * 0.04)));
    return Radiance{sky + wall + sun, sky + sun, 1.5F * sky + 0.7F * sun};
  };
  const RigParameters rig = small_rig("pair");
  const auto estimator = estimator_of(rig);
  const Descriptor still = estimated(*estimator, picture_of(rig, scene));
  for (const Quat& q :
       {Quat::about({0, 1, 0}, 1.1), Quat::about({1, 0, 0}, -0.6), Quat::about(normalized(Vec3d{1, 1, -2}), 2.2)}) {
    // q rotates world to probe: the probe observes in direction d the world's direction q^-1 d.
    const Descriptor turned =
        estimated(*estimator, picture_of(rig, [&](Vec3d d) { return scene(rotate(q.inverse(), d)); }));
    ASSERT_FALSE(turned.lights.empty());
    // 0.3 pixels of this rig: whether pixels at half the peak belong to the core depends on the grid.
    EXPECT_LT(degrees_between(turned.lights[0].direction, rotate(q, vec_cast<double>(still.lights[0].direction))), 0.3);
    const double error =
        error_of(turned, [&](Vec3d n) { return irradiance_at(still, vec_cast<float>(rotate(q.inverse(), n))); });
    // Both results are within their bounds of the same truth.
    EXPECT_LT(error, still.bound.total + turned.bound.total);
  }
}

TEST(PanoramaEstimator, ReportsTheCoverageOfOneLens) {
  const Descriptor d = estimated(rig_of("single", 240, 180), [](Vec3d) { return Radiance{1, 1, 1}; });
  // A cap of 95 degrees: (1 - cos 95) / 2.
  EXPECT_NEAR(d.coverage, (1 - std::cos(95 * std::numbers::pi / 180)) / 2, 0.005);
  EXPECT_TRUE(d.flags.has(Flag::unseen));
  EXPECT_TRUE(std::isinf(d.bound.total));
}

TEST(PanoramaEstimator, RefusesFramesThatDoNotMatchTheRigWithAReason) {
  const RigParameters rig = small_rig("pair");
  const auto estimator = estimator_of(rig);
  Descriptor d;
  const auto refusal = [&](auto&& spoil) {
    Picture p = picture_of(rig, [](Vec3d) { return Radiance{1, 1, 1}; });
    Frame bad;
    bad.info = p.frame.info;
    for (View v : p.frame.views()) {
      spoil(v, bad.info);
      bad.add_view(v);
    }
    const Status s = estimator->estimate(std::span(&bad, 1), d);
    EXPECT_EQ(s.code(), StatusCode::invalid_argument);
    return s.message();
  };
  EXPECT_NE(refusal([](View& v, FrameInfo&) { v.width = 120; }).find("120x180"), std::string::npos);
  EXPECT_NE(refusal([](View& v, FrameInfo&) { v.lens = 0; }).find("twice"), std::string::npos);
  EXPECT_NE(refusal([](View& v, FrameInfo&) { v.lens += 1; }).find("lens 2"), std::string::npos);
  EXPECT_NE(refusal([](View& v, FrameInfo&) { v.data = v.data.first(100); }).find("too few"), std::string::npos);
  for (const double exposure :
       {0.0, -1.0, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()})
    EXPECT_NE(refusal([&](View&, FrameInfo& i) { i.exposure_s = exposure; }).find("exposure_s"), std::string::npos);
  EXPECT_FALSE(estimator->estimate({}, d).ok());
  const Picture good = picture_of(rig, [](Vec3d) { return Radiance{1, 1, 1}; });
  EXPECT_TRUE(estimator->estimate(std::span(&good.frame, 1), d).ok()) << "a valid frame after refused ones";
}

TEST(PanoramaEstimator, AppliesANewConfigurationFromTheNextFrame) {
  const RigParameters rig = small_rig("pair");
  const auto estimator = estimator_of(rig);
  const Picture p = picture_of(rig, lamp({0.3, 0.5, -1}, 0.06, 500));
  EXPECT_EQ(estimated(*estimator, p).lights.size(), 1U);
  ASSERT_TRUE(estimator->configure(everything(2, 0)).ok());
  const Descriptor d = estimated(*estimator, p);
  EXPECT_TRUE(d.lights.empty());
  EXPECT_EQ(d.radiance.band, 2);
  EXPECT_FALSE(estimator->configure(everything(7, 0)).ok());
  EXPECT_EQ(estimated(*estimator, p).radiance.band, 2);
}

TEST(PanoramaEstimator, SettingScalesTheErrorLimits) {
  const RigParameters rig = small_rig("pair");
  const Picture p = picture_of(rig, lamp({0.3, 0.5, -1}, 0.06, 500));
  const auto answer = [&](Setting setting, double epsilon) {
    EstimatorConfig config;
    config.setting = setting;
    config.panorama.epsilon = epsilon;
    return estimated(*estimator_of(rig, config), p);
  };
  const Descriptor fast = answer(Setting::fast, 0.01), twice = answer(Setting::balanced, 0.02);
  EXPECT_EQ(fast.radiance, twice.radiance);
  EXPECT_EQ(fast.lights, twice.lights);
  const Descriptor exact = answer(Setting::exact, 0.01), all = answer(Setting::balanced, 0);
  EXPECT_EQ(exact.radiance, all.radiance);
  EXPECT_EQ(exact.lights, all.lights);
  EXPECT_EQ(exact.radiance.band, 6);
  EXPECT_EQ(fast.setting, Setting::fast);
}

TEST(PanoramaEstimator, ScalesAllQuantitiesAndSetsTheUnits) {
  const RigParameters rig = small_rig("pair");
  const auto estimator = estimator_of(rig);
  const Picture p = picture_of(rig, lamp({0.3, 0.5, -1}, 0.06, 500));
  const Descriptor relative = estimated(*estimator, p);
  EXPECT_EQ(relative.units, Units::relative);
  estimator->set_scale({Units::absolute, 50});
  const Descriptor absolute = estimated(*estimator, p);
  EXPECT_EQ(absolute.units, Units::absolute);
  EXPECT_NEAR(absolute.radiance.c[0].r, 50 * relative.radiance.c[0].r, 1e-4 * absolute.radiance.c[0].r);
  EXPECT_NEAR(absolute.lights[0].irradiance.g, 50 * relative.lights[0].irradiance.g,
              1e-4 * absolute.lights[0].irradiance.g);
  EXPECT_NEAR(absolute.bound.total, relative.bound.total, 1e-4);
}

TEST(PanoramaEstimator, RefusesInvalidOptions) {
  PanoramaOptions options;
  options.block_edge = 12;
  EXPECT_FALSE(make_panorama_estimator(small_rig("pair"), options).ok());
  options.block_edge = 0;
  options.config.band = -1;
  EXPECT_FALSE(make_panorama_estimator(small_rig("pair"), options).ok());
  EXPECT_FALSE(make_panorama_estimator({}, {}).ok());
}

}  // namespace
}  // namespace lightwell
