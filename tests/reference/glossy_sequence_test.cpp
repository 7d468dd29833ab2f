// Trajectories inside their limits, smooth and covering the hemisphere; noise, albedo and lamps by seed.
#include "reference/glossy_sequence.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "reference/test_support.hpp"

namespace lightwell::reference {
namespace {

constexpr double kRadian = pi / 180;

/// The rotation from one pose to the next, in degrees: its sine is half the length of the antisymmetric part.
double turn_deg(const Pose& a, const Pose& b) {
  V3 axis{};
  for (std::size_t k = 0; k < 3; ++k) axis = axis + cross(a.rotation[k], b.rotation[k]);
  return std::asin(std::min(1.0, 0.5 * length(axis))) / kRadian;
}

double elevation_deg(const V3& p) { return std::atan2(p.z, std::hypot(p.x, p.y)) / kRadian; }

TEST(GlossySequence, GeneratorIsUniformAndGaussian) {
  SplitMix a(42), b(42), other(43), stream(42, 1);
  const auto first = a.next();
  EXPECT_EQ(first, b.next());
  EXPECT_NE(first, other.next());
  EXPECT_NE(first, stream.next());
  double sum = 0, squares = 0, uniform = 0;
  for (int k = 0; k < 100000; ++k) {
    const double g = a.gaussian(), u = b.uniform();
    ASSERT_GT(u, 0);
    ASSERT_LT(u, 1);
    sum += g, squares += g * g, uniform += u;
  }
  // Four standard deviations of the means.
  EXPECT_NEAR(sum / 1e5, 0, 4 / std::sqrt(1e5));
  EXPECT_NEAR(squares / 1e5, 1, 4 * std::sqrt(2 / 1e5));
  EXPECT_NEAR(uniform / 1e5, 0.5, 4 / std::sqrt(12e5));
}

TEST(GlossySequence, TrajectoryKeepsItsLimits) {
  for (const std::uint64_t seed : {1, 2, 3, 4, 5}) {
    TrajectoryOptions calm;
    calm.tremor_deg = 0;
    const std::vector<Pose> poses = hand_held_trajectory(seed, 1500, calm), shaken = hand_held_trajectory(seed, 1500);
    double lowest = 90, highest = 0, nearest = 1, farthest = 0, fastest = 0, gaze = 0, roll = 0, tremor = 0;
    for (std::size_t k = 0; k < poses.size(); ++k) {
      const V3 eye = eye_of(poses[k]);
      EXPECT_LT(distance(eye, eye_of(shaken[k])), 1e-12);
      lowest = std::min(lowest, elevation_deg(eye)), highest = std::max(highest, elevation_deg(eye));
      nearest = std::min(nearest, length(eye)), farthest = std::max(farthest, length(eye));
      const V3 axis = poses[k].rotation[2], right = poses[k].rotation[0];
      const V3 target = eye - (eye.z / axis.z) * axis;
      gaze = std::max(gaze, length(target));
      // Far from the zenith the gaze hardly adds to the roll.
      if (elevation_deg(eye) < 45) roll = std::max(roll, std::abs(std::asin(right.z)) / kRadian);
      for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
          EXPECT_NEAR(dot(shaken[k].rotation[i], shaken[k].rotation[j]), i == j ? 1 : 0, rounding);
        }
      }
      EXPECT_NEAR(dot(cross(poses[k].rotation[0], poses[k].rotation[1]), axis), 1, rounding);
      tremor = std::max(tremor, turn_deg(poses[k], shaken[k]));
      if (k > 0) fastest = std::max(fastest, 30 * turn_deg(poses[k - 1], poses[k]));
    }
    EXPECT_NEAR(lowest, 12, 0.1);
    EXPECT_NEAR(highest, 88, 1);  // the frame nearest to the top
    EXPECT_GE(nearest, 0.25);
    EXPECT_LE(farthest, 0.55);
    EXPECT_LE(gaze, 0.05 + 1e-9);
    EXPECT_LE(roll, 16);
    EXPECT_LE(fastest, 40) << seed;
    EXPECT_LE(tremor, 0.2 * std::sqrt(3.0));
    EXPECT_GT(tremor, 0.1);
  }
}

TEST(GlossySequence, TrajectoryIsSmooth) {
  // At 1000 frames/s: where a derivative jumped, the difference of second differences of the eye would not shrink with
  // the step. Per s^3 it is below 20 m: 0.5 m turned at some 2 rad/s near the top.
  TrajectoryOptions options;
  options.frames_per_s = 1000;
  const std::vector<Pose> poses = hand_held_trajectory(9, 30000, options);
  for (std::size_t k = 3; k < poses.size(); ++k) {
    const V3 a = eye_of(poses[k - 3]), b = eye_of(poses[k - 2]), c = eye_of(poses[k - 1]), d = eye_of(poses[k]);
    ASSERT_LT(length((d - a) - 3 * (c - b)) * 1e9, 20) << k;
  }
}

TEST(GlossySequence, TrajectorySeesTheWholeHemisphere) {
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    const std::vector<Pose> poses = hand_held_trajectory(seed, 1500);
    double farthest = 0;
    for (const V3& d : fibonacci_normals(600)) {
      if (elevation_deg(d) < 12) continue;
      double nearest = 180;
      for (const Pose& pose : poses) nearest = std::min(nearest, angle_deg(d, eye_of(pose)));
      farthest = std::max(farthest, nearest);
    }
    EXPECT_LT(farthest, 20) << seed;
  }
}

