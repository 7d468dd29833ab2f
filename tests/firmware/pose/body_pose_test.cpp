// find_body_pose: accuracy, consistency of the covariance, outlier tags, ambiguity, predictions.
#include <cmath>
#include <iostream>
#include <limits>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/pose/bodies_in_view.hpp"
#include "firmware/pose/normalized_error.hpp"
#include "pose/body_tracker.hpp"

namespace lightwell {
namespace {

using test::body_at;
using test::camera_rig;
using test::distance_for;
using test::dodecahedron;
using test::error_of;
using test::face_on;
using test::kDegree;
using test::normalized_error;
using test::shift_of;
using test::simulate_body_observations;
using test::turn_of;
using test::with_build_errors;
using testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

BodyPoseOptions exact_camera() {
  BodyPoseOptions options;
  options.model_error_px = 0;
  options.focal_sigma = 0;
  options.face_turn_sigma_rad = options.face_shift_sigma_m = 0;
  return options;
}

bool within_three_sigma(const UncertainPose& found, const Pose& truth) {
  const auto e = error_of(found.pose, truth);
  for (std::size_t i = 0; i < 6; ++i)
    if (!(std::abs(e[i]) <= 3 * std::sqrt(found.covariance[i][i]))) return false;
  return true;
}

std::string refusal(const Result<BodyPose>& result) {
  EXPECT_FALSE(result);
  return result.ok() ? "accepted" : result.status().message();
}

TEST(BodyPose, ExactCornersGiveTheExactPose) {
  const RigParameters rig = camera_rig();
  const MarkerBody body = dodecahedron();
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Pose truth = body_at({0.05, -0.03, -0.4}, seed);
    const auto seen = simulate_body_observations(rig, body, truth, 0, 1);
    ASSERT_GE(seen.size(), 3u);
    const auto pose = find_body_pose(rig, body, seen);
    ASSERT_TRUE(pose) << pose.status().message();
    const auto e = error_of(pose->probe_body.pose, truth);
    EXPECT_LT(turn_of(e), 1e-5) << seed;
    EXPECT_LT(shift_of(e), 1e-6) << seed;
    EXPECT_FALSE(pose->ambiguous) << seed;
    EXPECT_EQ(pose->used, static_cast<int>(seen.size()));
    for (const TagReport& report : pose->tags) EXPECT_TRUE(report.used && report.rejection_reason.empty());
  }
}

struct Trials {
  std::array<int, 6> within{};
  int count = 0, ambiguous = 0;
  double normalized = 0, turn = 0, shift = 0;
};

/// A hundred random attitudes; the relative focal length error of each is Gaussian with standard deviation `focal`.
Trials trials(double distance_m, double sigma_px, double focal, const BodyPoseOptions& options, const char* name) {
  const RigParameters calibrated = camera_rig();
  const MarkerBody body = dodecahedron();
  Trials out;
  std::mt19937_64 random(99);
  std::normal_distribution<double> normal;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    const Pose truth = body_at({0.04, 0.02, -distance_m}, 500 + seed);
    const RigParameters real = camera_rig(1280, 960, 1100 / (1 + focal * normal(random)));
    const auto pose = find_body_pose(calibrated, body, simulate_body_observations(real, body, truth, sigma_px, seed),
                                     std::nullopt, options);
    EXPECT_TRUE(pose) << pose.status().message();
    if (!pose) continue;
    const auto e = error_of(pose->probe_body.pose, truth);
    ++out.count;
    out.ambiguous += pose->ambiguous;
    out.normalized += normalized_error(e, pose->probe_body.covariance);
    out.turn = std::max(out.turn, turn_of(e));
    out.shift = std::max(out.shift, shift_of(e));
    for (std::size_t i = 0; i < 6; ++i)
      out.within[i] += std::abs(e[i]) <= 3 * std::sqrt(pose->probe_body.covariance[i][i]);
  }
  out.normalized /= out.count;
  std::cout << name << ": within 3 sigma";
  for (const int n : out.within) std::cout << " " << n;
  std::cout << " of " << out.count << ", mean e'C^-1 e / 6 " << out.normalized << ", worst turn " << out.turn / kDegree
            << " deg, worst place " << 100 * out.shift / distance_m << " % of the distance, ambiguous " << out.ambiguous
            << "\n";
  return out;
}

