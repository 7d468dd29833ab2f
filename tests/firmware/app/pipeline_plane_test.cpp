// Captured planes from a fake estimator through the pipeline to a fake link.
#include <chrono>
#include <limits>
#include <memory>
#include <mutex>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/plane_codec.hpp>

#include "app/pipeline.hpp"
#include "firmware/app/fakes.hpp"
#include "support/captured_planes.hpp"
#include "support/wait.hpp"

namespace lightwell {
namespace {

using test::becomes_true;
using test::EstimatorScript;
using test::FakeEstimator;
using test::FakeLink;
using test::Lender;
using test::LinkLog;
using ::testing::HasSubstr;

class PipelinePlaneTest : public ::testing::Test {
 protected:
  void start(const PlaneEncoderOptions& planes = {}) {
    pipeline_ = std::make_unique<Pipeline>(StatusSnapshot{}, std::make_unique<FakeEstimator>(script_),
                                           EstimatorConfig{}, Pipeline::Limits{}, planes);
    pipeline_->publisher().add(std::make_unique<FakeLink>(link_));
    ASSERT_TRUE(pipeline_->start().ok());
  }
  void set_plane(const CapturedPlane& plane) {
    const std::lock_guard lock(script_.mutex);
    script_.plane = plane;
  }
  /// Pushes the next frame and waits until it was published or failed.
  void process_one() {
    const auto done = [&] {
      const Counters c = pipeline_->status().counters;
      return c.estimates + c.estimates_failed;
    };
    const std::uint64_t before = done();
    pipeline_->sink().push(lender_.frame(sequence_++));
    ASSERT_TRUE(becomes_true("the pipeline has processed the frame", [&] { return done() > before; }));
  }
  std::vector<LinkLog::PublishedPlane> planes() const {
    const std::lock_guard lock(link_.mutex);
    return link_.planes;
  }
  /// Pushes frames until that many updates were published.
  void process_until(std::size_t updates) {
    ASSERT_TRUE(becomes_true("planes are published", [&] {
      process_one();
      return planes().size() >= updates;
    }));
  }

  Lender lender_;
  EstimatorScript script_;
  LinkLog link_;
  std::unique_ptr<Pipeline> pipeline_;
  std::uint64_t sequence_ = 1;
};

TEST_F(PipelinePlaneTest, AnEstimatorWithoutAPlanePublishesNone) {
  ASSERT_NO_FATAL_FAILURE(start());
  for (int k = 0; k < 3; ++k) process_one();
  pipeline_->stop();
  EXPECT_EQ(link_.count(), 3U);
  EXPECT_TRUE(planes().empty());
}

TEST_F(PipelinePlaneTest, UpdatesAreASecondApartAlsoWhereNothingChanges) {
  set_plane(test::linear_plane(16, 4, 4));
  ASSERT_NO_FATAL_FAILURE(start());
  process_until(3);
  const auto published = planes();
  ASSERT_GE(published.size(), 3U);
  // The link is called some time after the pipeline has read the clock: a late update may be followed by one that is
  // early by as much.
  EXPECT_GE(published[2].at_ns - published[0].at_ns, 1'500'000'000);
  // In a second there were many frames.
  EXPECT_GT(link_.count(), 20U);
  for (std::size_t k = 0; k < published.size(); ++k) {
    const Result<PlaneUpdate> update = decode_plane_update(published[k].plane->changes.front());
    ASSERT_TRUE(update.ok()) << update.status().message();
    EXPECT_EQ(update->revision, k + 1);
    EXPECT_EQ(update->info.capture, 0xC0FFEEU);
  }
}

// A recording ends, or the plane leaves the picture of a camera that stops.
TEST_F(PipelinePlaneTest, WhatTheLastFramesChangedIsPublishedThoughNoFrameFollows) {
  set_plane(test::linear_plane(16, 4, 4));
  ASSERT_NO_FATAL_FAILURE(start());
  process_one();
  ASSERT_TRUE(becomes_true("the first update is published", [&] { return planes().size() == 1; }));
  CapturedPlane changed = test::linear_plane(16, 4, 4);
  changed.info.gloss_alpha = 0.25F;
  set_plane(changed);
  process_one();
  ASSERT_TRUE(becomes_true("the second update is published", [&] { return planes().size() == 2; }));
  const auto published = planes();
  const Result<PlaneUpdate> update = decode_plane_update(published[1].plane->changes.front());
  ASSERT_TRUE(update.ok()) << update.status().message();
  EXPECT_EQ(update->info.gloss_alpha, 0.25F);
  EXPECT_GE(published[1].at_ns - published[0].at_ns, 500'000'000);
  // Once only, and stop() does not wait for another second.
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  EXPECT_EQ(planes().size(), 2U);
  pipeline_->stop();
}

TEST_F(PipelinePlaneTest, APlaneIsAlsoPublishedWhereTheEstimateFails) {
  set_plane(test::linear_plane(16, 4, 4));
  script_.fail_with = {StatusCode::not_found, "its tags are not in the picture"};
  ASSERT_NO_FATAL_FAILURE(start());
  process_until(1);
  EXPECT_EQ(link_.count(), 0U);
}

TEST_F(PipelinePlaneTest, TheTextureIsSentOnlyWhereImagesAreAllowed) {
  for (const ImageRecipients images : {ImageRecipients::nobody, ImageRecipients::all_clients}) {
    set_plane(test::linear_plane(16, 4, 4));
    ASSERT_NO_FATAL_FAILURE(start({.images = images}));
    process_until(planes().size() + 1);
    const auto published = planes();
    ASSERT_FALSE(published.empty());
    const Result<PlaneUpdate> update = decode_plane_update(published.back().plane->whole.front());
    ASSERT_TRUE(update.ok()) << update.status().message();
    EXPECT_EQ(update->layout.texture_edge(), images == ImageRecipients::nobody ? 0 : 16);
    EXPECT_FALSE(update->tiles.empty());
    pipeline_->stop();
  }
}

TEST_F(PipelinePlaneTest, AnInvalidPlaneIsReportedAndDescriptorsGoOn) {
  CapturedPlane plane = test::linear_plane(16, 4, 4);
  plane.info.size_m = std::numeric_limits<double>::quiet_NaN();
  set_plane(plane);
  ASSERT_NO_FATAL_FAILURE(start());
  process_one();
  process_one();
  EXPECT_EQ(link_.count(), 2U);
  EXPECT_TRUE(planes().empty());
  EXPECT_THAT(pipeline_->health().last_error, HasSubstr("size_m"));
  EXPECT_EQ(pipeline_->status().counters.estimates_failed, 0U);
}

}  // namespace
}  // namespace lightwell
