// Pipeline with a fake estimator and a fake link.
#include "app/pipeline.hpp"

#include <barrier>
#include <cmath>
#include <limits>
#include <numbers>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/codec.hpp>

#include "firmware/app/fakes.hpp"
#include "support/wait.hpp"

namespace lightwell {
namespace {

using test::becomes_true;
using test::EstimatorScript;
using test::FakeEstimator;
using test::FakeLink;
using test::Lender;
using test::LinkLog;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class PipelineTest : public ::testing::Test {
 protected:
  PipelineTest()
      : pipeline_({"attic", 11, 12, "0.1.0", "fake camera"}, std::make_unique<FakeEstimator>(script_),
                  EstimatorConfig{}) {
    pipeline_.publisher().add(std::make_unique<FakeLink>(link_));
  }

  /// Pushes the next frame and waits until it was published or failed.
  void process_one() {
    const Counters before = pipeline_.status().counters;
    pipeline_.sink().push(lender_.frame(sequence_++));
    ASSERT_TRUE(becomes_true("the pipeline has processed the frame", [&] {
      const Counters now = pipeline_.status().counters;
      return now.estimates + now.estimates_failed > before.estimates + before.estimates_failed;
    }));
  }
  Descriptor last() {
    const std::vector<std::byte> bytes = link_.last();
    const Result<Descriptor> d = decode_descriptor(bytes);
    EXPECT_TRUE(d.ok()) << d.status().message();
    return d.ok() ? *d : Descriptor{};
  }
  void set_flags(std::initializer_list<Flag> flags) {
    const std::lock_guard lock(script_.mutex);
    script_.flags = {};
    for (const Flag f : flags) script_.flags.set(f);
  }

  Lender lender_;
  EstimatorScript script_;
  LinkLog link_;
  Pipeline pipeline_;
  std::uint64_t sequence_ = 40;
};

TEST_F(PipelineTest, AFrameBecomesADescriptorOnTheLink) {
  ASSERT_TRUE(pipeline_.start().ok());
  process_one();
  EXPECT_EQ(last().sequence, 40U);
  EXPECT_EQ(link_.count(), 1U);
  EXPECT_TRUE(becomes_true("the frame is released", [&] { return lender_.lent() == 0; }));
}

TEST_F(PipelineTest, ABracketIsPassedToTheEstimatorAsAWhole) {
  ASSERT_TRUE(pipeline_.start().ok());
  for (int i = 0; i < 3; ++i) pipeline_.sink().push(lender_.frame(static_cast<std::uint64_t>(6 + i), i, 3));
  ASSERT_TRUE(becomes_true("the bracket is published", [&] { return link_.count() == 1; }));
  const std::lock_guard lock(script_.mutex);
  EXPECT_THAT(script_.brackets, ElementsAre(ElementsAre(6, 7, 8)));
}

TEST_F(PipelineTest, EstimatorErrorsAreCountedAndReported) {
  ASSERT_TRUE(pipeline_.start().ok());
  script_.fail_with = {StatusCode::invalid_argument, "lens 7 is not in the calibration"};
  process_one();
  EXPECT_EQ(pipeline_.status().counters.estimates_failed, 1U);
  EXPECT_EQ(link_.count(), 0U);
  EXPECT_THAT(pipeline_.health().last_error, HasSubstr("lens 7"));
  {
    const std::lock_guard lock(script_.mutex);
    script_.fail_with = {};
  }
  process_one();
  EXPECT_EQ(link_.count(), 1U) << "later frames are estimated";
}

TEST_F(PipelineTest, EncodingErrorsAreCountedAndReported) {
  ASSERT_TRUE(pipeline_.start().ok());
  script_.level = std::numeric_limits<float>::quiet_NaN();
  process_one();
  EXPECT_EQ(pipeline_.status().counters.estimates_failed, 1U);
  EXPECT_THAT(pipeline_.health().last_error, HasSubstr("not finite"));
}

TEST_F(PipelineTest, StatusHasIdentityAndCounters) {
  link_.counters = {3, 17};
  ASSERT_TRUE(pipeline_.start().ok());
  process_one();
  process_one();
  pipeline_.sink().push(lender_.frame(80, 1, 3));
  const StatusSnapshot s = pipeline_.status();
  EXPECT_EQ(s.probe_name, "attic");
  EXPECT_EQ(s.probe_id, 11U);
  EXPECT_EQ(s.calibration_id, 12U);
  EXPECT_EQ(s.version, "0.1.0");
  EXPECT_EQ(s.camera, "fake camera");
  EXPECT_EQ(s.counters.frames, 3U);
  EXPECT_EQ(s.counters.estimates, 2U);
  EXPECT_EQ(s.counters.brackets_incomplete, 1U);
  EXPECT_EQ(s.counters.clients, 3U);
  EXPECT_EQ(s.counters.descriptors_coalesced, 17U);
}

TEST_F(PipelineTest, SetEstimatorTakesEffectWithTheNextFrame) {
  ASSERT_TRUE(pipeline_.start().ok());
  EstimatorConfig config;
  config.band = 2;
  config.max_lights = 3;
  ASSERT_TRUE(pipeline_.update_estimator(all_fields(config)).ok());
  EXPECT_EQ(pipeline_.estimator().band, 2);
  process_one();
  const std::lock_guard lock(script_.mutex);
  EXPECT_EQ(script_.configured.band, 2);
  EXPECT_EQ(script_.configured.max_lights, 3);
}

TEST_F(PipelineTest, ConcurrentUpdatesOfDifferentFieldsBothTakeEffect) {
  constexpr int kRounds = 10'000;
  int refused = 0, lost = 0;
  std::barrier together(2);
  std::thread bands([&] {
    for (int i = 0; i < kRounds; ++i) {
      together.arrive_and_wait();
      (void)pipeline_.update_estimator({.band = i % 7});
      together.arrive_and_wait();
    }
  });
  for (int i = 0; i < kRounds; ++i) {
    together.arrive_and_wait();
    if (!pipeline_.update_estimator({.max_lights = i % 65}).ok()) ++refused;
    together.arrive_and_wait();
    const EstimatorConfig both = pipeline_.estimator();
    if (both.band != i % 7 || both.max_lights != i % 65) ++lost;
  }
  bands.join();
  EXPECT_EQ(refused, 0);
  EXPECT_EQ(lost, 0);
}

TEST_F(PipelineTest, AnInvalidConfigurationChangesNothing) {
  EstimatorConfig config;
  config.band = 7;
  const Status s = pipeline_.update_estimator(all_fields(config));
  EXPECT_EQ(s.code(), StatusCode::invalid_argument);
  EXPECT_THAT(s.message(), HasSubstr("band"));
  EXPECT_EQ(pipeline_.estimator().band, EstimatorConfig{}.band);
}

TEST_F(PipelineTest, ALuxReadingScalesLaterDescriptors) {
  script_.level = 2;
  ASSERT_TRUE(pipeline_.start().ok());
  process_one();
  EXPECT_EQ(last().units, Units::relative);
  // Constant radiance L gives an irradiance of pi L at every normal.
  const Result<double> factor = pipeline_.report_lux(100 * std::numbers::pi, {0, 1, 0});
  ASSERT_TRUE(factor.ok()) << factor.status().message();
  EXPECT_NEAR(*factor, 50, 0.1);
  process_one();
  EXPECT_EQ(last().units, Units::absolute);
  EXPECT_NEAR(last().radiance.c[0].g * 0.28209479F, 100, 0.1);
}

TEST_F(PipelineTest, ASecondReadingRefinesTheFirst) {
  ASSERT_TRUE(pipeline_.start().ok());
  process_one();
  ASSERT_TRUE(pipeline_.report_lux(500, {0, 1, 0}).ok());
  process_one();
  const Result<double> again = pipeline_.report_lux(500, {0, 1, 0});
  ASSERT_TRUE(again.ok());
  EXPECT_NEAR(*again * std::numbers::pi, 500, 1) << "the same reading gives the same scale";
}

TEST_F(PipelineTest, RefusesALuxReadingWhileTheLightIsUncertain) {
  ASSERT_TRUE(pipeline_.start().ok());
  const Result<double> early = pipeline_.report_lux(100, {0, 1, 0});
  EXPECT_EQ(early.status().code(), StatusCode::failed_precondition) << "nothing measured yet";
  for (const Flag flag : {Flag::unseen, Flag::clipped, Flag::dark}) {
    set_flags({flag});
    process_one();
    const Result<double> refused = pipeline_.report_lux(100, {0, 1, 0});
    EXPECT_EQ(refused.status().code(), StatusCode::failed_precondition);
    EXPECT_THAT(refused.status().message(), HasSubstr(std::string(to_string(flag))));
  }
  set_flags({Flag::cleaned});
  process_one();
  EXPECT_TRUE(pipeline_.report_lux(100, {0, 1, 0}).ok()) << "cleaned pixels do not prevent a scale";
}

TEST_F(PipelineTest, RefusesAReadingThatGivesNoScale) {
  ASSERT_TRUE(pipeline_.start().ok());
  process_one();
  EXPECT_FALSE(pipeline_.report_lux(std::numeric_limits<double>::infinity(), {0, 1, 0}).ok());
  EXPECT_FALSE(pipeline_.report_lux(-5, {0, 1, 0}).ok());
  EXPECT_FALSE(pipeline_.report_lux(std::nan(""), {0, 1, 0}).ok());
  process_one();
  EXPECT_EQ(last().units, Units::relative) << "the scale is unchanged";
}

TEST_F(PipelineTest, ALinkThatDoesNotStartStopsTheOthers) {
  LinkLog second;
  second.start_with = {StatusCode::resource_exhausted, "the port is in use"};
  pipeline_.publisher().add(std::make_unique<FakeLink>(second));
  const Status s = pipeline_.start();
  EXPECT_EQ(s.code(), StatusCode::resource_exhausted);
  EXPECT_FALSE(link_.running);
  pipeline_.stop();
}

TEST_F(PipelineTest, StopEndsTheLinksAndReleasesFrames) {
  ASSERT_TRUE(pipeline_.start().ok());
  process_one();
  pipeline_.sink().push(lender_.frame(99, 0, 3));
  pipeline_.stop();
  EXPECT_FALSE(link_.running);
  EXPECT_EQ(lender_.lent(), 0);
  pipeline_.stop();
}

}  // namespace
}  // namespace lightwell