TEST(BodyPose, ErrorsAreConsistentWithTheCovariance) {
  for (const auto& [width_px, sigma_px] : {std::pair(400.0, 0.2), std::pair(400.0, 1.0), std::pair(120.0, 0.2)}) {
    const Trials t = trials(distance_for(width_px), sigma_px, 0, exact_camera(), "camera known");
    EXPECT_EQ(t.count, 100);
    for (const int n : t.within) EXPECT_GE(n, 95) << width_px;
    EXPECT_GT(t.normalized, 0.7);
    // Below 1 on average, because the reduced chi² scales the covariance only where it is above one.
    EXPECT_LT(t.normalized, 1.3);
  }
}

TEST(BodyPose, FocalSigmaIsPartOfTheCovariance) {
  BodyPoseOptions options = exact_camera();
  options.focal_sigma = 0.02;
  const Trials t = trials(distance_for(250), 0.2, 0.02, options, "focal length to 2 %");
  for (const int n : t.within) EXPECT_GE(n, 95);
  EXPECT_LT(t.normalized, 1.6);
  EXPECT_GT(t.normalized, 0.6);
  // Without the option the covariance of the same camera is too small.
  const Trials without = trials(distance_for(250), 0.2, 0.02, exact_camera(), "the same with focal_sigma 0");
  EXPECT_GT(without.normalized, 10);
}

TEST(BodyPose, DefaultCovarianceCoversATwoPercentFocalLengthError) {
  const RigParameters calibrated = camera_rig(1280, 960, 1100 * 1.02), real = camera_rig();
  const MarkerBody body = dodecahedron();
  for (const double width_px : {100.0, 250.0, 400.0, 700.0}) {
    int within = 0;
    double rms = 0, turn = 0;
    for (std::uint64_t seed = 0; seed < 50; ++seed) {
      const Pose truth = body_at({0.03, 0, -distance_for(width_px)}, seed);
      const auto pose = find_body_pose(calibrated, body, simulate_body_observations(real, body, truth, 0.1, seed));
      ASSERT_TRUE(pose) << pose.status().message();
      within += within_three_sigma(pose->probe_body, truth);
      turn = std::max(turn, turn_of(error_of(pose->probe_body.pose, truth)));
      rms += pose->rms_px / 50;
    }
    EXPECT_GE(within, 48) << width_px;
    std::cout << width_px << " px wide, focal length 2 % too long: " << within << " of 50 within 3 sigma, RMS " << rms
              << " px, worst turn " << turn / kDegree << " deg\n";
  }
}

/// Expects a correct pose, and that the one tag with the id `bad` is rejected for the reason `why`.
void expect_rejected(const RigParameters& rig, const MarkerBody& body, const std::vector<TagObservation>& seen,
                     const Pose& truth, int bad, const char* why) {
  const auto pose = find_body_pose(rig, body, seen, std::nullopt, exact_camera());
  ASSERT_TRUE(pose) << pose.status().message();
  const auto e = error_of(pose->probe_body.pose, truth);
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_LT(std::abs(e[i]), 5 * std::sqrt(pose->probe_body.covariance[i][i])) << why << " " << i;
  EXPECT_LT(turn_of(e), 0.5 * kDegree) << why;
  ASSERT_EQ(pose->tags.size(), seen.size());
  int rejected = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const TagReport& report = pose->tags[i];
    EXPECT_EQ(report.id, seen[i].tag.id);
    EXPECT_EQ(report.used, report.rejection_reason.empty());
    if (report.used) continue;
    ++rejected;
    EXPECT_EQ(report.id, bad);
    EXPECT_THAT(report.rejection_reason, HasSubstr(why));
  }
  EXPECT_EQ(rejected, 1) << why;
}

