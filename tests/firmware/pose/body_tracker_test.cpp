// BodyTracker: detection and tracking of a body in rendered pictures; no wrong pose without a flag.
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

/// A simulated camera and a tracker with its calibration.
struct TrackerFixture {
  RigParameters rig;
  MarkerBody body = dodecahedron();
  BodyCamera camera;
  BodyTracker tracker;

  explicit TrackerFixture(const RigParameters& with = camera_rig(), const BodyTrackerOptions& options = {})
      : rig(with), camera(rig, body), tracker(std::move(*BodyTracker::make(body, rig, options))) {}

  BodyObservation track(const reference::GreyBytes& picture, double ms) {
    auto observation = tracker.track(picture.view(), at_ms(ms));
    EXPECT_TRUE(observation) << observation.status().message();
    return std::move(*observation);
  }
};

/// Expects no pose, or a pose flagged as ambiguous, or an error within 4 sigma of the estimated covariance.
void expect_consistent_or_flagged(const BodyObservation& observation, const Pose& truth, const char* name) {
  if (!observation.pose) {
    std::cout << name << ": refused, " << observation.failure_reason << "\n";
    return;
  }
  const auto e = error_of(observation.pose->probe_body.pose, truth);
  double largest = 0;
  for (std::size_t i = 0; i < 6; ++i)
    largest = std::max(largest, std::abs(e[i]) / std::sqrt(observation.pose->probe_body.covariance[i][i]));
  std::cout << name << ": " << observation.pose->used << " tags, turn off by " << turn_of(e) / kDegree
            << " deg, place by " << 1000 * shift_of(e) << " mm, " << largest << " sigma, RMS "
            << observation.pose->rms_px << " px, chi2 " << observation.pose->chi_square
            << (observation.pose->ambiguous ? ", flagged" : "") << "\n";
  if (!observation.pose->ambiguous) {
    EXPECT_LT(largest, 4) << name;
  }
}

/// Width of a body whose tags have cells of less than 2 px.
constexpr double kSmall_px = 72;

TEST(BodyTracker, FindsAStationaryBodyThenSearchesThePredictedRegion) {
  TrackerFixture fixture;
  double turn = 0, shift = 0;
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    fixture.tracker.reset();
    const Pose truth = body_at({0.06, -0.03, -distance_for(400)}, seed);
    for (int i = 0; i < 4; ++i) {
      const auto picture = fixture.camera.take(truth, 10 * seed + static_cast<std::uint64_t>(i));
      const BodyObservation observation = fixture.track(picture, 33 * i);
      ASSERT_TRUE(observation.pose) << observation.failure_reason;
      EXPECT_EQ(observation.predicted, i > 0);
      EXPECT_GE(observation.pose->used, 3);
      EXPECT_FALSE(observation.pose->ambiguous);
      const auto e = error_of(observation.pose->probe_body.pose, truth);
      turn = std::max(turn, turn_of(e));
      shift = std::max(shift, shift_of(e));
      for (std::size_t k = 0; k < 6; ++k)
        EXPECT_LT(std::abs(e[k]), 4 * std::sqrt(observation.pose->probe_body.covariance[k][k])) << seed << " " << k;
      if (i == 0) {
        EXPECT_EQ(observation.region, (PixelRegion{0, 0, 1280, 960}));
      } else if (i > 1) {
        // In the second picture the velocity is unknown, so the region may be the whole picture.
        EXPECT_LT(observation.region.width * observation.region.height, 1280 * 960 / 3);
      }
    }
  }
  std::cout << "still, 400 px: turn within " << turn / kDegree << " deg, place within "
            << 100 * shift / distance_for(400) << " % of the distance\n";
  EXPECT_LT(turn, 0.2 * kDegree);
  EXPECT_LT(shift, 0.003 * distance_for(400));
}

