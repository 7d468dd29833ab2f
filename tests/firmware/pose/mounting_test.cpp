// find_mounting: accuracy, consistency of the covariance, ambiguity, gravity, outlier tags, invalid input.
#include "pose/mounting.hpp"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/pose/mounting_room.hpp"

namespace lightwell {
namespace {

using test::error_of;
using test::kDegree;
using test::kPi;
using test::pair_rig;
using test::probe_in_room;
using test::simulate_observations;
using test::tags_on_walls;
using testing::HasSubstr;

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

MountingOptions exact_model() {
  MountingOptions options;
  options.model_error_px = 0;
  return options;
}

double angle_of(const std::array<double, 6>& e) { return std::hypot(e[0], e[1], e[2]); }
double distance_of(const std::array<double, 6>& e) { return std::hypot(e[3], e[4], e[5]); }

std::string refusal(const Result<Mounting>& result) {
  EXPECT_FALSE(result);
  return result.ok() ? "accepted" : result.status().message();
}

TEST(Mounting, ExactCornersGiveTheExactPose) {
  RigParameters rig = pair_rig();
  const auto room = tags_on_walls();
  const auto seen = simulate_observations(rig, room, probe_in_room(), 0, 1);
  // Quaternions of a calibration may be unnormalised.
  rig.lenses[1].pose_cv.rotation = {0, 0, 2, 0};
  ASSERT_TRUE(std::any_of(seen.begin(), seen.end(), [](const TagObservation& s) { return s.lens == 1; }));
  const auto mounting = find_mounting(rig, room, seen);
  ASSERT_TRUE(mounting) << mounting.status().message();
  const auto e = error_of(mounting->world_probe.pose, probe_in_room());
  EXPECT_LT(angle_of(e), 1e-8);
  EXPECT_LT(distance_of(e), 1e-8);
  EXPECT_LT(mounting->rms_px, 1e-5);
  EXPECT_TRUE(mounting->position_known && mounting->heading_known);
  EXPECT_FALSE(mounting->ambiguous);
  ASSERT_EQ(mounting->tags.size(), seen.size());
  for (const TagReport& report : mounting->tags) EXPECT_TRUE(report.used);
}

/// Number of 100 trials within three standard deviations, for each of the six parameters.
std::array<int, 6> within_three_sigma(const RigParameters& rig, const std::vector<WorldTag>& room, const Pose& truth,
                                      const char* name, double sigma_px = 0.1,
                                      std::optional<GravityReading> gravity = std::nullopt) {
  std::array<int, 6> inside{};
  double worst_angle = 0, worst_place = 0, normalized_sum = 0;
  int trials = 0;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    const auto mounting = find_mounting(rig, room, simulate_observations(rig, room, truth, sigma_px, 1000 + seed),
                                        gravity, exact_model());
    EXPECT_TRUE(mounting) << mounting.status().message();
    if (!mounting) continue;
    const auto e = error_of(mounting->world_probe.pose, truth);
    for (std::size_t i = 0; i < 6; ++i) {
      const double sigma = std::sqrt(mounting->world_probe.covariance[i][i]);
      inside[i] += std::abs(e[i]) <= 3 * sigma;
      normalized_sum += e[i] * e[i] / (sigma * sigma);
    }
    worst_angle = std::max(worst_angle, angle_of(e));
    worst_place = std::max(worst_place, distance_of(e));
    ++trials;
  }
  std::cout << name << ": within 3 sigma";
  for (const int n : inside) std::cout << " " << n;
  std::cout << " of " << trials << "; mean (e/sigma)^2 " << normalized_sum / (6 * trials) << "; worst direction "
            << worst_angle / kDegree << " deg, worst place " << 1000 * worst_place << " mm\n";
  // 1 for a consistent covariance; the lower bound excludes one that is far too large.
  EXPECT_GT(normalized_sum / (6 * trials), 0.4) << name;
  EXPECT_LT(normalized_sum / (6 * trials), 1.6) << name;
  return inside;
}

TEST(Mounting, ErrorsAreConsistentWithTheCovariance) {
  const RigParameters rig = pair_rig();
  const auto room = tags_on_walls();
  for (const int n : within_three_sigma(rig, room, probe_in_room(), "eight tags, two lenses")) EXPECT_GE(n, 95);
  RigParameters one_lens = rig;
  one_lens.lenses.resize(1);
  for (const int n : within_three_sigma(one_lens, room, probe_in_room(), "one lens")) EXPECT_GE(n, 95);
  // A single tag, large and tilted enough to have a unique solution.
  const std::vector<WorldTag> single = {{TagFamily::tag36h11, 0, 0.4, {Quat::about({0, 1, 0}, 0.6), {0.1, 1.4, -1.2}}}};
  for (const int n : within_three_sigma(rig, single, probe_in_room(), "one tag")) EXPECT_GE(n, 95);
}

TEST(Mounting, DirectionErrorIsBelowATenthOfADegree) {
  const RigParameters rig = pair_rig();
  const auto room = tags_on_walls();
  double worst = 0;
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    const auto mounting = find_mounting(rig, room, simulate_observations(rig, room, probe_in_room(), 0.2, seed));
    ASSERT_TRUE(mounting);
    worst = std::max(worst, angle_of(error_of(mounting->world_probe.pose, probe_in_room())));
  }
  std::cout << "corners off by 0.2 px: direction within " << worst / kDegree << " deg\n";
  EXPECT_LT(worst, 0.1 * kDegree);
}