TEST(BodyPose, AnOutlierTagIsRejectedWithItsReason) {
  const RigParameters rig = camera_rig();
  const MarkerBody body = dodecahedron();
  int tried = 0;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const Pose truth = body_at({0.02, 0.01, -0.4}, seed);
    const auto seen = simulate_body_observations(rig, body, truth, 0.15, seed);
    if (seen.size() < 4) continue;
    ++tried;
    const int id = seen[1].tag.id;
    const auto with = [&](auto change, int bad, const char* why) {
      auto other = seen;
      change(other);
      expect_rejected(rig, body, other, truth, bad, why);
    };
    with([](auto& s) { s[1].tag.id = 77; }, 77, "not one of the body's");
    with([](auto& s) { s[1].tag.family = TagFamily::tagStandard41h12; }, id, "not one of the body's");
    with(
        [](auto& s) {
          std::swap(s[1].tag.corners[0], s[1].tag.corners[1]), std::swap(s[1].tag.corners[2], s[1].tag.corners[3]);
        },
        id, "mirror");
    // The id of a face that is turned away.
    int hidden = 0;
    for (int n = 0; n < 12; ++n)
      if (std::none_of(seen.begin(), seen.end(), [&](const TagObservation& s) { return s.tag.id == n; })) hidden = n;
    with([&](auto& s) { s[1].tag.id = hidden; }, hidden, "");
    // Rotated by 90 degrees.
    with([](auto& s) { std::rotate(s[1].tag.corners.begin(), s[1].tag.corners.begin() + 1, s[1].tag.corners.end()); },
         id, "contradicts the others");
    // Half occluded: two corners lie on the occluder's edge.
    with(
        [](auto& s) {
          auto& c = s[1].tag.corners;
          c[1] = {(c[0].x + c[1].x) / 2, (c[0].y + c[1].y) / 2};
          c[2] = {(c[2].x + c[3].x) / 2, (c[2].y + c[3].y) / 2};
        },
        id, "contradicts the others");
    // The same id on another body beside it.
    with(
        [&](auto& s) {
          TagObservation twin = s[1];
          for (PixelPosition& p : twin.tag.corners) p.x += 300;
          s.push_back(twin);
        },
        id, "contradicts the others");
  }
  EXPECT_GE(tried, 5);
}

// Two faces that are folded 1 degree and 0.5 mm off and seen from near are no contradiction; with exact faces they
// would be.
TEST(BodyPose, FoldedFacesSeenFromNearAgree) {
  const RigParameters rig = camera_rig();
  const MarkerBody body = dodecahedron();
  int tried = 0, contradicted = 0;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const Pose truth = body_at({0, 0, -0.2}, seed);
    auto seen = simulate_body_observations(rig, with_build_errors(body, {kDegree, 0.5e-3}, seed), truth, 0.05, seed);
    if (seen.size() < 2) continue;
    seen.resize(2);
    ++tried;
    const auto found = find_body_pose(rig, body, seen);
    ASSERT_TRUE(found) << found.status().message();
    EXPECT_EQ(found->used, 2) << seed;
    const auto exact = find_body_pose(rig, body, seen, std::nullopt, exact_camera());
    contradicted += !exact || exact->used < 2 ? 1 : 0;
  }
  EXPECT_GE(tried, 5);
  EXPECT_GE(contradicted, 1) << "no case tests the errors of faces";
}

TEST(BodyPose, OneDisplacedCornerHasLittleInfluence) {
  const RigParameters rig = camera_rig();
  const MarkerBody body = dodecahedron();
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const Pose truth = body_at({0, 0, -0.4}, seed);
    auto seen = simulate_body_observations(rig, body, truth, 0.15, seed);
    ASSERT_GE(seen.size(), 3u);
    seen[0].tag.corners[2].x += 1.2;
    const auto pose = find_body_pose(rig, body, seen, std::nullopt, exact_camera());
    ASSERT_TRUE(pose);
    EXPECT_LT(turn_of(error_of(pose->probe_body.pose, truth)), 0.5 * kDegree);
    EXPECT_TRUE(within_three_sigma(pose->probe_body, truth) || pose->chi_square > 1.5) << seed;
  }
}

