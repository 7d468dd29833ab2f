// A body is found in pictures, followed from one to the next, and never where it is not.
#include "pose/body_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/pose/body_pictures.hpp"

namespace lightwell {
namespace {

using test::body_at;
using test::BodyCamera;
using test::BodyShot;
using test::camera_rig;
using test::distance_for;
using test::dodecahedron;
using test::error_of;
using test::face_on;
using test::kDegree;
using test::kPi;
using test::shift_of;
using test::turn_of;
using testing::HasSubstr;

ProbeTime at_ms(double ms) { return ProbeTime{static_cast<std::int64_t>(1e6 * ms)}; }

/// A camera and a tracker for it.
struct Stage {
  RigParameters rig;
  MarkerBody body = dodecahedron();
  BodyCamera camera;
  BodyTracker tracker;

  explicit Stage(const RigParameters& with = camera_rig(), const BodyTrackerOptions& options = {})
      : rig(with), camera(rig, body), tracker(std::move(*BodyTracker::make(body, rig, options))) {}

  BodyObservation look(const reference::GreyBytes& picture, double ms) {
    auto sighting = tracker.track(picture.view(), at_ms(ms));
    EXPECT_TRUE(sighting) << sighting.status().message();
    return std::move(*sighting);
  }
};

/// No pose, or a flag, or an answer within its own doubt.
void expect_not_confidently_wrong(const BodyObservation& sighting, const Pose& truth, const char* name) {
  if (!sighting.pose) {
    std::cout << name << ": refused, " << sighting.failure_reason << "\n";
    return;
  }
  const auto e = error_of(sighting.pose->probe_body.pose, truth);
  double largest = 0;
  for (std::size_t i = 0; i < 6; ++i)
    largest = std::max(largest, std::abs(e[i]) / std::sqrt(sighting.pose->probe_body.covariance[i][i]));
  std::cout << name << ": " << sighting.pose->used << " tags, turn off by " << turn_of(e) / kDegree << " deg, place by "
            << 1000 * shift_of(e) << " mm, " << largest << " sigma, RMS " << sighting.pose->rms_px << " px, chi2 "
            << sighting.pose->chi_square << (sighting.pose->ambiguous ? ", flagged" : "") << "\n";
  if (!sighting.pose->ambiguous) {
    EXPECT_LT(largest, 4) << name;
  }
}

TEST(BodyTracker, AStillBodyIsFoundAndThenLookedForWhereItIs) {
  Stage stage;
  double turn = 0, shift = 0;
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    stage.tracker.reset();
    const Pose truth = body_at({0.06, -0.03, -distance_for(400)}, seed);
    for (int i = 0; i < 4; ++i) {
      const auto picture = stage.camera.take(truth, 10 * seed + static_cast<std::uint64_t>(i));
      const BodyObservation sighting = stage.look(picture, 33 * i);
      ASSERT_TRUE(sighting.pose) << sighting.failure_reason;
      EXPECT_EQ(sighting.predicted, i > 0);
      EXPECT_GE(sighting.pose->used, 3);
      EXPECT_FALSE(sighting.pose->ambiguous);
      const auto e = error_of(sighting.pose->probe_body.pose, truth);
      turn = std::max(turn, turn_of(e));
      shift = std::max(shift, shift_of(e));
      for (std::size_t k = 0; k < 6; ++k)
        EXPECT_LT(std::abs(e[k]), 4 * std::sqrt(sighting.pose->probe_body.covariance[k][k])) << seed << " " << k;
      if (i == 0) {
        EXPECT_EQ(sighting.region, (PixelRegion{0, 0, 1280, 960}));
      } else if (i > 1) {
        // The second picture has to be ready for any motion.
        EXPECT_LT(sighting.region.width * sighting.region.height, 1280 * 960 / 3);
      }
    }
  }
  std::cout << "still, 400 px: turn within " << turn / kDegree << " deg, place within "
            << 100 * shift / distance_for(400) << " % of the distance\n";
  EXPECT_LT(turn, 0.2 * kDegree);
  EXPECT_LT(shift, 0.003 * distance_for(400));
}

TEST(BodyTracker, ABodyInMotionIsFollowed) {
  Stage stage(camera_rig(640, 480, 550));
  const Pose start = body_at({-0.12, -0.05, -0.5}, 5);
  constexpr double kFrame = 1.0 / 30;
  double turn = 0, shift = 0;
  int predicted = 0, found = 0;
  constexpr int kFrames = 15;
  for (int i = 0; i < kFrames; ++i) {
    const auto pose_at = [&](double seconds) {
      return Pose{(Quat::about(normalized(Vec3d{1, 2, 0.5}), 90 * kDegree * seconds) * start.rotation).normalized(),
                  start.translation + Vec3d{0.45, 0.2, 0.08} * seconds};
    };
    // Open for 4 ms.
    BodyShot shot;
    shot.probe_body = pose_at(i * kFrame - 0.002);
    shot.closing = pose_at(i * kFrame + 0.002);
    shot.seed = static_cast<std::uint64_t>(i);
    const BodyObservation sighting = stage.look(stage.camera.take(shot), 1000 * i * kFrame);
    predicted += sighting.predicted;
    if (!sighting.pose) continue;
    ++found;
    const auto e = error_of(sighting.pose->probe_body.pose, pose_at(i * kFrame));
    turn = std::max(turn, turn_of(e));
    shift = std::max(shift, shift_of(e));
  }
  std::cout << "0.5 m/s and 90 deg/s: found in " << found << " of " << kFrames << ", turn within " << turn / kDegree
            << " deg, place within " << 1000 * shift << " mm\n";
  EXPECT_EQ(found, kFrames);
  EXPECT_EQ(predicted, kFrames - 1);
  EXPECT_LT(turn, 0.7 * kDegree);
  EXPECT_LT(shift, 0.005);
}

TEST(BodyTracker, ABodyThatWasLostIsFoundAgainElsewhere) {
  BodyTrackerOptions options;
  options.lost_after = 3;
  Stage stage(camera_rig(640, 480, 550), options);
  const Pose left = body_at({-0.12, 0.02, -0.45}, 2), right = body_at({0.13, -0.04, -0.6}, 9),
             behind = body_at({0, 0, 0.5}, 1);
  const auto here = stage.camera.take(left), empty = stage.camera.take(behind), there = stage.camera.take(right);
  EXPECT_TRUE(stage.look(here, 0).pose);
  EXPECT_TRUE(stage.look(here, 33).predicted);
  for (int i = 0; i < 5; ++i) {
    const BodyObservation nothing = stage.look(empty, 66 + 33 * i);
    EXPECT_FALSE(nothing.pose);
    EXPECT_THAT(nothing.failure_reason, HasSubstr("no tag is seen"));
    EXPECT_EQ(nothing.predicted, i == 0) << "the expected part once, then everything";
  }
  const BodyObservation again = stage.look(there, 300);
  ASSERT_TRUE(again.pose) << again.failure_reason;
  EXPECT_FALSE(again.predicted);
  EXPECT_LT(shift_of(error_of(again.pose->probe_body.pose, right)), 0.01);
  EXPECT_TRUE(stage.look(there, 333).predicted);
  // A jump out of the expected part costs one picture.
  EXPECT_FALSE(stage.look(here, 366).pose);
  EXPECT_TRUE(stage.look(here, 400).pose);
  stage.tracker.reset();
  EXPECT_FALSE(stage.look(here, 433).predicted);
  // Time that goes back is a new beginning.
  EXPECT_FALSE(stage.look(here, 0).predicted);
  EXPECT_TRUE(stage.look(here, 33).predicted);
}

TEST(BodyTracker, SizesFromNothingToThePictureAreRightOrRefused) {
  Stage stage;
  for (const double width_px : {20.0, 40.0, 70.0, 120.0, 250.0, 600.0, 900.0}) {
    int found = 0;
    constexpr int kTrials = 3;
    for (int i = 0; i < kTrials; ++i) {
      stage.tracker.reset();
      const Pose truth = body_at({0, 0, -distance_for(width_px)}, 40 + static_cast<std::uint64_t>(i));
      const auto picture = stage.camera.take(truth);
      for (int k = 0; k < 2; ++k) {
        const BodyObservation sighting = stage.look(picture, 33 * k);
        expect_not_confidently_wrong(sighting, truth, (std::to_string(width_px) + " px").c_str());
        if (k == 1) found += sighting.pose.has_value();
      }
    }
    if (width_px <= 20) {
      EXPECT_EQ(found, 0) << "tags of 4 px say nothing";
    } else if (width_px >= 250) {
      EXPECT_EQ(found, kTrials) << width_px;
    }
  }
}

TEST(BodyTracker, PicturesThatAreBadAreRefusedOrRight) {
  Stage stage(camera_rig(640, 480, 550));
  const Pose truth = body_at({0.02, -0.01, -0.3}, 3);
  const auto check = [&](const char* name, auto change) {
    BodyShot shot;
    shot.probe_body = truth;
    change(shot);
    const auto picture = stage.camera.take(shot);
    stage.tracker.reset();
    const BodyObservation sighting = stage.look(picture, 0);
    expect_not_confidently_wrong(sighting, truth, name);
    return sighting;
  };
  EXPECT_TRUE(check("as it should be", [](BodyShot&) {}).pose);
  check("soft by 3 px", [](BodyShot& s) { s.blur_px = 3; });
  EXPECT_FALSE(check("soft by 10 px", [](BodyShot& s) { s.blur_px = 10; }).pose);
  check("moved by 10 px", [&](BodyShot& s) {
    const double shift = 10.0 / 550 * 0.3;
    s.probe_body.translation.x -= shift / 2;
    s.closing = truth;
    s.closing->translation.x += shift / 2;
  });
  check("a twentieth of the exposure", [](BodyShot& s) { s.exposure = 0.05, s.electrons = 10'000; });
  check("a hundredth", [](BodyShot& s) { s.exposure = 0.01; });
  check("noise of 10 %", [](BodyShot& s) { s.electrons = 300, s.read_noise_electrons = 25; });
  check("ten times too bright", [](BodyShot& s) { s.exposure = 10; });
  EXPECT_FALSE(check("in a mirror", [](BodyShot& s) { s.mirrored = true; }).pose);
}

TEST(BodyTracker, AHalfCoveredTagIsLeftOutOrHarmless) {
  Stage stage(camera_rig(640, 480, 550));
  int covered = 0;
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const Pose truth = body_at({0, 0, -0.3}, seed);
    // In front of one half of the tag that is nearest to the camera.
    const auto nearest =
        std::min_element(stage.body.faces.begin(), stage.body.faces.end(), [&](const auto& a, const auto& b) {
          return length(transformed(truth, a.body_face.translation)) <
                 length(transformed(truth, b.body_face.translation));
        });
    BodyShot shot;
    shot.probe_body = truth;
    shot.cover = reference::SphereOccluder{
        transformed(compose(truth, nearest->body_face), {0.012, 0.004, 0.02}), 0.012, {0.3, 0.3, 0.3}};
    stage.tracker.reset();
    const auto picture = stage.camera.take(shot);
    const BodyObservation sighting = stage.look(picture, 0);
    ASSERT_TRUE(sighting.pose) << sighting.failure_reason;
    expect_not_confidently_wrong(sighting, truth, "half covered");
    EXPECT_LT(turn_of(error_of(sighting.pose->probe_body.pose, truth)), 0.5 * kDegree);
    covered += std::none_of(sighting.pose->tags.begin(), sighting.pose->tags.end(),
                            [&](const TagReport& use) { return use.id == nearest->tag_id && use.used; });
  }
  EXPECT_GE(covered, 4) << "otherwise nothing was covered";
}

TEST(BodyTracker, ACalibrationWrongByTwoPercentIsNotConfidentlyWrong) {
  const RigParameters real = camera_rig();
  const BodyCamera camera(real, dodecahedron());
  auto tracker = BodyTracker::make(dodecahedron(), camera_rig(1280, 960, 1100 * 1.02));
  ASSERT_TRUE(tracker);
  for (const double width_px : {200.0, 400.0, 600.0}) {
    const Pose truth = body_at({0.04, 0.02, -distance_for(width_px)}, 6);
    const auto sighting = tracker->track(camera.take(truth).view(), at_ms(0));
    ASSERT_TRUE(sighting);
    ASSERT_TRUE(sighting->pose);
    expect_not_confidently_wrong(*sighting, truth, "focal length 2 % too long");
    std::cout << "  the corners say " << 100 * sighting->pose->focal.excess << " +- "
              << 100 * sighting->pose->focal.sigma << " %\n";
    tracker->reset();
  }
}

TEST(BodyTracker, InputThatCannotBeIsRefused) {
  const MarkerBody body = dodecahedron();
  const RigParameters rig = camera_rig(640, 480, 550);
  auto tracker = BodyTracker::make(body, rig);
  ASSERT_TRUE(tracker);
  const std::vector<std::uint8_t> bytes(640 * 480, 100);
  const GreyPicture good{bytes, 640, 480, 640};
  EXPECT_TRUE(tracker->track(good, at_ms(0)));
  EXPECT_THAT(tracker->track(good, at_ms(0), 1).status().message(), HasSubstr("no lens 1"));
  EXPECT_THAT(tracker->track(good, at_ms(0), -1).status().message(), HasSubstr("no lens -1"));
  EXPECT_THAT(tracker->track({bytes, 480, 640, 480}, at_ms(0)).status().message(),
              HasSubstr("calibration is for 640x480"));
  EXPECT_THAT(tracker->track({std::span(bytes).first(1000), 640, 480, 640}, at_ms(0)).status().message(),
              HasSubstr("bytes"));
  const auto asking = [&](auto change) {
    BodyTrackerOptions options;
    change(options);
    return BodyTracker::make(body, rig, options).status().message();
  };
  EXPECT_THAT(asking([](auto& o) { o.search_decimate = 0; }), HasSubstr("search_decimate"));
  EXPECT_THAT(asking([](auto& o) { o.decimate = 0.5; }), HasSubstr("decimate"));
  EXPECT_THAT(asking([](auto& o) { o.lost_after = 0; }), HasSubstr("lost_after"));
  EXPECT_THAT(asking([](auto& o) { o.pose.focal_sigma = -1; }), HasSubstr("focal_sigma"));
  EXPECT_THAT(asking([](auto& o) { o.motion.acceleration_sigma_m_per_s2 = 0; }), HasSubstr("acceleration_sigma_m_per_s2"));
  EXPECT_THAT(asking([](auto& o) { o.linear = {0, 1}; }), HasSubstr("linear"));
  MarkerBody none = body;
  none.faces.clear();
  EXPECT_FALSE(BodyTracker::make(none, rig));
  RigParameters blind = rig;
  blind.lenses.clear();
  EXPECT_FALSE(BodyTracker::make(body, blind));
}

TEST(TagDetector, APartOfAPictureHasTheSameTagsInTheSamePlaces) {
  Stage stage(camera_rig(640, 480, 550));
  const auto picture = stage.camera.take(body_at({0.02, 0.03, -0.3}, 1));
  auto detector = TagDetector::make();
  ASSERT_TRUE(detector);
  const auto whole = detector->detect(picture.view());
  ASSERT_TRUE(whole);
  ASSERT_GE(whole->size(), 3u);
  double left = 640, top = 480, right = 0, bottom = 0;
  for (const TagDetection& tag : *whole)
    for (const PixelPosition p : tag.corners) {
      left = std::min(left, p.x);
      right = std::max(right, p.x);
      top = std::min(top, p.y);
      bottom = std::max(bottom, p.y);
    }
  const PixelRegion around{static_cast<int>(left) - 11, static_cast<int>(top) - 11, static_cast<int>(right - left) + 22,
                           static_cast<int>(bottom - top) + 22};
  ASSERT_GT(around.x, 50);
  const auto part = detector->detect_in(picture.view(), {around});
  ASSERT_TRUE(part);
  ASSERT_EQ(part->size(), whole->size());
  for (std::size_t i = 0; i < whole->size(); ++i) {
    EXPECT_EQ((*part)[i].id, (*whole)[i].id);
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_NEAR((*part)[i].corners[k].x, (*whole)[i].corners[k].x, 0.05);
      EXPECT_NEAR((*part)[i].corners[k].y, (*whole)[i].corners[k].y, 0.05);
    }
  }
  // What reaches beyond the picture is cut, what lies beyond shows nothing.
  EXPECT_EQ(detector->detect_in(picture.view(), {{-100, -100, 2'000'000'000, 2'000'000'000}})->size(), whole->size());
  for (const PixelRegion& region : {PixelRegion{640, 0, 10, 10}, PixelRegion{-20, 0, 20, 480}, PixelRegion{0, 0, 0, 0},
                                    PixelRegion{10, 10, -5, 20}, PixelRegion{0, 0, 5, 5}})
    EXPECT_TRUE(detector->detect_in(picture.view(), {region})->empty());
  EXPECT_FALSE(detector->detect_in(picture.view(), {{0, 0, 640, 480}, 0.5}));
}

}  // namespace
}  // namespace lightwell
