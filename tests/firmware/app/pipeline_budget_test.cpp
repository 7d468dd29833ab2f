// Pipeline with a time budget or a limit of the bound, and an estimator whose duration and bound depend on its setting.
#include <chrono>
#include <cstddef>
#include <thread>

#include <gtest/gtest.h>

#include <lightwell/codec.hpp>

#include "app/pipeline.hpp"
#include "firmware/app/fakes.hpp"
#include "support/wait.hpp"

namespace lightwell {
namespace {

using test::becomes_true;
using test::FakeLink;
using test::Lender;
using test::LinkLog;

/// Sleeps for a number of milliseconds per frame that depends on the setting.
class SlowEstimator final : public Estimator {
 public:
  struct Timing {
    std::atomic<int> fast_ms{0}, balanced_ms{0}, exact_ms{0};  ///< Fast: also fastest.
    std::atomic<int> band{-1}, interleave{-1};                 ///< Of the last configuration.
    std::atomic<float> fastest_bound{0.01F};                   ///< Of fastest; half of that otherwise.
  };
  SlowEstimator(Timing& timing, Setting setting) : timing_(timing), setting_(setting) {}

  Status estimate(std::span<const Frame> bracket, Descriptor& out) override {
    const int ms = setting_ == Setting::exact      ? timing_.exact_ms
                   : setting_ == Setting::balanced ? timing_.balanced_ms
                                                   : timing_.fast_ms;
    std::this_thread::sleep_for(std::chrono::milliseconds(ms));
    out = test::constant_light(1);
    out.sequence = bracket.front().info.sequence;
    out.setting = setting_;
    out.bound.total = timing_.fastest_bound * (setting_ == Setting::fastest ? 1.0F : 0.5F);
    return {};
  }
  EstimatorKind kind() const override { return EstimatorKind::panorama; }
  Status configure(const EstimatorConfig& config) override {
    setting_ = config.setting;
    timing_.band = config.band;
    timing_.interleave = config.panorama.interleave;
    return {};
  }
  void set_scale(RadianceScale) override {}
  RadianceScale scale() const override { return {}; }

 private:
  Timing& timing_;
  Setting setting_;
};

class PipelineBudgetTest : public ::testing::Test {
 protected:
  /// Durations and budgets must differ by a large factor, because sleeps take longer on a busy machine.
  void make(Pipeline::Limits limits, Setting setting) {
    EstimatorConfig config;
    config.setting = setting;
    pipeline_ = std::make_unique<Pipeline>(StatusSnapshot{"attic", 11, 12, "0.1.0", "fake camera"},
                                           std::make_unique<SlowEstimator>(timing_, setting), config, limits);
    pipeline_->publisher().add(std::make_unique<FakeLink>(link_));
    ASSERT_TRUE(pipeline_->start().ok());
  }
  void process(int frames) {
    for (int i = 0; i < frames; ++i) {
      const std::uint64_t before = pipeline_->status().counters.estimates;
      pipeline_->sink().push(lender_.frame(sequence_++));
      ASSERT_TRUE(becomes_true("the pipeline has processed the frame",
                               [&] { return pipeline_->status().counters.estimates > before; }));
    }
  }
  Setting last() {
    const std::vector<std::byte> bytes = link_.last();
    const Result<Descriptor> d = decode_descriptor(bytes);
    EXPECT_TRUE(d.ok());
    return d.ok() ? d->setting : Setting{};
  }

