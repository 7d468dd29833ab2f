// The daemon with a time budget that no setting can meet, with one that every setting meets, and without a frame rate.
#include <gtest/gtest.h>

#include "e2e/daemon.hpp"
#include "e2e/light_truth.hpp"
#include "support/wait.hpp"

namespace lightwell::test {
namespace {

class BudgetTest : public ::testing::Test {
 protected:
  BudgetTest() {
    write_exr(folder_.path("room.exr"), test::room(64, [](Vec3d) { return Radiance{0.5F, 0.5F, 0.5F}; }, {}));
  }
  [[nodiscard]] DaemonOptions under(const std::string& budget_ms) const {
    return {.camera = "sim:" + folder_.path("room.exr"), .more = {"--budget-ms", budget_ms}};
  }

  TempDir folder_;
};

TEST_F(BudgetTest, AnUnattainableBudgetEndsAtFastestAndIsReportedOnce) {
  Daemon daemon(under("0.0001"));
  const Observer observer(daemon.uri());
  ASSERT_TRUE(observer.gets(5)) << daemon.process().err();
  EXPECT_EQ(observer.descriptors().back().setting, Setting::fastest);
  ASSERT_TRUE(
      becomes_true("the probe counts late estimates", [&] { return observer.counters().estimates_late_at_fast > 0; }));
  const Counters counters = observer.counters();
  EXPECT_EQ(counters.setting_moves, 1U);
  EXPECT_GT(counters.estimates_late, counters.estimates_late_at_fast);
  ASSERT_TRUE(becomes_true("the log reports it",
                           [&] { return daemon.process().err().find("--budget-ms") != std::string::npos; }));
  EXPECT_TRUE(observer.gets(60));
  (void)daemon.stop();
  const std::string said = daemon.process().err();
  EXPECT_EQ(occurrences(said, "even at the setting fastest"), 1U) << said;
}

TEST_F(BudgetTest, ABudgetThatIsMetChangesNoSetting) {
  Daemon daemon(under("60000"));
  const Observer observer(daemon.uri());
  ASSERT_TRUE(observer.gets(30)) << daemon.process().err();
  EXPECT_EQ(observer.descriptors().back().setting, Setting::balanced);
  EXPECT_EQ(observer.counters().setting_moves, 0U);
  EXPECT_EQ(observer.counters().estimates_late, 0U);
}

TEST_F(BudgetTest, WithoutAFrameRateFramesAreTakenAtTheRateOfEstimates) {
  Daemon daemon({.camera = "sim:" + folder_.path("room.exr"), .frame_rate = 0});
  const Observer observer(daemon.uri());
  ASSERT_TRUE(becomes_true("there are estimates", [&] { return observer.counters().estimates > 1000; }))
      << daemon.process().err();
  const Counters counters = observer.counters();
  // One frame is being processed, one waits, and one may have been pushed since; estimates are counted after frames.
  EXPECT_LE(counters.frames, counters.estimates + 3);
  EXPECT_EQ(counters.captures_dropped, 0U);
  EXPECT_EQ(counters.frames_lost, 0U);
  EXPECT_EQ(counters.estimates_failed, 0U);
}

}  // namespace
}  // namespace lightwell::test