TEST(Mounting, ADistantTagSeenHeadOnIsAmbiguousAndHasAnAlternative) {
  RigParameters rig = pair_rig();
  rig.lenses.resize(1);
  Pose probe;
  probe.translation = {0, 1.4, 1.0};
  const Pose tilted{Quat::about({0, 1, 0}, 0.25), {0.2, 1.4, -1}};
  const std::vector<WorldTag> room = {{TagFamily::tag36h11, 5, 0.12, tilted}};
  int ambiguous = 0, near_either = 0;
  constexpr int kTrials = 20;
  for (std::uint64_t seed = 0; seed < kTrials; ++seed) {
    const auto mounting = find_mounting(rig, room, simulate_observations(rig, room, probe, 0.2, seed));
    ASSERT_TRUE(mounting) << mounting.status().message();
    if (!mounting->ambiguous) continue;
    ++ambiguous;
    ASSERT_TRUE(mounting->alternative);
    const double a = angle_of(error_of(mounting->world_probe.pose, probe)),
                 b = angle_of(error_of(*mounting->alternative, probe));
    near_either += std::min(a, b) < 0.12;
    EXPECT_GT(angle_of(error_of(*mounting->alternative, mounting->world_probe.pose)), 0.1);
    EXPECT_GE(mounting->alternative_excess, 0);
  }
  std::cout << "far tag: ambiguous in " << ambiguous << " of " << kTrials << ", truth near one of the two in "
            << near_either << "\n";
  EXPECT_GE(ambiguous, kTrials * 8 / 10);
  EXPECT_GE(near_either, ambiguous * 9 / 10);
}

TEST(Mounting, GravityResolvesTheAmbiguity) {
  RigParameters rig = pair_rig();
  rig.lenses.resize(1);
  Pose probe;
  probe.translation = {0, 1.4, 1.0};
  // Tilted about the horizontal axis, so that the second pose differs in the tilt of the probe.
  const std::vector<WorldTag> room = {{TagFamily::tag36h11, 5, 0.12, {Quat::about({1, 0, 0}, 0.35), {0.1, 1.4, -1}}}};
  GravityReading gravity{{0, 9.8, 0}, 0.5 * kDegree};
  int without = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const auto seen = simulate_observations(rig, room, probe, 0.2, seed);
    without += find_mounting(rig, room, seen)->ambiguous;
    const auto with = find_mounting(rig, room, seen, gravity);
    ASSERT_TRUE(with);
    EXPECT_FALSE(with->ambiguous) << seed;
    const auto e = error_of(with->world_probe.pose, probe);
    EXPECT_LT(std::hypot(e[0], e[2]), 2 * kDegree) << "tilt error";
  }
  EXPECT_GT(without, 5) << "the case must be ambiguous without gravity";
}