TEST(BodyPose, ASingleDistantFaceIsFlaggedAmbiguous) {
  const RigParameters rig = camera_rig();
  const MarkerBody body = dodecahedron();
  int ambiguous = 0, near_either = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Pose truth = face_on(1.2, 0.25);
    auto seen = simulate_body_observations(rig, body, truth, 0.2, seed);
    std::erase_if(seen, [](const TagObservation& s) { return s.tag.id != 0; });
    ASSERT_EQ(seen.size(), 1u);
    const auto pose = find_body_pose(rig, body, seen);
    ASSERT_TRUE(pose) << pose.status().message();
    EXPECT_EQ(pose->used, 1);
    if (!pose->ambiguous) continue;
    ++ambiguous;
    ASSERT_TRUE(pose->alternative);
    const double a = turn_of(error_of(pose->probe_body.pose, truth)), b = turn_of(error_of(*pose->alternative, truth));
    near_either += std::min(a, b) < 0.15;
    // The true pose as a prediction resolves the ambiguity, except if its attitude was ambiguous itself.
    BodyPrediction before{{truth, {}}, true};
    for (std::size_t i = 0; i < 6; ++i) before.probe_body.covariance[i][i] = i < 3 ? 0.003 : 1e-3;
    const auto settled = find_body_pose(rig, body, seen, before);
    ASSERT_TRUE(settled);
    if (angle_between(rotate(pose->alternative->rotation, Vec3d{0, 1, 0}),
                      rotate(pose->probe_body.pose.rotation, Vec3d{0, 1, 0})) > 0.45) {
      EXPECT_FALSE(settled->ambiguous) << seed;
      EXPECT_LT(turn_of(error_of(settled->probe_body.pose, truth)), 0.2) << seed;
    }
    before.attitude_known = false;
    EXPECT_TRUE(find_body_pose(rig, body, seen, before)->ambiguous);
  }
  EXPECT_GE(ambiguous, 16);
  EXPECT_GE(near_either, ambiguous - 1);
  // For a near, tilted face the perspective resolves the ambiguity.
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Pose truth = face_on(0.15, 0.6);
    auto seen = simulate_body_observations(rig, body, truth, 0.1, seed);
    std::erase_if(seen, [](const TagObservation& s) { return s.tag.id != 0; });
    ASSERT_EQ(seen.size(), 1u);
    const auto pose = find_body_pose(rig, body, seen);
    ASSERT_TRUE(pose);
    EXPECT_FALSE(pose->ambiguous) << seed;
    EXPECT_TRUE(within_three_sigma(pose->probe_body, truth)) << seed;
  }
}

TEST(BodyPose, PosesThatAreNotFlaggedAreWithinFiveSigma) {
  const RigParameters rig = camera_rig();
  const MarkerBody body = dodecahedron();
  int flagged = 0, wrong = 0, count = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const Pose truth = body_at({0.1, -0.05, -1.5}, seed);
    auto seen = simulate_body_observations(rig, body, truth, 0.4, seed);
    if (seen.size() > 1 + seed % 2) seen.resize(1 + seed % 2);
    if (seen.empty()) continue;
    const auto pose = find_body_pose(rig, body, seen);
    if (!pose) continue;
    ++count;
    flagged += pose->ambiguous;
    const auto e = error_of(pose->probe_body.pose, truth);
    double largest = 0;
    for (std::size_t i = 0; i < 6; ++i)
      largest = std::max(largest, std::abs(e[i]) / std::sqrt(pose->probe_body.covariance[i][i]));
    wrong += !pose->ambiguous && largest > 5;
  }
  std::cout << "one or two tags of 17 px: " << flagged << " of " << count << " flagged, confidently wrong " << wrong
            << "\n";
  EXPECT_GT(count, 180);
  EXPECT_GT(flagged, 40);
  EXPECT_LE(wrong, 1);
}

