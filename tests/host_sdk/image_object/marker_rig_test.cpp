// The rig of a capture from a marker that turns with the object.
#include "marker_rig.hpp"

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace lightwell::test {
namespace {

using testing::HasSubstr;
using tool::MarkerEstimates;
using tool::rig_of;

constexpr double kDegree = std::numbers::pi / 180, kHalfFieldTan = 0.4;

/// A turntable before a camera that looks at its middle, with a marker off the axis and lamps around.
struct Turntable {
  double tilt_rad = 0;  ///< The camera looks down by this.
  double distance_m = 1.2;
  Vec3d marker{0.15, -0.05, 0.08};  ///< In the frame of the rig at turn 0.
  std::vector<double> turns{0, 20 * kDegree, 75 * kDegree, 200 * kDegree};
  std::vector<Vec3d> lamps{{0.9, 0.8, 0.5}, {-0.4, 1.1, 0.9}, {0, 0.2, 1.5}};
  float distance_known = 1;  ///< 0: lamps have no distance.

  /// Camera from rig, whose origin is on the optical axis.
  [[nodiscard]] Pose camera_rig() const { return {Quat::about({1, 0, 0}, tilt_rad), {0, 0, -distance_m}}; }

  [[nodiscard]] MarkerEstimates estimates() const {
    MarkerEstimates out;
    const Quat stands = Quat::about(normalized(Vec3d{0.3, 1, -0.2}), 0.8);
    for (const double turn : turns) {
      const Quat q = Quat::about({0, 1, 0}, turn);
      const Pose T_camera_marker = compose(camera_rig(), {q * stands, rotate(q, marker)});
      out.emplace_back();
      for (const Vec3d& lamp : lamps) {
        const Vec3d to = transformed(camera_rig(), lamp) - T_camera_marker.translation;
        Descriptor d;
        d.T_probe_origin = T_camera_marker;
        Light light;
        light.direction = vec_cast<float>(normalized(to));
        light.distance_m = distance_known * static_cast<float>(length(to));
        light.irradiance = {2, 2, 2};
        d.lights.push_back(light);
        out.back().emplace_back(d);
      }
    }
    return out;
  }
};

std::string refusal(const MarkerEstimates& estimates) {
  const auto made = rig_of(estimates, kHalfFieldTan);
  EXPECT_FALSE(made.ok());
  return made.status().message();
}

void expect_turntable(const Turntable& truth, const tool::MarkerRig& found, double tolerance) {
  ASSERT_EQ(found.rig.turns_rad.size(), truth.turns.size());
  for (std::size_t v = 0; v < truth.turns.size(); ++v)
    EXPECT_NEAR(std::remainder(static_cast<double>(found.rig.turns_rad[v]) - truth.turns[v], 2 * std::numbers::pi), 0,
                tolerance);
  ASSERT_EQ(found.rig.light_positions.size(), truth.lamps.size());
  for (std::size_t l = 0; l < truth.lamps.size(); ++l)
    EXPECT_LT(length(vec_cast<double>(found.rig.light_positions[l]) - truth.lamps[l]), tolerance);
  EXPECT_NEAR(found.rig.camera_distance_m, truth.distance_m, tolerance);
  EXPECT_NEAR(found.rig.half_width_m, truth.distance_m * kHalfFieldTan, tolerance);
  EXPECT_FLOAT_EQ(found.rig.reference_irradiance, 2);
}

TEST(MarkerRig, IsThatOfTheTurntable) {
  const Turntable truth;
  const auto found = rig_of(truth.estimates(), kHalfFieldTan);
  ASSERT_TRUE(found.ok()) << found.status().message();
  expect_turntable(truth, *found, 1e-5);  // Floats of the descriptor.
  EXPECT_LT(found->axis_error_rad + found->light_spread_rad + found->tilt_rad, 1e-3);
}

TEST(MarkerRig, TakesTheAxisAsUpWhereTheCameraLooksDown) {
  const Turntable truth{.tilt_rad = 12 * kDegree};
  const auto found = rig_of(truth.estimates(), kHalfFieldTan);
  ASSERT_TRUE(found.ok()) << found.status().message();
  expect_turntable(truth, *found, 1e-5);
  EXPECT_NEAR(found->tilt_rad, 12 * kDegree, 1e-5);
}

TEST(MarkerRig, TwoOppositeTurnsAreEnough) {
  const Turntable truth{.turns = {0, std::numbers::pi}};
  const auto found = rig_of(truth.estimates(), kHalfFieldTan);
  ASSERT_TRUE(found.ok()) << found.status().message();
  expect_turntable(truth, *found, 1e-5);
}

TEST(MarkerRig, ALightIsWhereTheDirectionsFromTheMarkerMeet) {
  const Turntable truth{.distance_known = 0};
  const auto found = rig_of(truth.estimates(), kHalfFieldTan);
  ASSERT_TRUE(found.ok()) << found.status().message();
  expect_turntable(truth, *found, 1e-4);  // Floats, over a base of 0.3 m.
}

TEST(MarkerRig, LightsWithoutParallaxAreDistant) {
  // A marker on the axis.
  const Turntable truth{.marker = {0, 0.1, 0}, .lamps = {{60, 80, 0}, {-30, 40, 90}}, .distance_known = 0};
  const auto found = rig_of(truth.estimates(), kHalfFieldTan);
  ASSERT_TRUE(found.ok()) << found.status().message();
  for (std::size_t l = 0; l < 2; ++l)
    EXPECT_LT(angle_between(vec_cast<double>(found->rig.light_positions[l]), truth.lamps[l]), 1e-3);
}

TEST(MarkerRig, OneViewOfALightWithItsDistanceIsEnough) {
  const Turntable truth;
  MarkerEstimates estimates = truth.estimates();
  for (std::size_t v = 1; v < estimates.size(); ++v) estimates[v][0]->lights.clear();
  const auto found = rig_of(estimates, kHalfFieldTan);
  ASSERT_TRUE(found.ok()) << found.status().message();
  expect_turntable(truth, *found, 1e-5);
}

TEST(MarkerRig, PhotographsWithoutTheMarkerAreMadeUpForByOthers) {
  const Turntable truth;
  MarkerEstimates estimates = truth.estimates();
  estimates[0][1].reset();
  estimates[2][0].reset();
  estimates[3].pop_back();
  estimates[1][2]->lights.clear();
  const auto found = rig_of(estimates, kHalfFieldTan);
  ASSERT_TRUE(found.ok()) << found.status().message();
  expect_turntable(truth, *found, 1e-5);
}

TEST(MarkerRig, TellsHowDifferentTheLampsAre) {
  MarkerEstimates estimates = Turntable{}.estimates();
  for (auto& view : estimates) view[1]->lights[0].irradiance = {4, 4, 4};
  const auto found = rig_of(estimates, kHalfFieldTan);
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_NEAR(found->brightest_by_darkest, 2, 1e-6);
  EXPECT_NEAR(found->rig.reference_irradiance, 8 / 3.0, 1e-6);
}

TEST(MarkerRig, SaysWhatIsWrongWithTheCapture) {
  EXPECT_THAT(refusal({}), HasSubstr("photograph a second turn"));
  EXPECT_THAT(refusal(Turntable{.turns = {0.3}}.estimates()), HasSubstr("photograph a second turn"));
  EXPECT_THAT(refusal(Turntable{.turns = {0, 0}}.estimates()), HasSubstr("must turn with the object"));
  EXPECT_THAT(refusal(Turntable{.tilt_rad = 80 * kDegree}.estimates()), HasSubstr("must stand at its side"));

  MarkerEstimates estimates = Turntable{}.estimates();
  for (auto& estimate : estimates[2]) {
    Quat& q = estimate->T_probe_origin.rotation;
    q = Quat::about({0, 0, 1}, 8 * kDegree) * q;
  }
  EXPECT_THAT(refusal(estimates), HasSubstr("about another axis"));

  estimates = Turntable{}.estimates();
  estimates[3][1]->lights[0].direction = {-0.9F, 0.1F, -0.3F};
  EXPECT_THAT(refusal(estimates), HasSubstr("light 1 is up to"));

  estimates = Turntable{}.estimates();
  for (auto& view : estimates) view[2].reset();
  EXPECT_THAT(refusal(estimates), HasSubstr("no photograph with light 2"));
  for (auto& estimate : estimates[1]) estimate.reset();
  EXPECT_THAT(refusal(estimates), HasSubstr("in no photograph of view 1"));
}

}  // namespace
}  // namespace lightwell::test
