// Lights followed over frames, on samples from closed forms: accuracy of means, and no lag where the light changes.
#include "estimate/marker/light_follower.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/quantile.hpp>

#include "firmware/estimate/marker/lit_body.hpp"

namespace lightwell::marker {
namespace {

using test::kDegree;
using test::LitBody;
using test::towards;

constexpr Rgb kWhite = {1, 1, 1};
constexpr double kElevation_deg = 26.565;

ProbeTime at_s(double s) { return ProbeTime{static_cast<std::int64_t>(1e9 * s)}; }

/// A frame of a camera at azimuth 0. Lamps are given in the body's axes: they turn with it, as the camera sees it.
struct Seen {
  std::vector<PointLight> lamps;
  double turn_deg = 0;
  double noise = 0;  ///< Of each face, relative, another one in each frame.
  unsigned seed = 1;
  bool ambiguous = false;

  [[nodiscard]] Quat body() const { return Quat::about({0, 1, 0}, turn_deg * kDegree); }
  [[nodiscard]] Shading shading() const {
    LitBody of{.lamps = lamps, .turn_deg = turn_deg, .surface_noise = noise, .seed = seed};
    for (PointLight& lamp : of.lamps) lamp.direction = rotate(body(), lamp.direction);
    return of.shading();
  }
  [[nodiscard]] LightingEstimate estimate(LightFollower& follower, double time_s) const {
    return follower.estimate({at_s(time_s), body(), towards(0, kElevation_deg) * 0.45, ambiguous}, shading(),
                             kMaxPointLights);
  }
  /// Of the light `which` of an estimate from a lamp, degrees.
  [[nodiscard]] double error_deg(const LightingEstimate& light, std::size_t lamp = 0, std::size_t which = 0) const {
    if (light.lights.size() <= which) return 180;
    return angle_between(light.lights[which].light.direction, rotate(body(), lamps[lamp].direction)) / kDegree;
  }
};

/// Median error of the tenth of ten frames, single and followed, over 40 lamps.
struct Errors {
  double single = 0, followed = 0;
};
Errors errors_of_ten_frames(double turn_per_frame_deg) {
  std::vector<double> single, followed;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  for (unsigned lamp = 0; lamp < 40; ++lamp) {
    const Vec3d direction = towards(100 * unit(random) - 50, 20 + 40 * unit(random));
    LightFollower follower;
    for (unsigned k = 0; k < 10; ++k) {
      const Seen frame{
          .lamps = {{direction, 0, kWhite}}, .turn_deg = turn_per_frame_deg * k, .noise = 0.01, .seed = 100 * lamp + k};
      const LightingEstimate light = frame.estimate(follower, 0.1 * k);
      if (k < 9) continue;
      followed.push_back(frame.error_deg(light));
      LightFollower none;
      single.push_back(frame.error_deg(frame.estimate(none, 0)));
    }
  }
  return {median(single), median(followed)};
}

TEST(LightFollower, MeanOverFramesIsMoreAccurateThanASingleOne) {
  // Errors of the faces are independent between the frames: a third of a single frame's is left.
  for (const double turn_per_frame_deg : {0.0, 2.0}) {
    const Errors errors = errors_of_ten_frames(turn_per_frame_deg);
    EXPECT_GT(errors.single, 0.3) << turn_per_frame_deg;
    EXPECT_LT(errors.followed, 0.5 * errors.single) << turn_per_frame_deg << " deg, " << errors.single;
  }
}

TEST(LightFollower, LampThatIsSwitchedIsFollowedAtOnce) {
  const PointLight left{towards(-45, 35), 0, {1, 0.7, 0.4}}, right{towards(45, 30), 0, {0.4, 0.6, 0.8}};
  LightFollower follower;
  double time = 0;
  for (int k = 0; k < 10; ++k) (void)Seen{.lamps = {left}}.estimate(follower, time += 0.1);
  for (int k = 0; k < 3; ++k) {
    const Seen both{.lamps = {left, right}};
    const LightingEstimate on = both.estimate(follower, time += 0.1);
    ASSERT_EQ(on.lights.size(), 2U) << k;
    EXPECT_LT(both.error_deg(on, 0, 0), 2) << k;
    EXPECT_LT(both.error_deg(on, 1, 1), 2) << k;
  }
  for (int k = 0; k < 3; ++k) {
    const Seen other{.lamps = {right}};
    const LightingEstimate off = other.estimate(follower, time += 0.1);
    ASSERT_EQ(off.lights.size(), 1U) << k;
    EXPECT_LT(other.error_deg(off), 0.5) << k;
  }
}

TEST(LightFollower, LampThatMovesIsFollowedWithoutLag) {
  for (const double jump_deg : {3.0, 10.0, 60.0}) {
    LightFollower follower;
    double time = 0;
    for (int k = 0; k < 15; ++k) (void)Seen{.lamps = {{towards(-30, 40), 0, kWhite}}}.estimate(follower, time += 0.1);
    const Seen moved{.lamps = {{towards(-30 + jump_deg, 40), 0, kWhite}}};
    EXPECT_LT(moved.error_deg(moved.estimate(follower, time += 0.1)), 0.5) << jump_deg;
  }
  // Six degrees a second: the change of the faces is noticed before the means lag by more than two degrees.
  LightFollower follower;
  for (int k = 0; k < 60; ++k) {
    const Seen frame{.lamps = {{towards(-30 + 0.2 * k, 40), 0, kWhite}}, .noise = 0.002, .seed = 1U + k};
    EXPECT_LT(frame.error_deg(frame.estimate(follower, k / 30.0)), 2.5) << k;
  }
}

TEST(LightFollower, BodyThatIsMovedIsFollowedWithoutLag) {
  LightFollower follower;
  for (int k = 0; k < 10; ++k) (void)Seen{.lamps = {{towards(20, 40), 0, kWhite}}}.estimate(follower, 0.1 * k);
  // The body is turned by 50 degrees; the lamp stays where it is in front of the camera.
  const Seen turned{.lamps = {{towards(20 - 50, 40), 0, kWhite}}, .turn_deg = 50};
  EXPECT_LT(turned.error_deg(turned.estimate(follower, 1)), 0.5);
}

TEST(LightFollower, SearchesWhereTheViewIsAnotherOneAndSeldomAtRest) {
  const PointLight lamp{towards(20, 40), 0, kWhite};
  LightFollower follower;
  std::vector<double> searched;
  for (int k = 0; k <= 300; ++k)
    if (!Seen{.lamps = {lamp}}.estimate(follower, 0.02 * k).tracked) searched.push_back(0.02 * k);
  // At rest after 0.5, 1, 2, ... s, each from the last.
  const std::vector<double> expected = {0, 0.5, 1.5, 3.5};
  ASSERT_EQ(searched.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(searched[i], expected[i], 1e-9);
  EXPECT_FALSE((Seen{.lamps = {lamp}, .turn_deg = 6}).estimate(follower, 6.1).tracked);
  EXPECT_TRUE((Seen{.lamps = {lamp}, .turn_deg = 12}).estimate(follower, 6.2).tracked) << "too early for another";
  EXPECT_FALSE((Seen{.lamps = {lamp}, .turn_deg = 18}).estimate(follower, 6.4).tracked);
}

TEST(LightFollower, FirstFramesAreThoseOfASingleEstimate) {
  const Seen frame{.lamps = {{towards(20, 40), 0, kWhite}}, .noise = 0.01, .seed = 5};
  const LightingEstimate single = estimate_lighting(frame.shading());
  const auto expect_single = [&](LightFollower& follower, double time_s, const char* what) {
    const LightingEstimate light = frame.estimate(follower, time_s);
    EXPECT_FALSE(light.tracked) << what;
    ASSERT_EQ(light.lights.size(), single.lights.size()) << what;
    EXPECT_LT(angle_between(light.lights[0].light.direction, single.lights[0].light.direction), 1e-9) << what;
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_NEAR(light.lights[0].direction_covariance[i], single.lights[0].direction_covariance[i], 1e-9) << what;
  };
  LightFollower follower;
  expect_single(follower, 10, "one frame");
  for (unsigned k = 0; k < 5; ++k)
    (void)Seen{.lamps = frame.lamps, .noise = 0.01, .seed = k}.estimate(follower, 11 + 0.1 * k);
  expect_single(follower, 5, "time runs backwards");
  for (unsigned k = 0; k < 5; ++k)
    (void)Seen{.lamps = frame.lamps, .noise = 0.01, .seed = k}.estimate(follower, 6 + 0.1 * k);
  follower.reset();
  expect_single(follower, 7, "the body was lost and is found again");
}

TEST(LightFollower, AmbiguousAttitudesAreNoPartOfTheMean) {
  const PointLight lamp{towards(20, 40), 0, kWhite};
  LightFollower follower;
  for (int k = 0; k < 5; ++k) (void)Seen{.lamps = {lamp}}.estimate(follower, 0.1 * k);
  // The wrong one of two attitudes: as if the lamp had another direction in the body's axes.
  Seen wrong{.lamps = {{towards(16, 40), 0, kWhite}}, .ambiguous = true};
  EXPECT_LT(wrong.error_deg(wrong.estimate(follower, 0.5)), 0.5) << "the frame alone";
  const Seen right{.lamps = {lamp}};
  EXPECT_LT(right.error_deg(right.estimate(follower, 0.6)), 0.3);
}

TEST(LightFollower, CovarianceIsNotThatOfIndependentFrames) {
  // Errors of the model are the same in all frames.
  const Seen frame{.lamps = {{towards(20, 40), 0, kWhite}}};
  LightFollower follower;
  const LightingEstimate first = frame.estimate(follower, 0);
  LightingEstimate last;
  for (int k = 1; k < 12; ++k) last = frame.estimate(follower, 0.1 * k);
  const auto trace = [](const LightingEstimate& e) {
    return e.lights.at(0).direction_covariance[0] + e.lights.at(0).direction_covariance[2];
  };
  EXPECT_GT(trace(last), 0.8 * trace(first));
}

TEST(LightHistory, KeepsABoundedNumberOfFrames) {
  const LightingEstimate light = estimate_lighting(Seen{.lamps = {{towards(20, 40), 0, kWhite}}}.shading());
  LightHistory history;
  for (int k = 0; k < 1000; ++k) {
    LightingEstimate frame = light;
    history.average(at_s(k / 60.0), Quat{}, frame);
    ASSERT_LE(history.size(), 16U);
  }
  EXPECT_GE(history.size(), 10U);
  history.clear();
  EXPECT_EQ(history.size(), 0U);
}

LightingEstimate light_at(double azimuth_deg, double variance = 4e-4) {
  LightingEstimate out;
  LightEstimate one;
  one.light.direction = towards(azimuth_deg, 40);
  one.direction_covariance = {variance, 0, variance};
  out.lights.push_back(one);
  return out;
}

TEST(LightHistory, AnUnknownCovarianceCountsInNoMean) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  LightHistory history;
  LightingEstimate unknown = light_at(1, kInfinite), known = light_at(0), again = light_at(1, kInfinite);
  history.average(at_s(0), Quat{}, unknown);
  EXPECT_LT(angle_between(unknown.lights[0].light.direction, towards(1, 40)), 1e-9);
  history.average(at_s(0.1), Quat{}, known);
  EXPECT_LT(angle_between(known.lights[0].light.direction, towards(0, 40)), 1e-9);
  history.average(at_s(0.2), Quat{}, again);
  EXPECT_LT(angle_between(again.lights[0].light.direction, towards(1, 40)), 1e-9);
  LightingEstimate none;
  history.average(at_s(0.3), Quat{}, none);
  EXPECT_TRUE(none.lights.empty());
}

TEST(LightHistory, AnotherLightIsNoPartOfTheMean) {
  LightHistory history;
  LightingEstimate first = light_at(0), near = light_at(1), far = light_at(60);
  history.average(at_s(0), Quat{}, first);
  history.average(at_s(0.1), Quat{}, near);
  history.average(at_s(0.2), Quat{}, far);
  EXPECT_NEAR(angle_between(near.lights[0].light.direction, towards(0.5, 40)) / kDegree, 0, 0.01);
  EXPECT_LT(angle_between(far.lights[0].light.direction, towards(60, 40)), 1e-9);
}

TEST(Turned, LightAndCovarianceTurnWithTheAxes) {
  const Seen frame{.lamps = {{towards(20, 40), 0, kWhite}}, .noise = 0.01};
  const LightingEstimate light = estimate_lighting(frame.shading());
  const Quat turn = Quat::about(normalized(Vec3d{1, 2, 3}), 0.7);
  const LightingEstimate out = turned(light, turn), back = turned(out, turn.inverse());
  const LightEstimate &a = light.lights.at(0), &b = out.lights.at(0), &c = back.lights.at(0);
  EXPECT_LT(angle_between(b.light.direction, rotate(turn, a.light.direction)), 1e-9);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(a.direction_covariance[i], c.direction_covariance[i], 1e-12);
  EXPECT_NEAR(a.direction_covariance[0] + a.direction_covariance[2],
              b.direction_covariance[0] + b.direction_covariance[2], 1e-12);
  // Ambient irradiance at a normal that turns with the axes.
  const Vec3d normal = towards(-10, 5), there = rotate(turn, normal);
  const auto at = [](const LightingEstimate& e, Vec3d n) {
    return e.ambient[0][1] + e.ambient[1][1] * n.x + e.ambient[2][1] * n.y + e.ambient[3][1] * n.z;
  };
  EXPECT_NEAR(at(light, normal), at(out, there), 1e-9);
}

}  // namespace
}  // namespace lightwell::marker