TEST(Mounting, GravityReducesTheVarianceOfTheUpDirection) {
  const RigParameters rig = pair_rig();
  const std::vector<WorldTag> room = {{TagFamily::tag36h11, 0, 0.3, {Quat::about({0, 1, 0}, 0.6), {0.1, 1.4, -1.2}}}};
  const auto seen = simulate_observations(rig, room, probe_in_room(), 0.3, 3);
  GravityReading gravity;
  gravity.up_probe = rotate(probe_in_room().rotation.inverse(), Vec3d{0, 1, 0});
  gravity.sigma_rad = 0.05 * kDegree;
  const auto alone = find_mounting(rig, room, seen), with = find_mounting(rig, room, seen, gravity);
  ASSERT_TRUE(alone && with);
  for (const std::size_t i : {0u, 2u}) {
    EXPECT_LT(with->world_probe.covariance[i][i], 0.5 * alone->world_probe.covariance[i][i]);
    EXPECT_LE(std::sqrt(with->world_probe.covariance[i][i]),
              1.01 * gravity.sigma_rad * std::max(1.0, std::sqrt(with->chi_square)));
  }
  const auto e = error_of(with->world_probe.pose, probe_in_room());
  EXPECT_LT(std::hypot(e[0], e[2]), 3 * 0.05 * kDegree * std::sqrt(2));
}

TEST(Mounting, WithGravityAloneHeadingAndPositionHaveInfiniteVariance) {
  const RigParameters rig = pair_rig();
  for (const Vec3d up : {Vec3d{0, 1, 0}, Vec3d{0.3, 9, -2}, Vec3d{0, -1, 0}, Vec3d{1e-9, -1, 0}, Vec3d{5, 0, 0}}) {
    const auto mounting = find_mounting(rig, {}, {}, GravityReading{up, 0.01});
    ASSERT_TRUE(mounting) << mounting.status().message();
    EXPECT_FALSE(mounting->position_known || mounting->heading_known);
    const Vec3d upright = rotate(mounting->world_probe.pose.rotation, normalized(up));
    EXPECT_LT(angle_between(upright, Vec3d{0, 1, 0}), 1e-7) << up.x << " " << up.y << " " << up.z;
    const PoseCovariance& c = mounting->world_probe.covariance;
    for (std::size_t i = 0; i < 6; ++i)
      for (std::size_t j = 0; j < 6; ++j)
        EXPECT_EQ(c[i][j], i != j ? 0 : i == 0 || i == 2 ? 1e-4 : kInfinite) << i << " " << j;
  }
  // Tags that are not in the room's list are ignored.
  auto seen = simulate_observations(rig, tags_on_walls(), probe_in_room(), 0, 1);
  const auto unknown = find_mounting(rig, {}, seen, GravityReading{{0, 1, 0}, 0.01});
  ASSERT_TRUE(unknown);
  EXPECT_EQ(unknown->tags.size(), seen.size());
  EXPECT_FALSE(unknown->tags[0].used);
}

TEST(Mounting, AMovedTagIsRejectedAndNamed) {
  const RigParameters rig = pair_rig();
  auto room = tags_on_walls();
  const auto seen = simulate_observations(rig, room, probe_in_room(), 0.1, 7);
  room[2].world_tag.translation += Vec3d{0.05, 0.1, 0};
  const auto mounting = find_mounting(rig, room, seen);
  ASSERT_TRUE(mounting) << mounting.status().message();
  const auto e = error_of(mounting->world_probe.pose, probe_in_room());
  EXPECT_LT(angle_of(e), 0.1 * kDegree);
  EXPECT_LT(distance_of(e), 0.003);
  int rejected = 0;
  for (const TagReport& report : mounting->tags) {
    EXPECT_EQ(report.used, report.id != 2);
    EXPECT_EQ(report.rejection_reason, report.used ? "" : "it contradicts the others");
    rejected += !report.used;
  }
  EXPECT_GE(rejected, 1);
}

TEST(Mounting, RejectsTwoTagsThatContradictEachOther) {
  RigParameters rig = pair_rig();
  rig.lenses.resize(1);
  std::vector<WorldTag> room = tags_on_walls();
  room.resize(2);
  const auto seen = simulate_observations(rig, room, probe_in_room(), 0.1, 7);
  ASSERT_EQ(seen.size(), 2u);
  room[1].world_tag.rotation = Quat::about({0, 1, 0}, 0.4);
  room[1].world_tag.translation += Vec3d{0, 0.3, 0};
  const auto mounting = find_mounting(rig, room, seen);
  EXPECT_EQ(mounting.status().code(), StatusCode::failed_precondition);
  EXPECT_THAT(refusal(mounting), HasSubstr("contradict each other"));
}

