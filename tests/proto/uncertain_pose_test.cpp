// Covariance propagation of poses against finite differences and hand-computed cases.
#include "lightwell/uncertain_pose.hpp"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace lightwell {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

Pose some_pose(double angle, Vec3d axis, Vec3d t) { return {Quat::about(normalized(axis), angle), t}; }

/// `pose` perturbed by `error`: rotation (rad) and translation (m), as defined in the header.
Pose shifted(const Pose& p, const std::array<double, 6>& error) {
  const Vec3d w{error[0], error[1], error[2]};
  return {Quat::about(normalized(w), length(w)) * p.rotation, p.translation + Vec3d{error[3], error[4], error[5]}};
}

/// The inverse: the error between two poses.
std::array<double, 6> error_of(const Pose& truth, const Pose& off) {
  const Quat q = off.rotation * truth.rotation.inverse();
  const double sign = q.w < 0 ? -1 : 1;
  const Vec3d t = off.translation - truth.translation;
  return {2 * sign * q.x, 2 * sign * q.y, 2 * sign * q.z, t.x, t.y, t.z};
}

UncertainPose uncertain(const Pose& pose, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  PoseCovariance root{}, c{};
  for (auto& row : root)
    for (double& v : row) v = 1e-3 * normal(random);
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = 0; j < 6; ++j)
      for (std::size_t k = 0; k < 6; ++k) c[i][j] += root[i][k] * root[j][k];
  return {pose, c};
}

/// Covariance of f(in) from finite differences of 1e-6 in each component of the error.
template <class F>
PoseCovariance by_differences(const UncertainPose& in, F f) {
  constexpr double kStep = 1e-6;
  PoseCovariance slope{}, out{};
  for (std::size_t k = 0; k < 6; ++k) {
    std::array<double, 6> error{};
    error[k] = kStep;
    const auto e = error_of(f(in.pose), f(shifted(in.pose, error)));
    for (std::size_t i = 0; i < 6; ++i) slope[i][k] = e[i] / kStep;
  }
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = 0; j < 6; ++j)
      for (std::size_t k = 0; k < 6; ++k)
        for (std::size_t l = 0; l < 6; ++l) out[i][j] += slope[i][k] * in.covariance[k][l] * slope[j][l];
  return out;
}

void expect_same(const PoseCovariance& a, const PoseCovariance& b) {
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = 0; j < 6; ++j)
      // Finite differences of 1e-6 have a relative error of about 1e-6.
      EXPECT_NEAR(a[i][j], b[i][j], 1e-4 * std::sqrt(b[i][i] * b[j][j])) << i << " " << j;
}

const Pose kA = some_pose(1.1, {1, 2, -0.5}, {0.3, -1.2, 2}), kB = some_pose(-2.3, {0.2, -1, 0.7}, {1.5, 0.4, -0.8});

TEST(Pose, ComposeAndInverseAreConsistent) {
  const Vec3d p{0.2, 0.5, -3};
  EXPECT_LT(length(transformed(compose(kA, kB), p) - transformed(kA, transformed(kB, p))), 1e-14);
  EXPECT_LT(length(transformed(inverse(kA), transformed(kA, p)) - p), 1e-14);
}

TEST(UncertainPose, InverseCovarianceMatchesFiniteDifferences) {
  const UncertainPose a = uncertain(kA, 1);
  expect_same(inverse(a).covariance, by_differences(a, [](const Pose& p) { return inverse(p); }));
}

TEST(UncertainPose, ComposedCovarianceMatchesFiniteDifferences) {
  const UncertainPose a = uncertain(kA, 2), b = uncertain(kB, 3);
  PoseCovariance sum = by_differences(a, [&](const Pose& p) { return compose(p, kB); });
  const PoseCovariance second = by_differences(b, [&](const Pose& p) { return compose(kA, p); });
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = 0; j < 6; ++j) sum[i][j] += second[i][j];
  expect_same(compose(a, b).covariance, sum);
}

TEST(UncertainPose, DeviceTiltDisplacesADistantProbe) {
  UncertainPose device;
  device.covariance[0][0] = 1e-4;  // 0.01 rad about X
  UncertainPose tag;
  tag.pose.translation = {0, 0, -3};
  const UncertainPose out = compose(device, tag);
  EXPECT_NEAR(out.covariance[4][4], 9e-4, 1e-12) << "3 m ahead, 3 cm up or down";
  EXPECT_EQ(out.covariance[3][3], 0);
  EXPECT_NEAR(out.covariance[0][4], 3e-4, 1e-12) << "a rotation about X raises a point ahead";
}

TEST(UncertainPose, InfiniteVariancesPropagateWithoutAffectingOthers) {
  UncertainPose a{kA, {}};
  for (std::size_t i = 0; i < 6; ++i) a.covariance[i][i] = 1e-6;
  a.covariance[4][4] = kInfinite;
  const UncertainPose b = uncertain(kB, 5);
  const UncertainPose chain = compose(a, b);
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = 0; j < 6; ++j) {
      if (i == 4 && j == 4) {
        EXPECT_EQ(chain.covariance[i][j], kInfinite);
      } else if (i == 4 || j == 4) {
        EXPECT_EQ(chain.covariance[i][j], 0);
      } else {
        EXPECT_TRUE(std::isfinite(chain.covariance[i][j]));
      }
    }
  const UncertainPose back = inverse(a);
  for (const std::size_t i : {3u, 4u, 5u}) EXPECT_EQ(back.covariance[i][i], kInfinite) << "seen from axes askew";
  for (const std::size_t i : {0u, 1u, 2u}) EXPECT_NEAR(back.covariance[i][i], 1e-6, 1e-12);
}

TEST(OwnTag, DetectedTagGivesTheProbePose) {
  // By hand: the device is at (1, 1.5, 0) and looks along the world's -X; the probe is 2 m ahead of it with its back
  // towards the device; the tag is on its back, 5 cm behind its origin.
  UncertainPose world_device, device_tag, probe_tag;
  const double quarter = std::acos(0.0);
  world_device.pose = {Quat::about({0, 1, 0}, quarter), {1, 1.5, 0}};
  device_tag.pose = {{}, {0, 0, -2}};
  // The tag's normal is the probe's +Z (backwards).
  probe_tag.pose = {{}, {0, 0, 0.05}};
  const UncertainPose probe = probe_from_own_tag(world_device, device_tag, probe_tag);
  EXPECT_LT(length(probe.pose.translation - Vec3d{-1.05, 1.5, 0}), 1e-12);
  EXPECT_LT(length(rotate(probe.pose.rotation, Vec3d{0, 0, -1}) - Vec3d{-1, 0, 0}), 1e-12) << "it looks away";
  EXPECT_LT(length(rotate(probe.pose.rotation, Vec3d{0, 1, 0}) - Vec3d{0, 1, 0}), 1e-12);
}

}  // namespace
}  // namespace lightwell
