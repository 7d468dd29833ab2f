// Where the light of a marker holds, and how far away a near lamp is: from rendered frames to decoded messages.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include <lightwell/codec.hpp>
#include <lightwell/query.hpp>
#include <lightwell/uncertain_pose.hpp>

#include "firmware/estimate/marker/extreme_scenes.hpp"

namespace lightwell::marker::test {
namespace {

/// A body 170 px wide, 0.45 m from the camera, on a table; a lamp that illuminates visible faces.
ExtremeCase plain() { return extreme_cases(LIGHTWELL_MARKER_BODIES).front(); }

Vec3d true_direction(const ExtremeCase& what) { return reference::lamp_truths(what.scene).front().direction_probe; }

struct Estimated {
  Descriptor received;  ///< As a client decodes it.
  UncertainPose body;
};

/// From a noisy frame.
Estimated estimate(const ExtremeCase& what) {
  const Evaluation v = ExtremePicture(what).evaluate_frames(1).front();
  EXPECT_EQ(v.outcome, Outcome::right) << v.why;
  Encoder encoder;
  const auto bytes = encoder.encode(v.descriptor);
  EXPECT_TRUE(bytes.ok()) << bytes.status().message();
  if (!bytes.ok()) return {};
  const auto back = decode_descriptor(*bytes);
  EXPECT_TRUE(back.ok()) << back.status().message();
  return {back.ok() ? *back : Descriptor{}, v.report.body.probe_body};
}

/// Three standard deviations of the detected body's position, m, and attitude, rad.
struct PoseTolerance {
  double position = 0, attitude = 0;

  explicit PoseTolerance(const PoseCovariance& c)
      : position(3 * std::sqrt(c[3][3] + c[4][4] + c[5][5])), attitude(3 * std::sqrt(c[0][0] + c[1][1] + c[2][2])) {}
};

TEST(MarkerPosition, OriginIsTheBodysPose) {
  const ExtremeCase one = plain();
  const Estimated estimated = estimate(one);
  const Pose origin = estimated.received.T_probe_origin, truth = one.scene.probe_body;
  const PoseTolerance tolerance(estimated.body.covariance);
  EXPECT_LT(length(origin.translation - truth.translation), tolerance.position);
  const double half_angle = std::acos(std::min(1.0, std::abs((origin.rotation.inverse() * truth.rotation).w)));
  EXPECT_LT(2 * half_angle, tolerance.attitude);
  // Sigmas so large would test nothing.
  EXPECT_LT(tolerance.position, 0.02);
  EXPECT_LT(tolerance.attitude, 0.1);
}

TEST(MarkerPosition, NearLampHasADistanceWithinItsDeviation) {
  ExtremeCase one = plain();
  const Vec3d body = one.scene.probe_body.translation, to_lamp = true_direction(one);
  for (const double distance : {0.25, 0.3, 0.4}) {
    const double power = distance * distance;
    const Vec3d lamp = body + to_lamp * distance;
    one.scene.lamps = {reference::NearLamp{lamp, {power, 0.9 * power, 0.75 * power}}};
    const Estimated estimated = estimate(one);
    const Descriptor& d = estimated.received;
    ASSERT_FALSE(d.lights.empty()) << distance;
    const Light& light = d.lights.front();
    ASSERT_GT(light.distance_m, 0) << distance;
    // Three sigma of one frame.
    EXPECT_NEAR(light.distance_m, distance, 3 * light.distance_sigma_m) << distance;
    EXPECT_LT(light.distance_sigma_m, 0.1 * distance) << distance;
    const auto position = light_position(light, d.T_probe_origin);
    ASSERT_TRUE(position);
    const double across = std::sqrt(light.direction_covariance[0] + light.direction_covariance[2]) * distance;
    // Plus the error of the origin, which has no deviation on the wire.
    const double tolerance =
        3 * std::hypot(light.distance_sigma_m, across) + PoseTolerance(estimated.body.covariance).position;
    EXPECT_LT(length(*position - lamp), tolerance) << distance;
  }
}

TEST(MarkerPosition, DistantLampHasNoDistance) {
  ExtremeCase one = plain();
  one.scene.lamps = {reference::DistantLamp{true_direction(one), {1, 0.9, 0.75}}};
  const Descriptor d = estimate(one).received;
  ASSERT_FALSE(d.lights.empty());
  EXPECT_EQ(d.lights.front().distance_m, 0);
  EXPECT_NE(d.T_probe_origin, Pose{}) << "the light holds at the body";
}

}  // namespace
}  // namespace lightwell::marker::test
