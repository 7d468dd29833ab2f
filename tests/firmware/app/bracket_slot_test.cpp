// BracketSlot: keeps the newest complete bracket and counts lost frames and brackets.
#include <stop_token>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "app/pipeline.hpp"
#include "firmware/app/fakes.hpp"
#include "support/wait.hpp"

namespace lightwell {
namespace {

using test::becomes_true;
using test::Lender;
using ::testing::ElementsAre;

std::vector<std::uint64_t> sequences(const Bracket& bracket) {
  std::vector<std::uint64_t> out;
  for (const Frame& f : bracket.frames()) out.push_back(f.info.sequence);
  return out;
}

class BracketSlotTest : public ::testing::Test {
 protected:
  void push(std::uint64_t sequence, int index = 0, int size = 1) { slot_.push(lender_.frame(sequence, index, size)); }
  /// Takes the complete bracket; returns the sequence numbers of its frames.
  std::vector<std::uint64_t> take() {
    EXPECT_TRUE(slot_.take(bracket_));
    return sequences(bracket_);
  }

  Lender lender_;  // Before the others, whose frames return to it.
  BracketSlot slot_;
  Bracket bracket_;
};

TEST_F(BracketSlotTest, ASingleFrameIsABracketOfOne) {
  push(7);
  EXPECT_THAT(take(), ElementsAre(7));
  EXPECT_EQ(slot_.counts().frames, 1U);
  EXPECT_EQ(slot_.counts().dropped, 0U);
}

TEST_F(BracketSlotTest, TheNewestReplacesOthersWhichAreCountedAndReleased) {
  push(1);
  push(2);
  push(3);
  EXPECT_EQ(lender_.lent(), 1);
  EXPECT_THAT(take(), ElementsAre(3));
  EXPECT_EQ(slot_.counts().frames, 3U);
  EXPECT_EQ(slot_.counts().dropped, 2U);
}

TEST_F(BracketSlotTest, WaitingForSpaceReplacesNothing) {
  constexpr std::uint64_t kBrackets = 2000;
  std::stop_source stop;
  std::thread camera([&, token = stop.get_token()] {
    for (std::uint64_t sequence = 0; sequence < 2 * kBrackets && slot_.wait_for_space(token); ++sequence)
      push(sequence, static_cast<int>(sequence % 2), 2);
  });
  for (std::uint64_t k = 0; k < kBrackets; ++k) {
    const std::vector<std::uint64_t> taken = take();
    if (taken != std::vector<std::uint64_t>{2 * k, 2 * k + 1}) {
      ADD_FAILURE() << "bracket " << k << " begins with frame " << taken.front();
      break;
    }
  }
  stop.request_stop();
  camera.join();
  EXPECT_EQ(slot_.counts().dropped, 0U);
}

TEST_F(BracketSlotTest, WaitForSpaceReturnsOnStop) {
  push(1);
  std::stop_source stop;
  bool space = true;
  std::thread camera([&, token = stop.get_token()] { space = slot_.wait_for_space(token); });
  stop.request_stop();
  camera.join();
  EXPECT_FALSE(space);
}

TEST_F(BracketSlotTest, CountsFramesLostByTheCamera) {
  push(5);
  EXPECT_EQ(slot_.counts().lost, 0U) << "the first sequence number is arbitrary";
  push(6);
  push(10);
  EXPECT_EQ(slot_.counts().lost, 3U);
  push(1);
  EXPECT_EQ(slot_.counts().lost, 3U) << "a backward jump is a restart, not a loss";
}

TEST_F(BracketSlotTest, CollectsExposuresInOrder) {
  for (int i = 0; i < 3; ++i) push(static_cast<std::uint64_t>(3 + i), i, 3);
  EXPECT_THAT(take(), ElementsAre(3, 4, 5));
}

TEST_F(BracketSlotTest, ACompleteBracketWaitsWhileTheNextOneFills) {
  for (int i = 0; i < 3; ++i) push(static_cast<std::uint64_t>(i), i, 3);
  push(3, 0, 3);
  push(4, 1, 3);
  EXPECT_THAT(take(), ElementsAre(0, 1, 2));
  push(5, 2, 3);
  EXPECT_THAT(take(), ElementsAre(3, 4, 5));
  EXPECT_EQ(slot_.counts().dropped, 0U);
  EXPECT_EQ(slot_.counts().incomplete, 0U);
}

TEST_F(BracketSlotTest, WithoutItsMiddleExposureABracketIsDiscardedAndCountedOnce) {
  push(0, 0, 3);
  push(2, 2, 3);
  EXPECT_EQ(lender_.lent(), 0) << "both exposures are released";
  EXPECT_EQ(slot_.counts().incomplete, 1U);
  for (int i = 0; i < 3; ++i) push(static_cast<std::uint64_t>(3 + i), i, 3);
  EXPECT_THAT(take(), ElementsAre(3, 4, 5));
  EXPECT_EQ(slot_.counts().incomplete, 1U);
}

TEST_F(BracketSlotTest, WithoutItsFirstExposureABracketIsCountedOnce) {
  push(1, 1, 3);
  push(2, 2, 3);
  EXPECT_EQ(slot_.counts().incomplete, 1U);
  EXPECT_EQ(lender_.lent(), 0);
}

TEST_F(BracketSlotTest, WithoutItsLastExposureABracketIsCountedWhenTheNextBegins) {
  push(0, 0, 3);
  push(1, 1, 3);
  push(3, 0, 3);
  EXPECT_EQ(slot_.counts().incomplete, 1U);
  EXPECT_EQ(lender_.lent(), 1) << "the first exposure of the next bracket";
}

TEST_F(BracketSlotTest, TwoIncompleteBracketsAreCountedTwice) {
  push(0, 0, 3);
  push(1, 1, 3);
  // 2 and 3 are lost: the end of one bracket and the beginning of the next.
  push(4, 1, 3);
  push(5, 2, 3);
  EXPECT_EQ(slot_.counts().incomplete, 2U);
  EXPECT_EQ(lender_.lent(), 0);
}

TEST_F(BracketSlotTest, ExposuresOfDifferentBracketsAreNotMixed) {
  push(0, 0, 3);
  push(4, 1, 3);  // The next index, but of another bracket.
  push(5, 2, 3);
  EXPECT_EQ(lender_.lent(), 0);
  EXPECT_EQ(slot_.counts().incomplete, 2U);
}

TEST_F(BracketSlotTest, TakeReleasesThePreviousBracket) {
  push(1);
  take();
  push(2);
  EXPECT_EQ(lender_.lent(), 2);
  take();
  EXPECT_EQ(lender_.lent(), 1);
  bracket_.clear();
  EXPECT_EQ(lender_.lent(), 0);
}

TEST_F(BracketSlotTest, TakeWaitsForTheFrame) {
  std::thread camera([this] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    push(9);
  });
  EXPECT_THAT(take(), ElementsAre(9));
  camera.join();
}

TEST_F(BracketSlotTest, CloseEndsAWaitingTake) {
  std::atomic<bool> woken{false};
  std::thread estimator([&] {
    Bracket b;
    EXPECT_FALSE(slot_.take(b));
    woken = true;
  });
  slot_.close();
  EXPECT_TRUE(becomes_true("take() returns after close()", [&] { return woken.load(); }));
  estimator.join();
}

TEST_F(BracketSlotTest, CloseReleasesFramesAndAcceptsNoMore) {
  for (int i = 0; i < 3; ++i) push(static_cast<std::uint64_t>(i), i, 3);
  push(3, 0, 3);
  EXPECT_EQ(lender_.lent(), 4);
  slot_.close();
  EXPECT_EQ(lender_.lent(), 0);
  push(4, 1, 3);
  EXPECT_EQ(lender_.lent(), 0);
  EXPECT_FALSE(slot_.take(bracket_));
  EXPECT_EQ(slot_.counts().frames, 5U) << "frames are still counted";
}

}  // namespace
}  // namespace lightwell
