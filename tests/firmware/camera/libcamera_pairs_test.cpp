// Tests of FramePairer and CycleAlignment: two free-running cameras.
#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "camera/backends/libcamera/frame_pairs.hpp"

namespace lightwell::libcam {
namespace {

constexpr std::int64_t kFrame = 33'000'000;

struct Shot {
  int lens;
  std::int64_t at;
};

/// Result of pairing; tokens are indices of the shots.
struct Outcome {
  std::vector<std::pair<int, int>> pairs;
  std::vector<int> dropped;
};

Outcome pair_up(FramePairer& pairs, const std::vector<Shot>& shots) {
  Outcome out;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    pairs.offer(shots[i].lens, {{shots[i].at}, static_cast<int>(i)});
    for (auto v = pairs.next(); v.kind != FramePairer::Kind::nothing; v = pairs.next()) {
      if (v.kind == FramePairer::Kind::pair)
        out.pairs.emplace_back(v.tokens[0], v.tokens[1]);
      else
        out.dropped.push_back(v.tokens[static_cast<std::size_t>(v.lens)]);
    }
  }
  return out;
}

/// Sorts the frames of both cameras by time.
std::vector<Shot> in_order(std::vector<Shot> shots) {
  std::stable_sort(shots.begin(), shots.end(), [](const Shot& a, const Shot& b) { return a.at < b.at; });
  return shots;
}

TEST(FramePairer, NearestFramesArePairs) {
  std::vector<Shot> shots;
  for (int i = 0; i < 50; ++i) {
    shots.push_back({0, i * kFrame});
    shots.push_back({1, i * kFrame + kFrame / 3});
  }
  shots = in_order(shots);
  FramePairer pairs({kFrame});
  const Outcome out = pair_up(pairs, shots);
  ASSERT_EQ(out.pairs.size(), 50U);
  EXPECT_TRUE(out.dropped.empty());
  for (const auto& [a, b] : out.pairs)
    EXPECT_EQ(shots[static_cast<std::size_t>(b)].at - shots[static_cast<std::size_t>(a)].at, kFrame / 3);
}

TEST(FramePairer, PairsUpToExactlyHalfAFrameInterval) {
  FramePairer pairs({kFrame});
  EXPECT_EQ(pair_up(pairs, {{0, 1000}, {1, 1000 + kFrame / 2}}).pairs.size(), 1U);
  FramePairer strict({kFrame});
  const Outcome out = pair_up(strict, {{0, 1000}, {1, 1001 + kFrame / 2}});
  EXPECT_TRUE(out.pairs.empty());
  EXPECT_EQ(out.dropped, std::vector<int>{0}) << "a nearer frame can no longer come";
}

TEST(FramePairer, AFrameThatTheOtherCameraLostIsDroppedAndCounted) {
  std::vector<Shot> shots;
  for (int i = 0; i < 30; ++i) {
    shots.push_back({0, i * kFrame});
    if (i < 10 || i > 13) shots.push_back({1, i * kFrame + 2'000'000});
  }
  FramePairer pairs({kFrame});
  const Outcome out = pair_up(pairs, in_order(shots));
  EXPECT_EQ(out.pairs.size(), 26U);
  EXPECT_EQ(pairs.counts().pairs, 26U);
  EXPECT_EQ(pairs.counts().unpaired[0], 4U);
  EXPECT_EQ(pairs.counts().unpaired[1], 0U);
}

TEST(FramePairer, AFasterCameraLosesOneFramePerDriftPeriod) {
  // 1 % faster: after 100 frames it is one frame ahead.
  std::vector<Shot> shots;
  for (int i = 0; i < 1000; ++i) shots.push_back({0, i * kFrame});
  for (int i = 0; i * (kFrame * 99 / 100) < 1000 * kFrame; ++i) shots.push_back({1, i * (kFrame * 99 / 100)});
  shots = in_order(shots);
  FramePairer pairs({kFrame});
  const Outcome out = pair_up(pairs, shots);
  EXPECT_GE(out.pairs.size(), 999U);
  EXPECT_NEAR(static_cast<double>(pairs.counts().unpaired[1]), 10, 1);
  EXPECT_EQ(pairs.counts().unpaired[0], 0U);
  for (const auto& [a, b] : out.pairs) {
    const std::int64_t apart = std::abs(shots[static_cast<std::size_t>(a)].at - shots[static_cast<std::size_t>(b)].at);
    EXPECT_LE(apart, kFrame / 2);
  }
}

TEST(FramePairer, PairsNearestFramesDespiteJitter) {
  std::mt19937 random(7);
  std::uniform_int_distribution<std::int64_t> jitter(-2'000'000, 2'000'000);
  for (const int phase : {-14, -9, 0, 5, 13}) {
    std::vector<Shot> shots;
    for (int i = 1; i < 200; ++i) {
      shots.push_back({0, i * kFrame + jitter(random)});
      shots.push_back({1, i * kFrame + phase * 1'000'000 + jitter(random)});
    }
    shots = in_order(shots);
    FramePairer pairs({kFrame});
    for (const auto& [a, b] : pair_up(pairs, shots).pairs) {
      const std::int64_t at = shots[static_cast<std::size_t>(a)].at;
      const std::int64_t apart = std::abs(at - shots[static_cast<std::size_t>(b)].at);
      for (const Shot& other : shots) {
        if (other.lens != 1) continue;
        EXPECT_LE(apart, std::abs(at - other.at)) << "phase " << phase;
      }
    }
    EXPECT_GE(pairs.counts().pairs, 180U) << "phase " << phase;
  }
}

TEST(FramePairer, AtMostTwoFramesWaitForASilentCamera) {
  FramePairer pairs({kFrame});
  std::vector<Shot> shots;
  for (int i = 0; i < 20; ++i) shots.push_back({0, i * kFrame});
  const Outcome out = pair_up(pairs, shots);
  EXPECT_EQ(out.dropped.size(), 20U - FramePairer::kMaxWaiting);
  EXPECT_EQ(out.dropped.front(), 0) << "the oldest first";
}

TEST(FramePairer, DecreasingTimesAreRefusedAndCounted) {
  FramePairer pairs({kFrame});
  const Outcome out = pair_up(pairs, {{0, 5 * kFrame}, {0, 5 * kFrame}, {0, 4 * kFrame}, {1, 5 * kFrame}});
  EXPECT_EQ(out.dropped, (std::vector<int>{1, 2}));
  EXPECT_EQ(pairs.counts().disordered[0], 2U);
  ASSERT_EQ(out.pairs.size(), 1U);
  EXPECT_EQ(out.pairs[0], std::pair(0, 3));
}

TEST(FramePairer, RestartDiscardsWaitingFramesAndTimes) {
  FramePairer pairs({kFrame});
  (void)pair_up(pairs, {{0, 9 * kFrame}});
  pairs.restart();
  const Outcome out = pair_up(pairs, {{1, kFrame}, {0, kFrame}});
  EXPECT_EQ(out.pairs.size(), 1U);
  EXPECT_TRUE(out.dropped.empty());
}

// ---- alignment of the exposure cycles

TEST(CycleAlignment, AnExposureHasAnIndexIfItIsUnique) {
  const std::vector<double> cycle{0.001, 0.004, 0.016};
  EXPECT_EQ(index_in_cycle(cycle, 0.0041), 1);
  EXPECT_FALSE(index_in_cycle(cycle, 0.002));
  EXPECT_FALSE(index_in_cycle(cycle, std::nan("")));
  EXPECT_FALSE(index_in_cycle(std::vector{0.001, 0.001}, 0.001)) << "ambiguous";
  EXPECT_TRUE(distinct(cycle));
  EXPECT_FALSE(distinct(std::vector{0.001, 0.016, 0.00105}));
  EXPECT_TRUE(distinct(std::vector{0.01}));
}

/// Number of frames until two cameras agree permanently; exposures take effect `delay` frames after the request.
int frames_until_agreed(int size, int offset, int delay) {
  CycleAlignment alignment(size, 2 * delay);
  int next_first = 0, next_second = offset, disagreed = 0;
  std::vector<std::pair<int, int>> asked;
  for (int frame = 0; frame < 200; ++frame) {
    asked.emplace_back(next_first, next_second);
    next_first = (next_first + 1) % size;
    next_second = (next_second + 1) % size;
    if (frame < delay) continue;
    const auto [a, b] = asked[static_cast<std::size_t>(frame - delay)];
    if (a != b) disagreed = frame;
    next_second = (next_second + alignment.observe(a, b)) % size;
  }
  return disagreed + 1;
}

TEST(CycleAlignment, OffsetCamerasAgreeAfterOneCorrection) {
  for (const int size : {2, 3, 8}) {
    for (int offset = 0; offset < size; ++offset) {
      for (const int delay : {1, 4, 9}) EXPECT_LE(frames_until_agreed(size, offset, delay), 2 * delay + 2);
    }
  }
}

}  // namespace
}  // namespace lightwell::libcam