TEST(BodyPose, ThePredictionSelectsOneOfTwoBodiesWithTheSameIds) {
  const RigParameters rig = camera_rig();
  const MarkerBody body = dodecahedron();
  const Pose left = body_at({-0.1, 0, -0.5}, 3), right = body_at({0.12, 0, -0.5}, 3);
  auto seen = simulate_body_observations(rig, body, left, 0.1, 1),
       others = simulate_body_observations(rig, body, right, 0.1, 2);
  const std::size_t own = std::min(seen.size(), others.size());
  ASSERT_GE(own, 3u);
  seen.resize(own);
  seen.insert(seen.end(), others.begin(), others.begin() + static_cast<std::ptrdiff_t>(own));
  EXPECT_THAT(refusal(find_body_pose(rig, body, seen)), HasSubstr("contradict each other"));
  for (const Pose& expected : {left, right}) {
    BodyPrediction before{{expected, {}}, true};
    before.probe_body.pose.translation.x += 0.01;
    for (std::size_t i = 0; i < 6; ++i) before.probe_body.covariance[i][i] = i < 3 ? 0.01 : 1e-4;
    const auto pose = find_body_pose(rig, body, seen, before);
    ASSERT_TRUE(pose) << pose.status().message();
    EXPECT_TRUE(within_three_sigma(pose->probe_body, expected));
    EXPECT_EQ(pose->used, static_cast<int>(own));
  }
}

TEST(BodyPose, AWrongPredictionDoesNotChangeTheResult) {
  const RigParameters rig = camera_rig();
  const MarkerBody body = dodecahedron();
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const Pose truth = body_at({0.02, 0.01, -0.45}, seed);
    BodyPrediction before{{body_at({-0.1, 0.05, -0.7}, 1000 + seed), {}}, true};
    for (std::size_t i = 0; i < 6; ++i) before.probe_body.covariance[i][i] = 1e-4;
    const auto pose =
        find_body_pose(rig, body, simulate_body_observations(rig, body, truth, 0.1, seed), before, exact_camera());
    ASSERT_TRUE(pose) << pose.status().message();
    EXPECT_LT(turn_of(error_of(pose->probe_body.pose, truth)), 0.5 * kDegree) << seed;
  }
}

// After a second without a picture the extrapolated motion is metres off, and anything is within its covariance.
TEST(BodyPose, AnUncertainPredictionDoesNotChangeTheResult) {
  const RigParameters rig = camera_rig();
  const MarkerBody body = dodecahedron();
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const Pose truth = body_at({0.02, 0.01, -0.45}, seed);
    for (const Vec3d place : {Vec3d{-0.7, -3.5, -40}, Vec3d{0.5, 0.3, -0.1}, Vec3d{0, 0, 2}, Vec3d{3, 0, -0.5}}) {
      BodyPrediction before{{body_at(place, 1000 + seed), {}}, true};
      for (std::size_t i = 0; i < 6; ++i) before.probe_body.covariance[i][i] = i < 3 ? 400 : 1000;
      const auto pose =
          find_body_pose(rig, body, simulate_body_observations(rig, body, truth, 0.1, seed), before, exact_camera());
      ASSERT_TRUE(pose) << pose.status().message();
      EXPECT_LT(turn_of(error_of(pose->probe_body.pose, truth)), 0.5 * kDegree) << seed << ", from " << place.z;
      EXPECT_LT(length(pose->probe_body.pose.translation - truth.translation), 0.005) << seed << ", from " << place.z;
    }
  }
}