TEST(Mounting, UsesATagBeyondNinetyDegrees) {
  RigParameters rig = pair_rig();
  rig.lenses.resize(1);
  // All four corners are more than 90 degrees from the lens axis.
  std::vector<WorldTag> room = {{TagFamily::tag36h11, 1, 0.03, {}}};
  room[0].world_tag = {test::board_facing(test::single_tag(1, 0.03), {}, Vec3d{-1, 0, 0.4}).world_board.rotation,
                       {1, 0, 0.02}};
  const auto seen = simulate_observations(rig, room, {}, 0, 1);
  ASSERT_EQ(seen.size(), 1u);
  for (const PixelPosition p : seen[0].tag.corners)
    EXPECT_LT(CameraModel(rig.lenses[0]).unproject(p)->z, 0) << "behind the lens";
  const auto mounting = find_mounting(rig, room, seen);
  ASSERT_TRUE(mounting) << mounting.status().message();
  const auto e = error_of(mounting->world_probe.pose, {});
  EXPECT_LT(angle_of(e), 1e-6);
  EXPECT_LT(distance_of(e), 1e-6);
}

TEST(Mounting, FromPicturesOfBothLensesThroughTheDetector) {
  RigParameters rig = pair_rig(800);
  const auto room = tags_on_walls();
  std::vector<test::PlacedBoard> boards;
  for (const WorldTag& tag : room) {
    const TagBoard board = test::single_tag(tag.id, tag.size_m);
    boards.push_back({board, {tag.world_tag.rotation, transformed(tag.world_tag, tag_corners(tag.size_m)[0])}});
  }
  auto detector = TagDetector::make();
  ASSERT_TRUE(detector);
  std::vector<TagObservation> seen;
  for (std::size_t lens = 0; lens < 2; ++lens) {
    const test::BoardCamera camera(rig.lenses[lens]);
    const auto tags = detector->detect(camera.take(probe_in_room(), boards).view(), &camera.model());
    ASSERT_TRUE(tags);
    for (const TagDetection& tag : *tags) seen.push_back({static_cast<int>(lens), tag});
  }
  ASSERT_GE(seen.size(), 6u);
  const auto mounting = find_mounting(rig, room, seen, std::nullopt, exact_model());
  ASSERT_TRUE(mounting) << mounting.status().message();
  const auto e = error_of(mounting->world_probe.pose, probe_in_room());
  std::cout << "through pictures, " << seen.size() << " tags of 16 cm: direction " << angle_of(e) / kDegree
            << " deg, place " << 1000 * distance_of(e) << " mm, RMS " << mounting->rms_px << " px\n";
  for (std::size_t i = 0; i < 6; ++i) EXPECT_LT(std::abs(e[i]), 3 * std::sqrt(mounting->world_probe.covariance[i][i]));
  EXPECT_LT(angle_of(e), 0.05 * kDegree);
  EXPECT_LT(distance_of(e), 0.002);
}

