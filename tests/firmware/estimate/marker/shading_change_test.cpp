// Changes of the light between frames, on samples from closed forms.
#include "estimate/marker/shading_change.hpp"

#include <gtest/gtest.h>

#include "firmware/estimate/marker/lit_body.hpp"

namespace lightwell::marker {
namespace {

using test::kDegree;
using test::LitBody;
using test::towards;

/// A camera at azimuth 0; the body is turned by `turn_deg` in front of it, and lamps turn with it.
struct Frames {
  double azimuth_deg = 40, irradiance = 1;
  double turn_deg = 0;
  bool table = true;
  unsigned seed = 1;

  [[nodiscard]] Shading shading() const {
    return LitBody{.lamps = {{towards(azimuth_deg + turn_deg, 40), 0, {irradiance, irradiance, irradiance}}},
                   .ambient = 0.3,
                   .turn_deg = turn_deg,
                   .table = table,
                   .sample_noise = 0.003,
                   .seed = seed}
        .shading();
  }
  [[nodiscard]] bool update(ShadingChange& change) const {
    const Quat body = Quat::about({0, 1, 0}, turn_deg * kDegree);
    return change.update(shading(), body, rotate(body.inverse(), towards(0, 26.565)));
  }
};

TEST(ShadingChange, NoiseAndTheCamerasMotionAreNoChange) {
  ShadingChange still, moving;
  for (unsigned seed = 1; seed <= 30; ++seed) {
    EXPECT_FALSE(Frames{.seed = seed}.update(still)) << seed;
    EXPECT_FALSE((Frames{.turn_deg = 2.0 * seed, .seed = seed}).update(moving)) << seed;
  }
}

TEST(ShadingChange, AnotherBrightnessOrDirectionIsAChangeAtOnce) {
  for (const Frames& other : {Frames{.irradiance = 1.2}, Frames{.irradiance = 0}, Frames{.azimuth_deg = 50},
                              Frames{.azimuth_deg = 40 + 180}}) {
    ShadingChange change;
    EXPECT_FALSE(Frames{}.update(change));
    EXPECT_TRUE(other.update(change)) << other.azimuth_deg << " " << other.irradiance;
    EXPECT_FALSE(other.update(change)) << "the first frame of the new light";
  }
}

TEST(ShadingChange, AnAttitudeOfTheBodyInLightThatStaysIsAChange) {
  ShadingChange change;
  EXPECT_FALSE(Frames{}.update(change));
  EXPECT_TRUE((Frames{.azimuth_deg = 40 - 15, .turn_deg = 15}).update(change));
}

TEST(ShadingChange, SlowDriftIsAChangeBeforeItIsLarge) {
  ShadingChange change;
  double azimuth = 40;
  // Half a degree a frame, which is less than the errors of two frames.
  while (azimuth < 60 && !Frames{.azimuth_deg = azimuth}.update(change)) azimuth += 0.5;
  EXPECT_GT(azimuth, 41);
  EXPECT_LT(azimuth, 46);
}

TEST(ShadingChange, AShadowThatNoFaceTellsIsAChangeWhileTheCameraRests) {
  // A low lamp behind the body lights no face that is seen.
  const auto behind = [](double azimuth_deg, double turn_deg) {
    return LitBody{.lamps = {{towards(azimuth_deg + turn_deg, 15), 0, {1, 1, 1}}},
                   .ambient = 0.5,
                   .turn_deg = turn_deg,
                   .camera_elevation_deg = 10,
                   .table = true};
  };
  ShadingChange change;
  const Vec3d view = towards(0, 10);
  EXPECT_FALSE(change.update(behind(180, 36).shading(), Quat{}, view));
  Shading moved = behind(165, 36).shading();
  moved.samples = behind(180, 36).shading().samples;
  EXPECT_TRUE(change.update(moved, Quat{}, view));
}

TEST(ShadingChange, NothingInCommonIsNoChange) {
  ShadingChange change;
  EXPECT_FALSE(change.update(Shading{}, Quat{}, {0, 0, 1}));
  EXPECT_FALSE(Frames{}.update(change));
  EXPECT_FALSE(change.update(Shading{}, Quat{}, {0, 0, 1}));
  change.clear();
  EXPECT_FALSE(Frames{.irradiance = 3}.update(change)) << "the first frame after clear()";
}

TEST(ShadingChange, PatchesOfABallDoNotTurnWithIt) {
  // The patch of a number has another normal of the body where the ball is turned.
  const auto ball = [](Vec3d normal, double irradiance) {
    SurfaceSample sample{};
    sample.normal = normal;
    sample.irradiance.fill(irradiance);
    sample.patch = 7;
    Shading out;
    out.samples.push_back(sample);
    return out;
  };
  ShadingChange change;
  const Vec3d ahead{0, 0, 1};
  EXPECT_FALSE(change.update(ball(ahead, 1), Quat{}, ahead));
  EXPECT_FALSE(change.update(ball(ahead, 2), Quat::about({0, 1, 0}, 0.2), ahead));
  EXPECT_TRUE(change.update(ball(ahead, 1), Quat::about({0, 1, 0}, 0.2), ahead));
}

}  // namespace
}  // namespace lightwell::marker