TEST(BodyPose, UsesBothLensesOfAPair) {
  RigParameters pair = camera_rig();
  pair.lenses.push_back(pair.lenses[0]);
  pair.lenses[0].pose_cv.translation = {-0.06, 0, 0};
  pair.lenses[1].pose_cv.translation = {0.06, 0, 0};
  const MarkerBody body = dodecahedron();
  const Pose truth = body_at({0, 0, -0.6}, 4);
  const auto seen = simulate_body_observations(pair, body, truth, 0.15, 1);
  std::vector<TagObservation> one;
  for (const TagObservation& s : seen)
    if (s.lens == 0) one.push_back(s);
  ASSERT_LT(one.size(), seen.size());
  const auto both = find_body_pose(pair, body, seen, std::nullopt, exact_camera()),
             alone = find_body_pose(pair, body, one, std::nullopt, exact_camera());
  ASSERT_TRUE(both && alone);
  EXPECT_TRUE(within_three_sigma(both->probe_body, truth));
  EXPECT_LT(both->probe_body.covariance[5][5], 0.6 * alone->probe_body.covariance[5][5]);
}

TEST(BodyPose, RejectsInputThatDeterminesNoPose) {
  const RigParameters rig = camera_rig();
  const MarkerBody body = dodecahedron();
  const auto good = simulate_body_observations(rig, body, body_at({0, 0, -0.4}, 1), 0.1, 1);
  ASSERT_GE(good.size(), 3u);
  EXPECT_THAT(refusal(find_body_pose(rig, body, {})), HasSubstr("no tag is seen"));
  EXPECT_EQ(find_body_pose(rig, body, {}).status().code(), StatusCode::not_found);
  auto foreign = good;
  for (TagObservation& s : foreign) s.tag.id += 100;
  EXPECT_THAT(refusal(find_body_pose(rig, body, foreign)), HasSubstr("none of the"));
  auto edge = good;
  for (TagObservation& s : edge)
    for (std::size_t k = 0; k < 4; ++k) s.tag.corners[k] = {500 + 20.0 * static_cast<double>(k), 479.5};
  EXPECT_THAT(refusal(find_body_pose(rig, body, edge)), HasSubstr("lie in a line"));
  EXPECT_EQ(find_body_pose(rig, body, edge).status().code(), StatusCode::not_found);
  const auto with = [&](auto change) {
    auto seen = good;
    change(seen[1]);
    const auto pose = find_body_pose(rig, body, seen);
    EXPECT_EQ(pose.status().code(), StatusCode::invalid_argument);
    return refusal(pose);
  };
  EXPECT_THAT(with([](TagObservation& s) { s.tag.corners[1].x = kNan; }), HasSubstr("corner 1 is not a number"));
  EXPECT_THAT(with([](TagObservation& s) { s.tag.covariance[3].xx = kNan; }), HasSubstr("corner 3's covariance"));
  EXPECT_THAT(with([](TagObservation& s) { s.lens = 1; }), HasSubstr("the rig has 1 lenses"));
  EXPECT_THAT(with([](TagObservation& s) { s.lens = -1; }), HasSubstr("the rig has 1 lenses"));
  // Two that contradict each other.
  std::vector<TagObservation> two = {good[0], good[1]};
  std::rotate(two[1].tag.corners.begin(), two[1].tag.corners.begin() + 1, two[1].tag.corners.end());
  EXPECT_THAT(refusal(find_body_pose(rig, body, two)), HasSubstr("contradict each other"));
  MarkerBody unknown = body;
  unknown.tag_family = "tag16h5";
  EXPECT_THAT(refusal(find_body_pose(rig, unknown, good)), HasSubstr("family"));
  const auto asking = [&](auto change) {
    BodyPoseOptions o;
    change(o);
    return refusal(find_body_pose(rig, body, good, std::nullopt, o));
  };
  EXPECT_THAT(asking([](auto& o) { o.model_error_px = -1; }), HasSubstr("model_error_px"));
  EXPECT_THAT(asking([](auto& o) { o.focal_sigma = kNan; }), HasSubstr("focal_sigma"));
}

}  // namespace
}  // namespace lightwell
