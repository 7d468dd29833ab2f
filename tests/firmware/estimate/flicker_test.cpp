#include "estimate/frames/flicker.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "moving_room.hpp"

namespace lightwell::estimate {
namespace {

// 27 frames/s is 3.70 periods of 100 Hz and 4.44 of 120 Hz per frame: both frequencies are observable.
constexpr double kBothObservable_hz = 27;

RoomOptions static_room(double rate, sim::MainsFlicker flicker) {
  RoomOptions options;
  options.frame_rate = rate;
  options.flicker = flicker;
  return options;
}

/// State after one second of frames.
Flicker state_after_one_second(const RoomOptions& options) {
  FlickerDetector detector;
  return count_states(options, static_cast<int>(options.frame_rate), detector).last;
}

TEST(Flicker, MovingBandsShowTheMainsFrequency) {
  for (const double depth : {0.01, 0.05, 0.3, 0.9}) {
    EXPECT_EQ(state_after_one_second(static_room(30, {100, depth})), Flicker::hz100) << depth;
    EXPECT_EQ(state_after_one_second(static_room(25, {120, depth})), Flicker::hz120) << depth;
    EXPECT_EQ(state_after_one_second(static_room(kBothObservable_hz, {100, depth})), Flicker::hz100) << depth;
    EXPECT_EQ(state_after_one_second(static_room(kBothObservable_hz, {120, depth})), Flicker::hz120) << depth;
  }
}

TEST(Flicker, IsDetectedWithinTenFrames) {
  FlickerDetector detector;
  const StateCounts a = count_states(static_room(30, {100, 0.1}), 60, detector);
  EXPECT_LE(a.unknown, 10);
  EXPECT_EQ(a.hz100 + a.unknown, 60);
}

TEST(Flicker, EstimatesTheModulationDepth) {
  for (const double depth : {0.01, 0.1, 0.3}) {
    RoomOptions options = static_room(kBothObservable_hz, {100, depth});
    options.exposure_s = {0.004};
    FlickerDetector detector;
    (void)count_states(options, 60, detector);
    const FlickerEvidence e = detector.evidence(Flicker::hz100);
    // The logarithm of a modulation has harmonics; the amplitude of the first is depth (1 + depth²/8).
    EXPECT_NEAR(e.modulation / depth, 1 + depth * depth / 8, 0.02);
    EXPECT_GT(e.coherence, 0.95);
  }
}

TEST(Flicker, ToleratesMainsFrequencyErrors) {
  for (const double off : {-0.4, -0.25, 0.15, 0.4}) {
    EXPECT_EQ(state_after_one_second(static_room(kBothObservable_hz, {100 + off, 0.05})), Flicker::hz100) << off;
    EXPECT_EQ(state_after_one_second(static_room(kBothObservable_hz, {120 + off, 0.05})), Flicker::hz120) << off;
  }
}

TEST(Flicker, SteadyLightIsNoneWhereBothFrequenciesAreObservable) {
  EXPECT_EQ(state_after_one_second(static_room(kBothObservable_hz, {})), Flicker::none);
  RoomOptions silent = static_room(kBothObservable_hz, {});
  silent.noise = 0;
  EXPECT_EQ(state_after_one_second(silent), Flicker::none) << "identical frames";
  EXPECT_EQ(state_after_one_second(static_room(kBothObservable_hz, {100, 0.002})), Flicker::none)
      << "a modulation of 0.2 % is below the threshold";
}

TEST(Flicker, StaticBandsAreNotReportedAsNone) {
  for (const double rate : {15.0, 20.0, 24.0, 25.0, 30.0, 50.0, 60.0}) {
    const bool observable100 = std::abs(std::remainder(100 / rate, 1.0)) > 0.1;
    const bool observable120 = std::abs(std::remainder(120 / rate, 1.0)) > 0.1;
    FlickerDetector steady, fifty, sixty;
    EXPECT_EQ(count_states(static_room(rate, {}), 60, steady).none, 0) << rate;
    EXPECT_EQ(count_states(static_room(rate, {100, 0.3}), 60, fifty).last,
              observable100 ? Flicker::hz100 : Flicker::unknown)
        << rate;
    EXPECT_EQ(count_states(static_room(rate, {120, 0.3}), 60, sixty).last,
              observable120 ? Flicker::hz120 : Flicker::unknown)
        << rate;
    EXPECT_EQ(steady.evidence(Flicker::hz100).observable, observable100) << rate;
    EXPECT_EQ(steady.evidence(Flicker::hz120).observable, observable120) << rate;
  }
}

TEST(Flicker, ExposuresOfWholePeriodsAreUnknown) {
  RoomOptions options = static_room(kBothObservable_hz, {100, 0.5});
  options.exposure_s = {0.01};
  EXPECT_EQ(state_after_one_second(options), Flicker::unknown);
  options.flicker = {};
  EXPECT_EQ(state_after_one_second(options), Flicker::unknown) << "100 Hz is not observable";
  options.flicker = {120, 0.05};
  EXPECT_EQ(state_after_one_second(options), Flicker::hz120) << "120 Hz is observable with 10 ms";
  options.exposure_s = {1.0 / 120};
  EXPECT_EQ(state_after_one_second(options), Flicker::unknown);
}

TEST(Flicker, VaryingExposuresShowStaticBands) {
  // At 30 frames/s, the bands of 120 Hz are the same in each frame, but 8 ms average them out and 2 ms do not.
  RoomOptions options = static_room(30, {120, 0.05});
  options.exposure_s = {0.008, 0.002};
  EXPECT_EQ(state_after_one_second(options), Flicker::hz120);
  options.flicker = {};
  EXPECT_EQ(state_after_one_second(options), Flicker::none);
  for (const double mismatch : {0.01, 0.02, 0.05, 0.1}) {
    // Errors of the response between two exposures cause a pattern, too, but no sinusoid of this period.
    options.mismatch = mismatch;
    FlickerDetector detector;
    const StateCounts a = count_states(options, 120, detector);
    EXPECT_EQ(a.hz100 + a.hz120, 0) << mismatch;
  }
}

TEST(Flicker, ReadoutWithinOnePeriodIsUnknown) {
  RoomOptions options = static_room(kBothObservable_hz, {100, 0.3});
  options.readout_s = 15e-6;  // 7.2 ms
  EXPECT_EQ(state_after_one_second(options), Flicker::unknown);
}

TEST(Flicker, GlobalShutterNeedsVaryingExposures) {
  for (const double hz : {100.0, 120.0}) {
    RoomOptions options = static_room(kBothObservable_hz, {hz, 0.05});
    options.readout_s = 0;
    FlickerDetector one, two, steady;
    EXPECT_EQ(count_states(options, 60, one).last, Flicker::unknown);
    options.exposure_s = {0.01, 0.002};
    EXPECT_EQ(count_states(options, 60, two).last, hz == 100 ? Flicker::hz100 : Flicker::hz120);
    options.flicker = {};
    EXPECT_EQ(count_states(options, 60, steady).last, Flicker::none);
  }
}

/// Rooms with rotation, tilting, walking people and switched lamps, separately and together.
std::vector<RoomOptions> moving_rooms() {
  std::vector<RoomOptions> all;
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> even(0, 1);
  constexpr double kRates[] = {27, 30, 25, 24, 50, 15, 33.3, 28.5};
  for (int i = 0; i < 24; ++i) {
    RoomOptions o;
    o.seed = static_cast<std::uint64_t>(i) + 1;
    o.frame_rate = kRates[i % 8];
    o.noise = std::pow(10, -3.5 + 1.5 * even(random));
    if (i % 2 == 0) o.yaw_rad_per_s = 4 * even(random) * even(random);
    if (i % 3 == 0) o.tilt_rad = 0.5 * even(random), o.tilt_hz = 10 * even(random) * even(random);
    if (i % 4 < 3) o.person_rad_per_s = 2 * even(random) - 1;
    if (i % 5 == 0) o.lamp_period_s = 0.2 + 2 * even(random);
    if (i % 6 == 0) o.exposure_s = {0.01, 0.002};
    if (i % 7 == 0) o.readout_s = 0;
    all.push_back(o);
  }
  return all;
}

TEST(Flicker, MotionCausesNoFalseAlarm) {
  int frames = 0, alarms = 0;
  for (const RoomOptions& options : moving_rooms()) {
    FlickerDetector detector;
    const StateCounts a = count_states(options, 150, detector);
    alarms += a.hz100 + a.hz120;
    frames += 150;
  }
  EXPECT_EQ(alarms, 0) << "of " << frames;
}

TEST(Flicker, ModulationOfOneFortiethIsNeverReportedAsNone) {
  int reported_none = 0, wrong = 0, right = 0;
  bool fifty = false;
  for (RoomOptions options : moving_rooms()) {
    fifty = !fifty;
    options.flicker = {fifty ? 99.8 : 120.1, 0.025};
    FlickerDetector detector;
    const StateCounts a = count_states(options, 100, detector);
    reported_none += a.none;
    wrong += fifty ? a.hz120 : a.hz100;
    right += fifty ? a.hz100 : a.hz120;
  }
  EXPECT_EQ(reported_none, 0);
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(right, 100) << "too few detections";
}

TEST(Flicker, IsDetectedDuringMotionAndSwitching) {
  const auto share = [](RoomOptions options) {
    options.frame_rate = kBothObservable_hz;
    options.flicker = {100, 0.05};
    FlickerDetector detector;
    return count_states(options, 150, detector).hz100 / 150.0;
  };
  RoomOptions person, turn, lamp;
  person.person_rad_per_s = 0.7;
  turn.yaw_rad_per_s = 0.5;
  lamp.lamp_period_s = 1;
  EXPECT_GT(share(person), 0.9);
  EXPECT_GT(share(turn), 0.9);
  EXPECT_GT(share(lamp), 0.9);
}

TEST(Flicker, DetectionLimitDependsOnNoise) {
  // With 120 groups and 32 pairs, a depth of half the noise of one group in one frame is detected.
  for (const double noise : {0.01, 0.03, 0.06}) {
    RoomOptions options = static_room(kBothObservable_hz, {100, 0.5 * noise});
    options.noise = noise;
    FlickerDetector flickering, steady;
    EXPECT_GT(count_states(options, 90, flickering).hz100, 45) << noise;
    options.flicker = {};
    const StateCounts a = count_states(options, 90, steady);
    EXPECT_EQ(a.hz100 + a.hz120, 0);
    EXPECT_EQ(a.last, Flicker::none) << noise;
  }
  RoomOptions options = static_room(kBothObservable_hz, {});
  options.noise = 0.2;
  FlickerDetector detector;
  EXPECT_EQ(count_states(options, 90, detector).none, 0) << "a modulation of 2 % is not observable in this noise";
}

TEST(Flicker, IgnoresInvalidRowGroups) {
  MovingRoom room(static_room(kBothObservable_hz, {100, 0.1}));
  FlickerDetector partly, blind;
  std::vector<float> holes, nothing(MovingRoom::kGroups, std::numeric_limits<float>::quiet_NaN());
  for (int i = 0; i < 30; ++i) {
    room.step();
    auto profiles = room.profiles();
    holes.assign(profiles[0].radiance.begin(), profiles[0].radiance.end());
    for (std::size_t g = 20; g < 26; ++g) holes[g] = g % 2 == 0 ? std::numeric_limits<float>::quiet_NaN() : -1;
    profiles[0].radiance = holes;
    (void)partly.add(room.info, profiles);
    profiles[0].radiance = profiles[1].radiance = nothing;
    EXPECT_EQ(blind.add(room.info, profiles), Flicker::unknown);
  }
  EXPECT_EQ(partly.state(), Flicker::hz100);
}

TEST(Flicker, RecoversFromGapsAndClockJumps) {
  MovingRoom room(static_room(kBothObservable_hz, {100, 0.1}));
  FlickerDetector detector;
  const auto add_frame = [&](std::int64_t shift_ns) {
    room.step();
    FrameInfo info = room.info;
    info.mid_exposure.ns += shift_ns;
    return detector.add(info, room.profiles());
  };
  const auto add_frames = [&](std::int64_t shift_ns) {
    Flicker last = Flicker::unknown;
    for (int i = 0; i < 30; ++i) last = add_frame(shift_ns);
    return last;
  };
  EXPECT_EQ(add_frames(0), Flicker::hz100);
  constexpr std::int64_t kHour = 3'600'000'000'000;
  EXPECT_EQ(add_frame(kHour), Flicker::unknown) << "frames from an hour ago must not count";
  EXPECT_EQ(add_frames(kHour), Flicker::hz100);
  EXPECT_EQ(add_frame(-kHour), Flicker::unknown);
  EXPECT_EQ(add_frames(-kHour), Flicker::hz100);
  FrameInfo stuck = room.info;
  for (int i = 0; i < 100; ++i) (void)detector.add(stuck, room.profiles());
  EXPECT_EQ(add_frames(0), Flicker::hz100);
  stuck.mid_exposure.ns = std::numeric_limits<std::int64_t>::max();
  (void)detector.add(stuck, room.profiles());
  stuck.mid_exposure.ns = std::numeric_limits<std::int64_t>::min();
  (void)detector.add(stuck, room.profiles());
  EXPECT_EQ(detector.state(), Flicker::unknown);
}

TEST(Flicker, IgnoresInvalidProfiles) {
  FlickerDetector detector;
  FrameInfo info;
  info.exposure_s = 0.002;
  EXPECT_EQ(detector.add(info, {}), Flicker::unknown);
  const std::vector<float> many(kMaxRowGroups + 1, 1.0F), few(3, 1.0F);
  const RowProfile tall{many, 4000, 8}, tiny{few, 3, 1};
  EXPECT_EQ(detector.add(info, std::span(&tall, 1)), Flicker::unknown);
  for (int i = 0; i < 100; ++i) {
    info.mid_exposure.ns += 37'000'000;
    EXPECT_EQ(detector.add(info, std::span(&tiny, 1)), Flicker::unknown);
  }
  info.exposure_s = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(detector.add(info, std::span(&tiny, 1)), Flicker::unknown);
}

}  // namespace
}  // namespace lightwell::estimate