  Lender lender_;
  SlowEstimator::Timing timing_;
  LinkLog link_;
  std::unique_ptr<Pipeline> pipeline_;
  std::uint64_t sequence_ = 1;
};

TEST_F(PipelineBudgetTest, LowersTheSettingAndStatesItInTheDescriptor) {
  timing_.exact_ms = 1200;
  make({.budget_ms = 200}, Setting::exact);
  process(4);
  EXPECT_EQ(last(), Setting::fastest);
  EXPECT_EQ(pipeline_->health().setting, Setting::fastest);
  EXPECT_EQ(pipeline_->status().counters.setting_moves, 1U);
  EXPECT_EQ(pipeline_->status().counters.estimates_late, 2U);
  EXPECT_EQ(pipeline_->status().counters.estimates_late_at_fast, 0U);
  EXPECT_EQ(pipeline_->estimator().setting, Setting::exact) << "the configuration is unchanged";
  EXPECT_FALSE(pipeline_->health().over_budget_ms);
}

TEST_F(PipelineBudgetTest, RaisesTheSettingAgainWhenItFits) {
  timing_.balanced_ms = 600;
  make({.budget_ms = 200}, Setting::balanced);
  process(3);
  ASSERT_EQ(pipeline_->health().setting, Setting::fastest);
  timing_.balanced_ms = 0;
  for (int i = 0; i < 400 && pipeline_->health().setting != Setting::balanced; ++i) process(1);
  process(1);
  EXPECT_EQ(last(), Setting::balanced);
  EXPECT_EQ(pipeline_->status().counters.setting_moves, 3U) << "to fastest, fast, and balanced";
}

TEST_F(PipelineBudgetTest, WithoutABudgetTheSettingNeverChanges) {
  timing_.exact_ms = 30;
  make({}, Setting::exact);
  process(8);
  EXPECT_EQ(last(), Setting::exact);
  EXPECT_EQ(pipeline_->status().counters.setting_moves, 0U);
  EXPECT_EQ(pipeline_->status().counters.estimates_late, 0U);
}

TEST_F(PipelineBudgetTest, ReportsIfEvenFastestIsTooSlow) {
  timing_.fast_ms = timing_.balanced_ms = timing_.exact_ms = 30;
  make({.budget_ms = 5}, Setting::balanced);
  process(8);
  EXPECT_EQ(last(), Setting::fastest);
  ASSERT_TRUE(pipeline_->health().over_budget_ms);
  EXPECT_GE(*pipeline_->health().over_budget_ms, 30);
  EXPECT_GE(pipeline_->status().counters.estimates_late_at_fast, 5U);
}

TEST_F(PipelineBudgetTest, ReconfigurationKeepsTheGovernedSetting) {
  timing_.balanced_ms = 600;
  make({.budget_ms = 200}, Setting::balanced);
  process(3);
  ASSERT_EQ(pipeline_->health().setting, Setting::fastest);
  EstimatorConfig config = pipeline_->estimator();
  config.band = 2;
  ASSERT_TRUE(pipeline_->update_estimator(all_fields(config)).ok());
  process(1);
  EXPECT_EQ(timing_.band, 2);
  EXPECT_EQ(last(), Setting::fastest);
  config.setting = Setting::exact;
  ASSERT_TRUE(pipeline_->update_estimator(all_fields(config)).ok());
  process(1);
  EXPECT_EQ(last(), Setting::exact) << "a newly configured setting is used at once";
}

TEST_F(PipelineBudgetTest, TakesTheCheapestSettingWhoseBoundHolds) {
  make({.max_bound = 0.02}, Setting::exact);
  process(4);
  EXPECT_EQ(last(), Setting::fastest);
  timing_.fastest_bound = 0.025F;
  process(4);
  EXPECT_EQ(last(), Setting::balanced);
  EXPECT_EQ(timing_.interleave, 16);
  timing_.fastest_bound = 0.01F;
  for (int i = 0; i < 400 && pipeline_->health().setting != Setting::fastest; ++i) process(1);
  process(1);
  EXPECT_EQ(last(), Setting::fastest);
  EXPECT_EQ(pipeline_->status().counters.setting_moves, 2U);
  EXPECT_FALSE(pipeline_->health().over_bound);
}

TEST_F(PipelineBudgetTest, ReportsABoundThatNoSettingKeepsAndKeepsTheTimeLimitFirst) {
  timing_.fastest_bound = 0.5F;
  timing_.exact_ms = 600;
  make({.budget_ms = 200, .max_bound = 0.02}, Setting::exact);
  process(8);
  EXPECT_TRUE(pipeline_->health().over_bound);
  EXPECT_NE(last(), Setting::exact) << "it takes too long";
}

}  // namespace
}  // namespace lightwell