TEST(BodyTracker, TracksAMovingBody) {
  TrackerFixture fixture(camera_rig(640, 480, 550));
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
    // Exposure of 4 ms.
    BodyShot shot;
    shot.probe_body = pose_at(i * kFrame - 0.002);
    shot.closing_pose = pose_at(i * kFrame + 0.002);
    shot.seed = static_cast<std::uint64_t>(i);
    const BodyObservation observation = fixture.track(fixture.camera.take(shot), 1000 * i * kFrame);
    predicted += observation.predicted;
    if (!observation.pose) continue;
    ++found;
    const auto e = error_of(observation.pose->probe_body.pose, pose_at(i * kFrame));
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

TEST(BodyTracker, FindsALostBodyAgainElsewhere) {
  BodyTrackerOptions options;
  options.lost_after = 3;
  TrackerFixture fixture(camera_rig(640, 480, 550), options);
  const Pose left = body_at({-0.12, 0.02, -0.45}, 2), right = body_at({0.13, -0.04, -0.6}, 9),
             behind = body_at({0, 0, 0.5}, 1);
  const auto here = fixture.camera.take(left), empty = fixture.camera.take(behind), there = fixture.camera.take(right);
  EXPECT_TRUE(fixture.track(here, 0).pose);
  EXPECT_TRUE(fixture.track(here, 33).predicted);
  for (int i = 0; i < 5; ++i) {
    const BodyObservation nothing = fixture.track(empty, 66 + 33 * i);
    EXPECT_FALSE(nothing.pose);
    EXPECT_THAT(nothing.failure_reason, HasSubstr("no tag is seen"));
    EXPECT_EQ(nothing.predicted, i == 0) << "only the first picture after the loss is searched by prediction";
  }
  const BodyObservation again = fixture.track(there, 300);
  ASSERT_TRUE(again.pose) << again.failure_reason;
  EXPECT_FALSE(again.predicted);
  EXPECT_LT(shift_of(error_of(again.pose->probe_body.pose, right)), 0.01);
  EXPECT_TRUE(fixture.track(there, 333).predicted);
  // A jump out of the predicted region costs one picture.
  EXPECT_FALSE(fixture.track(here, 366).pose);
  EXPECT_TRUE(fixture.track(here, 400).pose);
  fixture.tracker.reset();
  EXPECT_FALSE(fixture.track(here, 433).predicted);
  // A time before the last one restarts the tracker.
  EXPECT_FALSE(fixture.track(here, 0).predicted);
  EXPECT_TRUE(fixture.track(here, 33).predicted);
}

TEST(BodyTracker, EachApparentSizeIsEstimatedCorrectlyOrRejected) {
  TrackerFixture fixture;
  for (const double width_px : {20.0, 40.0, 70.0, 120.0, 250.0, 600.0, 900.0}) {
    int found = 0;
    constexpr int kTrials = 3;
    for (int i = 0; i < kTrials; ++i) {
      fixture.tracker.reset();
      const Pose truth = body_at({0, 0, -distance_for(width_px)}, 40 + static_cast<std::uint64_t>(i));
      const auto picture = fixture.camera.take(truth);
      for (int k = 0; k < 2; ++k) {
        const BodyObservation observation = fixture.track(picture, 33 * k);
        expect_consistent_or_flagged(observation, truth, (std::to_string(width_px) + " px").c_str());
        if (k == 1) found += observation.pose.has_value();
      }
    }
    if (width_px <= 20) {
      EXPECT_EQ(found, 0) << "tags of 4 px cannot be detected";
    } else if (width_px >= 250) {
      EXPECT_EQ(found, kTrials) << width_px;
    }
  }
}

TEST(BodyTracker, TagsOfTwoPixelsACellAreFoundInTheEnlargedPicture) {
  TrackerFixture fixture;
  auto detector = TagDetector::make();
  ASSERT_TRUE(detector);
  std::size_t tags = 0, as_it_is = 0;
  constexpr int kTrials = 8;
  for (std::uint64_t i = 0; i < kTrials; ++i) {
    fixture.tracker.reset();
    const Pose truth = body_at({0.02, 0.01, -distance_for(kSmall_px)}, 60 + i);
    const auto picture = fixture.camera.take(truth, i);
    as_it_is += detector->detect_in(picture.view(), {{0, 0, 1280, 960}})->size();
    for (int k = 0; k < 2; ++k) {
      const BodyObservation observation = fixture.track(picture, 33 * k);
      ASSERT_TRUE(observation.pose) << i << ": " << observation.failure_reason;
      expect_consistent_or_flagged(observation, truth, "small");
      EXPECT_EQ(observation.predicted, k == 1);
      EXPECT_EQ(observation.decimate, kEnlarged);
      if (k == 0) tags += observation.tags.size();
    }
  }
  std::cout << "small bodies: " << tags << " tags, " << as_it_is << " without enlarging\n";
  EXPECT_GE(tags, 2 * as_it_is);
  EXPECT_GT(tags, std::size_t{kTrials}) << "two tags determine the attitude";
}

TEST(BodyTracker, AVisitOfTheBodyAfterALongAbsenceIsNoticed) {
  TrackerFixture fixture;
  const auto empty = fixture.camera.take(body_at({0, 0, -distance_for(8)}, 1));
  const auto small = fixture.camera.take(body_at({0.02, 0.01, -distance_for(kSmall_px)}, 60));
  int pictures = 0;
  for (; pictures < 11; ++pictures) ASSERT_FALSE(fixture.track(empty, 33 * pictures).pose);
  const int arrival = pictures;
  while (!fixture.track(small, 33 * pictures).pose) ASSERT_LT(++pictures, arrival + 8);
}

TEST(BodyTracker, DegradedPicturesAreEstimatedCorrectlyOrRejected) {
  TrackerFixture fixture(camera_rig(640, 480, 550));
  const Pose truth = body_at({0.02, -0.01, -0.3}, 3);
  const auto check = [&](const char* name, auto change) {
    BodyShot shot;
    shot.probe_body = truth;
    change(shot);
    const auto picture = fixture.camera.take(shot);
    fixture.tracker.reset();
    const BodyObservation observation = fixture.track(picture, 0);
    expect_consistent_or_flagged(observation, truth, name);
    return observation;
  };
  EXPECT_TRUE(check("undisturbed", [](BodyShot&) {}).pose);
  check("blur of 3 px", [](BodyShot& s) { s.blur_px = 3; });
  EXPECT_FALSE(check("blur of 10 px", [](BodyShot& s) { s.blur_px = 10; }).pose);
  check("motion blur of 10 px", [&](BodyShot& s) {
    const double shift = 10.0 / 550 * 0.3;
    s.probe_body.translation.x -= shift / 2;
    s.closing_pose = truth;
    s.closing_pose->translation.x += shift / 2;
  });
  check("1/20 of the exposure", [](BodyShot& s) { s.exposure = 0.05, s.electrons = 10'000; });
  check("1/100 of the exposure", [](BodyShot& s) { s.exposure = 0.01; });
  check("noise of 10 %", [](BodyShot& s) { s.electrons = 300, s.read_noise_electrons = 25; });
  check("ten times overexposed", [](BodyShot& s) { s.exposure = 10; });
  EXPECT_FALSE(check("mirrored", [](BodyShot& s) { s.mirrored = true; }).pose);
}

TEST(BodyTracker, AHalfOccludedTagIsRejectedOrHarmless) {
  TrackerFixture fixture(camera_rig(640, 480, 550));
  int covered = 0;
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const Pose truth = body_at({0, 0, -0.3}, seed);
    // The occluder covers one half of the tag nearest to the camera.
    const auto nearest =
        std::min_element(fixture.body.faces.begin(), fixture.body.faces.end(), [&](const auto& a, const auto& b) {
          return length(transformed(truth, a.body_face.translation)) <
                 length(transformed(truth, b.body_face.translation));
        });
    BodyShot shot;
    shot.probe_body = truth;
    shot.occluder = reference::SphereOccluder{
        transformed(compose(truth, nearest->body_face), {0.012, 0.004, 0.02}), 0.012, {0.3, 0.3, 0.3}};
    fixture.tracker.reset();
    const auto picture = fixture.camera.take(shot);
    const BodyObservation observation = fixture.track(picture, 0);
    ASSERT_TRUE(observation.pose) << observation.failure_reason;
    expect_consistent_or_flagged(observation, truth, "half covered");
    EXPECT_LT(turn_of(error_of(observation.pose->probe_body.pose, truth)), 0.5 * kDegree);
    covered += std::none_of(observation.pose->tags.begin(), observation.pose->tags.end(),
                            [&](const TagReport& report) { return report.id == nearest->tag_id && report.used; });
  }
  EXPECT_GE(covered, 4) << "the occluder must prevent the use of the tag";
}

TEST(BodyTracker, CovarianceCoversATwoPercentFocalLengthError) {
  const RigParameters real = camera_rig();
  const BodyCamera camera(real, dodecahedron());
  auto tracker = BodyTracker::make(dodecahedron(), camera_rig(1280, 960, 1100 * 1.02));
  ASSERT_TRUE(tracker);
  for (const double width_px : {200.0, 400.0, 600.0}) {
    const Pose truth = body_at({0.04, 0.02, -distance_for(width_px)}, 6);
    const auto observation = tracker->track(camera.take(truth).view(), at_ms(0));
    ASSERT_TRUE(observation);
    ASSERT_TRUE(observation->pose);
    expect_consistent_or_flagged(*observation, truth, "focal length 2 % too long");
    tracker->reset();
  }
}

TEST(BodyTracker, RejectsInvalidInput) {
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
  EXPECT_THAT(asking([](auto& o) { o.linear = {0, 1}; }), HasSubstr("linear"));
  MarkerBody none = body;
  none.faces.clear();
  EXPECT_FALSE(BodyTracker::make(none, rig));
  RigParameters blind = rig;
  blind.lenses.clear();
  EXPECT_FALSE(BodyTracker::make(body, blind));
}

TEST(TagDetector, DetectInFindsTheSameTagsAsDetect) {
  TrackerFixture fixture(camera_rig(640, 480, 550));
  const auto picture = fixture.camera.take(body_at({0.02, 0.03, -0.3}, 1));
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
  // The window is clipped to the picture; outside of it nothing is found.
  EXPECT_EQ(detector->detect_in(picture.view(), {{-100, -100, 2'000'000'000, 2'000'000'000}})->size(), whole->size());
  for (const PixelRegion& region : {PixelRegion{640, 0, 10, 10}, PixelRegion{-20, 0, 20, 480}, PixelRegion{0, 0, 0, 0},
                                    PixelRegion{10, 10, -5, 20}, PixelRegion{0, 0, 5, 5}})
    EXPECT_TRUE(detector->detect_in(picture.view(), {region})->empty());
  EXPECT_FALSE(detector->detect_in(picture.view(), {{0, 0, 640, 480}, 0.7}));
}

}  // namespace
}  // namespace lightwell
