// The pipeline under a budget, with an estimator whose time depends on its setting.
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

/// Sleeps for so many milliseconds a frame, by setting.
class SlowEstimator final : public Estimator {
 public:
  struct Pace {
    std::atomic<int> fast_ms{0}, balanced_ms{0}, exact_ms{0};
    std::atomic<int> band{-1};  ///< That it was last configured with.
  };
  SlowEstimator(Pace& pace, Setting setting) : pace_(pace), setting_(setting) {}

  Status estimate(std::span<const Frame> bracket, Descriptor& out) override {
    const int ms = setting_ == Setting::fast       ? pace_.fast_ms
                   : setting_ == Setting::balanced ? pace_.balanced_ms
                                                   : pace_.exact_ms;
    std::this_thread::sleep_for(std::chrono::milliseconds(ms));
    out = test::constant_light(1);
    out.sequence = bracket.front().info.sequence;
    out.setting = setting_;
    return {};
  }
  EstimatorKind kind() const override { return EstimatorKind::panorama; }
  Status configure(const EstimatorConfig& config) override {
    setting_ = config.setting;
    pace_.band = config.band;
    return {};
  }
  void set_scale(RadianceScale) override {}
  RadianceScale scale() const override { return {}; }

 private:
  Pace& pace_;
  Setting setting_;
};

class PipelineBudgetTest : public ::testing::Test {
 protected:
  /// Sleeps take longer than asked for on a busy machine, so settings differ by far and budgets leave room.
  void make(double budget_ms, Setting setting) {
    EstimatorConfig config;
    config.setting = setting;
    pipeline_ = std::make_unique<Pipeline>(ProbeIdentity{"attic", 11, 12, "0.1.0", "fake camera"},
                                           std::make_unique<SlowEstimator>(pace_, setting), config, budget_ms);
    pipeline_->publisher().add(std::make_unique<FakeLink>(link_));
    ASSERT_TRUE(pipeline_->start().ok());
  }
  void process(int frames) {
    for (int i = 0; i < frames; ++i) {
      const std::uint64_t before = pipeline_->status().counters.estimates;
      pipeline_->sink().push(lender_.frame(sequence_++));
      ASSERT_TRUE(becomes_true("the pipeline has dealt with the frame",
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
  SlowEstimator::Pace pace_;
  LinkLog link_;
  std::unique_ptr<Pipeline> pipeline_;
  std::uint64_t sequence_ = 1;
};

TEST_F(PipelineBudgetTest, FallsAndTheDescriptorSaysSo) {
  pace_.exact_ms = 1200;
  make(200, Setting::exact);
  process(4);
  EXPECT_EQ(last(), Setting::fast);
  EXPECT_EQ(pipeline_->setting(), Setting::fast);
  EXPECT_EQ(pipeline_->status().counters.setting_moves, 1U);
  EXPECT_EQ(pipeline_->status().counters.estimates_late, 2U);
  EXPECT_EQ(pipeline_->status().counters.estimates_late_at_fast, 0U);
  EXPECT_EQ(pipeline_->estimator().setting, Setting::exact) << "what is configured stays what is configured";
  EXPECT_FALSE(pipeline_->over_budget_ms());
}

TEST_F(PipelineBudgetTest, ClimbsAgainWhenThereIsRoom) {
  pace_.balanced_ms = 600;
  make(200, Setting::balanced);
  process(3);
  ASSERT_EQ(pipeline_->setting(), Setting::fast);
  pace_.balanced_ms = 0;
  for (int i = 0; i < 400 && pipeline_->setting() == Setting::fast; ++i) process(1);
  process(1);
  EXPECT_EQ(last(), Setting::balanced);
  EXPECT_EQ(pipeline_->status().counters.setting_moves, 2U);
}

TEST_F(PipelineBudgetTest, WithoutABudgetNothingMoves) {
  pace_.exact_ms = 30;
  make(0, Setting::exact);
  process(8);
  EXPECT_EQ(last(), Setting::exact);
  EXPECT_EQ(pipeline_->status().counters.setting_moves, 0U);
  EXPECT_EQ(pipeline_->status().counters.estimates_late, 0U);
}

TEST_F(PipelineBudgetTest, SaysWhereEvenFastIsTooSlow) {
  pace_.fast_ms = pace_.balanced_ms = pace_.exact_ms = 30;
  make(5, Setting::balanced);
  process(8);
  EXPECT_EQ(last(), Setting::fast);
  ASSERT_TRUE(pipeline_->over_budget_ms());
  EXPECT_GE(*pipeline_->over_budget_ms(), 30);
  EXPECT_GE(pipeline_->status().counters.estimates_late_at_fast, 5U);
}

TEST_F(PipelineBudgetTest, AnotherConfigurationKeepsTheGovernedSetting) {
  pace_.balanced_ms = 600;
  make(200, Setting::balanced);
  process(3);
  ASSERT_EQ(pipeline_->setting(), Setting::fast);
  EstimatorConfig config = pipeline_->estimator();
  config.band = 2;
  ASSERT_TRUE(pipeline_->update_estimator(all_fields(config)).ok());
  process(1);
  EXPECT_EQ(pace_.band, 2);
  EXPECT_EQ(last(), Setting::fast);
  config.setting = Setting::exact;
  ASSERT_TRUE(pipeline_->update_estimator(all_fields(config)).ok());
  process(1);
  EXPECT_EQ(last(), Setting::exact) << "another setting is tried at once";
}

}  // namespace
}  // namespace lightwell
