#include "measure/three_balls.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "measure/exact_map.hpp"

namespace lightwell::measure {
namespace {

namespace ref = reference;

const BallPicture& of(const BallPictures& pictures, Ball ball) { return pictures[static_cast<std::size_t>(ball)]; }

TEST(BallView, FillsItsSquareAndFacesTheViewer) {
  for (const ref::V3 towards : {ref::V3{0, 0, 1}, {0, 0, -1}, {2, 0.5, 1}}) {
    const BallView view(128, towards);
    const ref::V3 v = ref::normalised(towards);
    // The area of a disc. Pixels at its rim are inside or outside, which varies the count by about 4 sqrt(128).
    EXPECT_NEAR(static_cast<double>(view.pixels.size()), ref::pi * 64 * 64, 45);
    for (std::size_t k = 0; k < view.pixels.size(); ++k) {
      ASSERT_GT(ref::dot(view.normals[k], v), 0);
      // Law of reflection: equal angles, all three vectors in one plane.
      ASSERT_NEAR(ref::dot(view.normals[k], v), ref::dot(view.normals[k], view.reflections[k]), 1e-12);
      ASSERT_NEAR(ref::dot(ref::cross(view.normals[k], v), view.reflections[k]), 0, 1e-12);
    }
  }
}

TEST(BallView, ByHand) {
  const BallView view(128);  // The camera stands at +Z: right is +X, up is +Y.
  const auto at = [&](int i, int j) {
    const auto index = static_cast<std::size_t>(128 * j + i);
    return static_cast<std::size_t>(std::find(view.pixels.begin(), view.pixels.end(), index) - view.pixels.begin());
  };
  // Half a pixel from the centre, at a radius of 64 pixels; the reflection deviates by twice the angle.
  EXPECT_LT(ref::angle_deg(view.normals[at(64, 64)], {0, 0, 1}), 0.7);
  EXPECT_LT(ref::angle_deg(view.reflections[at(64, 64)], {0, 0, 1}), 1.4);
  // Where the normal is 45 degrees to the right (up), the mirrored direction is +X (+Y).
  EXPECT_LT(ref::angle_deg(view.reflections[at(64 + 45, 64)], {1, 0, 0}), 2);
  EXPECT_LT(ref::angle_deg(view.reflections[at(64, 63 - 45)], {0, 1, 0}), 2);
}

TEST(BallPictures, AConstantEnvironmentLightsAllPixelsEqually) {
  const PanoramaSums sums(ref::constant(256, 128, {1, 2, 3}));
  const BallPictures pictures = ball_pictures(BallView(32), sums);
  for (const Ball ball : kBalls) {
    for (const ref::Rgb& value : of(pictures, ball)) {
      // The irradiance's pixel rule: (pi / 128)^2 / 24 and the kink at the horizon.
      for (std::size_t c = 0; c < 3; ++c)
        ASSERT_NEAR(value[c], 0.8 * (static_cast<double>(c) + 1), 1e-3) << ball_name(ball);
    }
  }
}

TEST(BallPictures, RougherIsSmoother) {
  const PanoramaSums sums(ref::disc_lamp(256, 128, {0, 0, 1}, 0.1, {1, 1, 1}, 8));
  const BallPictures pictures = ball_pictures(BallView(64), sums);
  const auto peak = [&](Ball ball) {
    double most = 0;
    for (const ref::Rgb& value : of(pictures, ball)) most = std::max(most, value[1]);
    return most;
  };
  EXPECT_NEAR(peak(Ball::mirror), 0.8, 1e-9);
  EXPECT_GT(peak(Ball::mirror), peak(Ball::mirror_25));
  EXPECT_GT(peak(Ball::mirror_25), peak(Ball::matte_silver));
  EXPECT_GT(peak(Ball::matte_silver), peak(Ball::mirror_50));
  // A lamp of 0.1 rad straight ahead: E = pi sin^2, so 0.8 sin^2(0.1) at the middle of the diffuse ball.
  EXPECT_NEAR(peak(Ball::diffuse), 0.8 * std::pow(std::sin(0.1), 2), 2e-5);
}

TEST(BallError, ClippedIsOfWhatADisplayShows) {
  // A thousand pixels of 1 in green, and a lamp of 100 in one of them, which is beyond the 99.9th percentile.
  BallPicture truth(1000, {0, 1, 0}), answer = truth;
  truth[7] = {100, 100, 100};
  answer[7] = {3, 3, 3};
  EXPECT_NEAR(clipped_si_rmse(truth, answer), 0, 1e-12) << "both show white";
  EXPECT_GT(ball_error(truth, answer, 1).si_rmse, 1);
  answer[7] = {0, 1, 0};
  EXPECT_NEAR(clipped_si_rmse(truth, answer), std::sqrt(2.0 / 1000), 1e-12) << "a lamp is missing in two channels";
  EXPECT_TRUE(std::isnan(clipped_si_rmse(BallPicture(3), answer)));
}

TEST(ExactMap, TexelsAreMeansOfThePanorama) {
  const ExactMap constant(ref::constant(256, 128, {1, 2, 3}), 16);
  for (const ref::V3 d : {ref::V3{0, 1, 0}, {0, -1, 0}, {1, 0, 0}, {-0.6, -0.48, 0.64}})
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(constant.radiance(d)[c], static_cast<double>(c) + 1, 1e-9);
  // Light of one side alone: the map shows it there, across the edge of the square, too.
  const ref::V3 below = ref::normalised({0.1, -0.9, -0.5});
  const ExactMap lamp(ref::disc_lamp(256, 128, below, 0.3, {1, 1, 1}, 4), 32);
  EXPECT_NEAR(lamp.radiance(below)[0], 1, 1e-6);
  EXPECT_NEAR(lamp.radiance(ref::normalised({0.1, 0.9, -0.5}))[0], 0, 1e-9);
  EXPECT_NEAR(lamp.radiance(ref::normalised({-0.5, -0.9, 0.1}))[0], 0, 1e-9);
}

TEST(BallError, ByHand) {
  const BallPicture truth{{1, 0, 0}, {0, 2, 0}}, answer{{0.5, 0, 0}, {0, 1, 0}}, turned{{0, 1, 0}, {0, 2, 0}};
  const BallError half = ball_error(truth, answer, 1);
  EXPECT_DOUBLE_EQ(half.rmse, std::sqrt((0.25 + 1) / 2));  // by pixels, all three channels summed
  EXPECT_NEAR(half.si_rmse, 0, 1e-12);
  EXPECT_NEAR(half.angular_deg, 0, 1e-6);
  EXPECT_DOUBLE_EQ(half.truth_rms, std::sqrt(5.0 / 2));
  EXPECT_DOUBLE_EQ(ball_error(truth, answer, 4).rmse, 4 * half.rmse);
  const BallError other = ball_error(truth, turned, 1);
  EXPECT_NEAR(other.angular_deg, 45, 1e-9);  // 90 and 0
  // The best scale is ta / aa = 4 / 5: |t|^2 - (ta)^2 / aa = 5 - 16 / 5.
  EXPECT_NEAR(other.si_rmse, std::sqrt(1.8 / 2), 1e-12);
  const BallError black = ball_error(truth, {{0, 0, 0}, {0, 0, 0}}, 1);
  EXPECT_DOUBLE_EQ(black.si_rmse, black.truth_rms);
  EXPECT_EQ(black.angular_deg, 0);
}

TEST(Protocol, MedianOfPositiveValuesBecomesHalf) {
  ref::Panorama p = ref::constant(512, 256, {4, 4, 4});
  ref::set_pixel(p, 0, 0, {1e6, 0, 0});
  EXPECT_NEAR(exposure(p), 0.125, 1e-12);
  const ref::Panorama environment = published_environment(p);
  EXPECT_EQ(environment.width, 256);
  EXPECT_EQ(environment.height, 128);
  EXPECT_NEAR(ref::pixel(environment, 100, 60)[1], 0.5, 1e-12);
  // The mean of four pixels, then the gamma; nothing is clipped.
  EXPECT_NEAR(ref::pixel(environment, 0, 0)[0], 0.5 * std::pow((1e6 + 12) / 16, 1 / 2.4), 1e-9);
  EXPECT_EQ(exposure(ref::constant(16, 8, {0, 0, 0})), 1);
}

TEST(Protocol, AnyScaleOfAnAnswerIsTheSameAfterToneMapping) {
  const ref::RadianceFunction f = [](const ref::V3& d) { return ref::Rgb{1.1 + d.x, 1.2 + d.y, 1.3 + d.z}; };
  const ref::Panorama p = ref::from_function(256, 128, f, 1);
  ref::Panorama brighter = p;
  for (double& value : brighter.rgb) value *= 7;
  const ref::Panorama a = published_environment(p), b = published_environment(brighter);
  for (std::size_t k = 0; k < a.rgb.size(); k += 101) EXPECT_NEAR(a.rgb[k], b.rgb[k], 1e-12);
}

TEST(Protocol, ResizingKeepsTheMeanWithPartsOfPixels) {
  const ref::RadianceFunction f = [](const ref::V3& d) { return ref::Rgb{1 + d.x, 1 + d.y, 1 + d.z}; };
  // 300 is not a multiple of 256; the median of a linear ramp must not change.
  const double whole = exposure(ref::from_function(512, 256, f, 1)),
               parts = exposure(ref::from_function(300, 150, f, 1));
  EXPECT_NEAR(parts / whole, 1, 0.01);
}

TEST(AnswerEnvironment, LightsKeepTheirPowerAtAnySize) {
  const auto dark = [](const ref::V3&) { return ref::Rgb{-1, 0, 0}; };
  for (const double radius : {0.0, 0.005, 0.05, 0.5}) {
    const CapLight light{ref::normalised({1, 1, -1}), radius, {3, 2, 1}};
    const ref::Panorama p = answer_environment(dark, std::span(&light, 1));
    const ref::Rgb e = ref::irradiance(p, light.direction);
    // A disc with a radius of half a pixel is drawn with 32 steps per pixel; pixel centres may lie outside it.
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(e[c] / (3.0 - static_cast<double>(c)), 1, 0.03) << radius;
  }
}

}  // namespace
}  // namespace lightwell::measure