TEST(Mounting, RejectsInputThatDeterminesNoPose) {
  const RigParameters rig = pair_rig();
  const auto room = tags_on_walls();
  const auto good = simulate_observations(rig, room, probe_in_room(), 0, 1);
  const auto with = [&](auto change) {
    std::vector<TagObservation> seen = {good[0]};
    change(seen[0]);
    return refusal(find_mounting(rig, room, seen));
  };
  EXPECT_THAT(refusal(find_mounting(rig, room, {})), HasSubstr("no tag is seen"));
  EXPECT_THAT(refusal(find_mounting(rig, {}, good)), HasSubstr("is in the room's list"));
  EXPECT_THAT(with([](TagObservation& s) { s.tag.corners[1].x = kNan; }), HasSubstr("corner 1 is not a number"));
  EXPECT_THAT(with([](TagObservation& s) { s.tag.covariance[3].xx = kNan; }), HasSubstr("corner 3's covariance"));
  EXPECT_THAT(with([](TagObservation& s) { s.tag.covariance[3] = {1, 2, 1}; }), HasSubstr("positive definite"));
  EXPECT_THAT(with([](TagObservation& s) { s.lens = 2; }), HasSubstr("the rig has 2 lenses"));
  EXPECT_THAT(with([](TagObservation& s) {
                s.tag.corners[0] = {-400, -400};
              }),
              HasSubstr("outside the lens's field of view"));
  EXPECT_THAT(with([](TagObservation& s) { std::swap(s.tag.corners[1], s.tag.corners[3]); }),
              HasSubstr("seen from behind"));
  EXPECT_THAT(with([](TagObservation& s) {
                // On a line through the centre of the picture, which is the image of a great circle.
                for (std::size_t k = 0; k < 4; ++k) s.tag.corners[k] = {500 + 20.0 * static_cast<double>(k), 479.5};
              }),
              HasSubstr("lie in a line"));
  EXPECT_THAT(with([](TagObservation& s) { s.tag.corners.fill({300, 300}); }), HasSubstr("lie in a line"));
  auto twice = good;
  twice.push_back(good[0]);
  EXPECT_THAT(refusal(find_mounting(rig, room, twice)), HasSubstr("seen twice"));

  const auto in = [&](auto change) {
    auto other = room;
    change(other[0]);
    return refusal(find_mounting(rig, other, good));
  };
  EXPECT_THAT(in([](WorldTag& t) { t.size_m = 0; }), HasSubstr("size must be positive"));
  EXPECT_THAT(in([](WorldTag& t) { t.world_tag.rotation = {0, 0, 0, 0}; }), HasSubstr("quaternion"));
  EXPECT_THAT(in([](WorldTag& t) { t.world_tag.rotation.x = kNan; }), HasSubstr("quaternion"));
  EXPECT_THAT(in([](WorldTag& t) { t.world_tag.translation.y = kInfinite; }), HasSubstr("not a number"));
  EXPECT_THAT(in([](WorldTag& t) { t.id = 1; }), HasSubstr("listed twice"));

  for (const GravityReading& gravity : {GravityReading{{0, 0, 0}, 0.1}, GravityReading{{0, kNan, 0}, 0.1},
                                        GravityReading{{0, 1, 0}, 0}, GravityReading{{0, 1, 0}, kInfinite}}) {
    EXPECT_THAT(refusal(find_mounting(rig, room, good, gravity)), HasSubstr("gravity:"));
    EXPECT_THAT(refusal(gravity_mounting(gravity)), HasSubstr("gravity:"));
  }
  MountingOptions options;
  options.model_error_px = -1;
  EXPECT_THAT(refusal(find_mounting(rig, room, good, std::nullopt, options)), HasSubstr("model_error_px"));
}

TEST(Mounting, ATagOnEdgeIsRejectedIfOthersAreSeen) {
  const RigParameters rig = pair_rig();
  const auto room = tags_on_walls();
  auto seen = simulate_observations(rig, room, probe_in_room(), 0, 1);
  for (std::size_t k = 0; k < 4; ++k) seen[0].tag.corners[k] = {500 + 20.0 * static_cast<double>(k), 479.5};
  const auto mounting = find_mounting(rig, room, seen);
  ASSERT_TRUE(mounting) << mounting.status().message();
  EXPECT_LT(angle_of(error_of(mounting->world_probe.pose, probe_in_room())), 1e-8);
  EXPECT_FALSE(mounting->tags[0].used);
  EXPECT_THAT(mounting->tags[0].rejection_reason, HasSubstr("lie in a line"));
  seen[1].tag.corners[0].y = kNan;
  EXPECT_THAT(refusal(find_mounting(rig, room, seen)), HasSubstr("is not a number"))
      << "NaN is an error even if other tags are valid";
}

TEST(TagsOf, PlacesTheTagsOfABoard) {
  TagBoard board;
  board.columns = 2;
  board.rows = 1;
  board.tag_size_m = 0.1;
  board.spacing = 0.5;
  board.first_id = 7;
  // On the wall at +X, facing the room: the board's +X is the world's +Z.
  const Pose wall{Quat::about({0, 1, 0}, -kPi / 2), {2, 1, 0}};
  const auto tags = tags_of(board, wall);
  ASSERT_EQ(tags.size(), 2u);
  EXPECT_EQ(tags[1].id, 8);
  EXPECT_LT(length(tags[1].world_tag.translation - Vec3d{2, 1.05, 0.2}), 1e-12);
  EXPECT_LT(length(rotate(tags[1].world_tag.rotation, Vec3d{0, 0, 1}) - Vec3d{-1, 0, 0}), 1e-12);
  EXPECT_LT(length(transformed(tags[0].world_tag, tag_corners(0.1)[0]) - wall.translation), 1e-12);
}

}  // namespace
}  // namespace lightwell