TEST(GlossySequence, GuidedTrajectoryLeavesNoGap) {
  TrajectoryOptions options;
  options.highest_deg = 82;
  for (const int frames : {300, 900}) {
    const std::vector<Pose> poses = guided_trajectory(7, frames, 5, options);
    ASSERT_EQ(poses.size(), static_cast<std::size_t>(frames));
    double widest = 0;
    for (double elevation = 12; elevation <= 90; elevation += 3)
      for (double azimuth = 0; azimuth < 360; azimuth += 6) {
        const V3 direction{std::cos(elevation * kRadian) * std::cos(azimuth * kRadian),
                           std::cos(elevation * kRadian) * std::sin(azimuth * kRadian), std::sin(elevation * kRadian)};
        double nearest = 180;
        for (const Pose& pose : poses)
          nearest = std::min(nearest, std::acos(std::min(1.0, dot(direction, normalised(eye_of(pose))))) / kRadian);
        widest = std::max(widest, nearest);
      }
    // 8.75 degrees half way between turns, and more beside the first turn. A plane of 0.2 m that is 0.4 m
    // away has directions within 14 degrees of that of its middle.
    EXPECT_LT(widest, 14) << frames;
    for (const Pose& pose : poses) {
      EXPECT_GT(elevation_deg(eye_of(pose)), 11.9);
      EXPECT_LT(elevation_deg(eye_of(pose)), 82.1);
    }
  }
}

TEST(GlossySequence, SameSeedSameNumbers) {
  const std::vector<Pose> a = hand_held_trajectory(5, 50), b = hand_held_trajectory(5, 80),
                          other = hand_held_trajectory(6, 50);
  for (std::size_t k = 0; k < 50; ++k) EXPECT_EQ(distance(a[k].translation, b[k].translation), 0);
  EXPECT_GT(distance(a[20].translation, other[20].translation), 1e-3);
  EXPECT_EQ(book_texture(3, 64).rgb, book_texture(3, 64).rgb);
  EXPECT_NE(book_texture(3, 64).rgb, book_texture(4, 64).rgb);
  EXPECT_EQ(random_lamps(3, 32, 16, 3).rgb, random_lamps(3, 32, 16, 3).rgb);
  // The numbers themselves, so that they stay: sequences of other tests depend on them.
  EXPECT_EQ(SplitMix(1, 2).next(), 2353714295847375532ULL);
  EXPECT_NEAR(eye_of(a[20]).x, -0.006062008392, 1e-9);
  EXPECT_NEAR(luminance(mean_radiance(random_lamps(3, 32, 16, 3))), 1.009574229292, 1e-9);
}

TEST(GlossySequence, PoseNoiseHasItsDeviation) {
  double angles = 0, ways = 0;
  const int count = 4000;
  for (int k = 0; k < count; ++k) {
    const Pose noise = pose_noise(8, k, 0.002, 0.001);
    const double angle = turn_deg({}, noise) * kRadian;
    angles += angle * angle, ways += dot(noise.translation, noise.translation);
  }
  // Mean squares of three axes; four standard deviations.
  EXPECT_NEAR(angles / (3 * count * 4e-6), 1, 4 * std::sqrt(2.0 / (3 * count)));
  EXPECT_NEAR(ways / (3 * count * 1e-6), 1, 4 * std::sqrt(2.0 / (3 * count)));
  EXPECT_GT(distance(pose_noise(8, 0, 0.002, 0.001).translation, pose_noise(8, 1, 0.002, 0.001).translation), 1e-5);
  // On the camera's side: a point moves as the camera's coordinates say.
  const Pose pose = hand_held_trajectory(1, 1)[0], noise = pose_noise(8, 3, 0.01, 0.01), moved = perturbed(pose, noise);
  const V3 p{0.02, -0.03, 0};
  const V3 expected = rotated(noise.rotation, rotated(pose.rotation, p) + pose.translation) + noise.translation;
  EXPECT_LT(distance(rotated(moved.rotation, p) + moved.translation, expected), rounding);
}

TEST(GlossySequence, BooksHaveTheAlbedoOfPrint) {
  double mean = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const PlaneTexture book = book_texture(seed, 128);
    const auto [low, high] = std::minmax_element(book.rgb.begin(), book.rgb.end());
    EXPECT_GE(*low, 0.03);
    EXPECT_EQ(*high, 0.8);
    for (const double v : book.rgb) mean += v / static_cast<double>(20 * book.rgb.size());
  }
  EXPECT_NEAR(mean, 0.37, 0.03);
  const PlaneTexture plain = plain_texture(4, {0.1, 0.2, 0.3});
  EXPECT_EQ(plain.rgb.size(), 48U);
  EXPECT_EQ(plain.rgb[46], 0.2);
}

TEST(GlossySequence, LampsHaveTheirIrradiance) {
  // E of a disc is pi L sin^2(radius) n.l.
  const V3 d = normalised({0.3, 0.8, -0.2});
  const Panorama env = lamps_on_gradient(256, 128, {1, 1, 1}, {1, 1, 1}, {{d, 0.08, {50, 40, 30}}});
  const double lamp = pi * std::pow(std::sin(0.08), 2) * d.y;
  const Rgb e = plane_irradiance(env);
  // disc_lamp is exact to 2e-4 at radii of ten pixels; here three.
  EXPECT_NEAR((e[0] - pi) / (50 * lamp), 1, 2e-3);
  EXPECT_NEAR((e[2] - pi) / (30 * lamp), 1, 2e-3);
}

}  // namespace
}  // namespace lightwell::reference
