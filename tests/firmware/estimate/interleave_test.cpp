// Interleaved sampling (panorama.interleave): constant light is that of whole frames and brackets, changes are read in
// the next one or said by the bound, and nothing drifts.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>

#include "estimate/panorama/run_rotation.hpp"
#include "scenes.hpp"
#include "sim/scene.hpp"
#include "sim/sensor.hpp"

namespace lightwell {
namespace {

using namespace testing_scenes;

constexpr std::int64_t kFrame_ns = 33'333'333;
/// Full scale is a radiance of 0.01 / exposure (firmware/sim/sensor.hpp): 10.
constexpr double kExposure_s = 1e-3;

EstimatorConfig interleaved(int frames) {
  EstimatorConfig config = everything(6);
  config.panorama.smoothing = Smoothing::none;
  config.panorama.interleave = frames;
  return config;
}

/// A room without a lamp: walls, ceiling, a bright window; range 0.2 to 6.
Radiance room(Vec3d d) {
  Radiance l{1, 1, 1};
  if (d.x < -0.7) l = {2, 0.6F, 0.5F};
  if (d.y < -0.6) l = {0.4F, 0.3F, 0.2F};
  if (d.x > 0.8 && d.y > 0) l = {5, 5.5F, 6};
  return l;
}

Radiance plus_lamp(Radiance l, Vec3d d, Vec3d toward, float peak = 8) {
  const double a = angle_between(d, normalized(toward));
  const auto glow = static_cast<float>(peak * std::exp(-a * a / (2 * 0.05 * 0.05)));
  return {std::min(l.r + glow, 9.5F), std::min(l.g + glow, 9.5F), std::min(l.b + glow, 9.5F)};
}

/// One picture of a scene, as frames and brackets with noise of their own.
class Shots {
 public:
  Shots(const RigParameters& rig, PixelFormat format, const RadianceOf& scene) : rig_(rig), format_(format) {
    const sim::Scene panorama(sim::from_function(256, scene));
    for (const LensParameters& lens : rig_.lenses) {
      radiance_.push_back(sim::render_radiance(panorama, panorama.state_at(0), lens, 1));
      sensors_.emplace_back(lens, sim::sensor_of(rig_, format, 1));
    }
  }
  /// `lenses`: bit mask. The frame is valid until the next call.
  const Frame& at(std::int64_t time_ns, std::uint64_t noise, unsigned lenses = 3) {
    return bracket_at(time_ns, noise, std::array{kExposure_s}, lenses).front();
  }
  std::span<const Frame> bracket_at(std::int64_t time_ns, std::uint64_t noise, std::span<const double> exposures_s,
                                    unsigned lenses = 3) {
    bytes_.clear();
    frames_.clear();
    for (std::size_t e = 0; e < exposures_s.size(); ++e) {
      Frame& frame = frames_.emplace_back();
      frame.info.exposure_s = exposures_s[e];
      frame.info.sequence = noise * exposures_s.size() + e;
      frame.info.mid_exposure = {time_ns + static_cast<std::int64_t>(e)};
      frame.info.delivered = frame.info.mid_exposure;
      for (std::size_t k = 0; k < rig_.lenses.size(); ++k) {
        if ((lenses >> k & 1U) == 0) continue;
        const sim::Sensor& sensor = sensors_[k];
        std::vector<std::byte>& pixels = bytes_.emplace_back(sensor.bytes());
        sensor.expose(radiance_[k], {exposures_s[e], 1, frame.info.sequence, static_cast<int>(k)}, pixels);
        frame.add_view(
            {static_cast<int>(k), format_, rig_.lenses[k].width, rig_.lenses[k].height, sensor.stride(), pixels});
      }
    }
    return frames_;
  }

 private:
  RigParameters rig_;
  PixelFormat format_;
  std::vector<sim::Sensor> sensors_;
  std::vector<std::vector<float>> radiance_;
  std::vector<std::vector<std::byte>> bytes_;
  std::vector<Frame> frames_;
};

Descriptor light_of(Estimator& estimator, std::span<const Frame> bracket) {
  Descriptor d;
  const Status s = estimator.estimate(bracket, d);
  EXPECT_TRUE(s.ok()) << s.message();
  return d;
}
Descriptor light_of(Estimator& estimator, const Frame& frame) { return light_of(estimator, std::span(&frame, 1)); }

/// RMS difference of the irradiance relative to that of `truth`.
double difference(const Descriptor& got, const Descriptor& truth) {
  return error_of(got, [&](Vec3d n) { return irradiance_at(truth, vec_cast<float>(n)); });
}

class InterleavedFormats : public testing::TestWithParam<PixelFormat> {};

TEST_P(InterleavedFormats, ConstantLightIsThatOfWholeFrames) {
  const RigParameters rig = rig_of("pair", 320, 240, GetParam());
  Shots shots(rig, GetParam(), [](Vec3d d) { return plus_lamp(room(d), d, {0.3, 0.8, -0.5}); });
  const Descriptor whole = light_of(*estimator_of(rig, interleaved(1)), shots.at(kFrame_ns, 0));
  ASSERT_EQ(whole.lights.size(), 1U);
  for (const int n : {2, 3, 16}) {
    const auto estimator = estimator_of(rig, interleaved(n));
    for (int i = 0; i < 2 * n + 1; ++i) {
      const Descriptor d = light_of(*estimator, shots.at((i + 1) * kFrame_ns, 0));
      // Projections of runs are kept as floats: 1e-6 of the largest coefficient.
      EXPECT_LT(i % 5 == 0 ? difference(d, whole) : 0, 2e-6) << n << " " << i;
      ASSERT_EQ(d.lights.size(), 1U);
      EXPECT_EQ(d.lights[0].direction, whole.lights[0].direction);
      EXPECT_NEAR(d.bound.total, whole.bound.total, 1e-5);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Estimator, InterleavedFormats,
                         testing::Values(PixelFormat::rgb8, PixelFormat::nv12, PixelFormat::yuyv,
                                         PixelFormat::bayer_rggb8));

class InterleavedBrackets : public testing::TestWithParam<PixelFormat> {
 protected:
  /// The lamp's peak is a hundred times what the longest exposure holds.
  static constexpr std::array kExposures_s{1e-5, 1e-4, 1e-3};
  static Radiance with_lamp(Vec3d d) {
    const double a = angle_between(d, normalized(Vec3d{0.3, 0.8, -0.5}));
    return room(d) + Radiance{1, 1, 1} * static_cast<float>(500 * std::exp(-a * a / (2 * 0.05 * 0.05)));
  }
  const RigParameters rig_ = rig_of("pair", 320, 240, GetParam());
};

TEST_P(InterleavedBrackets, ConstantLightIsThatOfWholeBrackets) {
  Shots shots(rig_, GetParam(), with_lamp);
  const Descriptor whole = light_of(*estimator_of(rig_, interleaved(1)), shots.bracket_at(kFrame_ns, 0, kExposures_s));
  ASSERT_EQ(whole.lights.size(), 1U);
  for (const int n : {2, 16}) {
    const auto estimator = estimator_of(rig_, interleaved(n));
    for (int i = 0; i < n + 2; ++i) {
      const Descriptor d = light_of(*estimator, shots.bracket_at((i + 1) * kFrame_ns, 0, kExposures_s));
      EXPECT_LT(i % 5 == 0 ? difference(d, whole) : 0, 2e-6) << n << " " << i;
      ASSERT_EQ(d.lights.size(), 1U);
      EXPECT_EQ(d.lights[0].direction, whole.lights[0].direction);
      EXPECT_NEAR(d.bound.total, whole.bound.total, 1e-5);
      EXPECT_FALSE(d.flags.has(Flag::moved));
    }
  }
}

TEST_P(InterleavedBrackets, AWatchedLampGoesOutAndAChangeIsReadInTheNextBracket) {
  constexpr int kN = 8;
  const auto estimator = estimator_of(rig_, interleaved(kN)), whole = estimator_of(rig_, interleaved(1));
  Shots lit(rig_, GetParam(), with_lamp), unlit(rig_, GetParam(), room),
      dimmed(rig_, GetParam(), [](Vec3d d) { return room(d) * 0.5F; });
  std::int64_t frame = 0;
  const auto next = [&](Shots& shots) {
    ++frame;
    const auto bracket = shots.bracket_at(frame * kFrame_ns, static_cast<std::uint64_t>(frame), kExposures_s);
    const Descriptor got = light_of(*estimator, bracket);
    return std::pair(got, difference(got, light_of(*whole, bracket)));
  };
  for (int i = 0; i < 2 * kN; ++i) (void)next(lit);
  const auto [off, off_error] = next(unlit);
  EXPECT_TRUE(off.lights.empty());
  EXPECT_LT(off_error, off.bound.total);
  for (int i = 0; i < 2 * kN; ++i) (void)next(unlit);
  const auto [first, first_error] = next(dimmed);
  EXPECT_GT(first_error, 0.2) << "most runs are not read yet";
  EXPECT_LT(first_error, first.bound.total);
  EXPECT_TRUE(first.flags.has(Flag::moved));
  EXPECT_LT(next(dimmed).second, 1e-5) << "the next bracket is read whole";
}

TEST_P(InterleavedBrackets, AnotherNumberOfExposuresIsReadWhole) {
  const auto estimator = estimator_of(rig_, interleaved(8)), whole = estimator_of(rig_, interleaved(1));
  Shots before(rig_, GetParam(), room), after(rig_, GetParam(), [](Vec3d d) { return room(d) * 0.5F; });
  for (int i = 1; i < 10; ++i) (void)light_of(*estimator, before.bracket_at(i * kFrame_ns, 0, kExposures_s));
  const auto two = std::span(kExposures_s).last(2), one = std::span(kExposures_s).last(1);
  for (const auto& [exposures, time] : {std::pair(two, 10), std::pair(one, 11)}) {
    Shots& shots = time == 10 ? after : before;
    const auto bracket = shots.bracket_at(time * kFrame_ns, 0, exposures);
    EXPECT_LT(difference(light_of(*estimator, bracket), light_of(*whole, bracket)), 1e-6) << exposures.size();
  }
}

INSTANTIATE_TEST_SUITE_P(Estimator, InterleavedBrackets,
                         testing::Values(PixelFormat::rgb8, PixelFormat::yuyv, PixelFormat::bayer_rggb12));

class Interleaved : public testing::Test {
 protected:
  static constexpr int kN = 8;

  /// The descriptor of the interleaved estimator, and that of one that reads whole frames.
  struct Both {
    Descriptor got, whole;
    [[nodiscard]] double error() const { return difference(got, whole); }
  };
  Both next(Shots& shots, std::int64_t pause_ns = 0, unsigned lenses = 3) {
    time_ns_ += kFrame_ns + pause_ns;
    const Frame& frame = shots.at(time_ns_, ++frame_, lenses);
    return {light_of(*interleaved_, frame), light_of(*whole_, frame)};
  }
  void settle(Shots& shots) {
    for (int i = 0; i < 2 * kN; ++i) (void)next(shots);
  }
  Shots shots(const RadianceOf& scene) const { return {rig_, PixelFormat::rgb8, scene}; }

  RigParameters rig_ = rig_of("pair", 320, 240, PixelFormat::rgb8);
  std::unique_ptr<Estimator> interleaved_ = estimator_of(rig_, interleaved(kN)),
                             whole_ = estimator_of(rig_, interleaved(1));
  std::int64_t time_ns_ = 1'000'000'000;
  std::uint64_t frame_ = 0;
};

TEST_F(Interleaved, NoiseAloneIsNoChange) {
  Shots constant = shots(room);
  settle(constant);
  for (int i = 0; i < 40; ++i) {
    const Both b = next(constant);
    EXPECT_NEAR(b.got.bound.sampling, b.whole.bound.sampling, 1e-5) << "frame " << i << " takes noise for a change";
    EXPECT_LT(b.error(), b.got.bound.noise);
  }
}

TEST_F(Interleaved, ALampThatIsSwitchedOffIsGoneInTheSameFrame) {
  Shots on = shots([](Vec3d d) { return plus_lamp(room(d), d, {0.3, 0.8, -0.5}); }), off = shots(room);
  settle(on);
  ASSERT_EQ(next(on).got.lights.size(), 1U);
  const Both b = next(off);
  EXPECT_TRUE(b.got.lights.empty());
  EXPECT_LT(b.error(), b.got.bound.total);
}

TEST_F(Interleaved, ALampThatMovesIsFollowed) {
  // 30 degrees per second, through the overlap of the lenses, in a room that it does not light.
  const auto lamp_at = [](int frame) {
    const double turn = frame * std::numbers::pi / 180 - 0.35;
    return Vec3d{std::cos(turn), 0.2, std::sin(turn)};
  };
  Shots start = shots([&](Vec3d d) { return plus_lamp(room(d), d, lamp_at(0)); });
  settle(start);
  for (int i = 1; i <= 40; ++i) {
    Shots now = shots([&](Vec3d d) { return plus_lamp(room(d), d, lamp_at(i)); });
    const Both b = next(now);
    EXPECT_LT(b.error(), b.got.bound.total) << "frame " << i;
    EXPECT_LT(b.error(), 5e-3) << "frame " << i;
  }
}

TEST_F(Interleaved, LightThatChangesEverywhereIsReadInTheNextFrame) {
  for (const float factor : {0.98F, 0.7F, 0.1F}) {
    Shots before = shots(room), after = shots([factor](Vec3d d) { return room(d) * factor; });
    settle(before);
    const Both first = next(after), second = next(after);
    EXPECT_GT(first.error(), 0.5 * (1 / factor - 1) * (kN - 1) / kN) << "most runs are not read yet";
    EXPECT_LT(first.error(), first.got.bound.total) << factor;
    EXPECT_TRUE(first.got.flags.has(Flag::moved) || factor > 0.9F) << factor;
    EXPECT_LT(second.error(), 1e-5) << factor << ": the next frame reads everything";
    EXPECT_FALSE(second.got.flags.has(Flag::moved)) << factor;
  }
}

TEST_F(Interleaved, TheBoundHoldsWhileLightMovesAndDims) {
  Shots start = shots([](Vec3d d) { return plus_lamp(room(d), d, {1, 0.6, 0}); });
  settle(start);
  for (int i = 1; i <= 60; ++i) {
    // A lamp that goes around the room, and a room that dims by 2 % a frame at most.
    const double turn = 0.05 * i;
    const auto level = static_cast<float>(1 - 0.3 * std::sin(0.07 * i) * std::sin(0.07 * i));
    Shots now = shots([&](Vec3d d) { return plus_lamp(room(d) * level, d, {std::cos(turn), 0.6, std::sin(turn)}); });
    const Both b = next(now);
    EXPECT_LT(b.error(), b.got.bound.total) << "frame " << i;
  }
}

TEST_F(Interleaved, ALampWithoutIndirectLightIsReadWithinTheRotation) {
  const Vec3d places[] = {{0, 1, 0}, {0, -1, 0},       {-1, 0, 0},       {0, 0, -1},
                          {0, 0, 1}, {-0.5, 0.2, 0.7}, {0.3, -0.6, -0.9}};
  for (const Vec3d& place : places) {
    Shots before = shots(room), after = shots([place](Vec3d d) { return plus_lamp(room(d), d, place); });
    settle(before);
    Both b = next(after);
    for (int i = 1; i < kN; ++i) b = next(after);
    EXPECT_LT(b.error(), 1e-3) << place.x << " " << place.y << " " << place.z;
  }
}

TEST_F(Interleaved, FramesAreWholeAfterAPauseABackwardsClockAndAMissingLens) {
  Shots before = shots(room), after = shots([](Vec3d d) { return room(d) * 0.5F; });
  settle(before);
  EXPECT_LT(next(after, 2'000'000'000).error(), 1e-6) << "a pause";
  settle(before);
  EXPECT_LT(next(after, -1'000'000'000).error(), 1e-6) << "a backwards clock";
  settle(before);
  EXPECT_LT(next(after, -kFrame_ns).error(), 1e-6) << "a clock that stands still";
  settle(before);
  EXPECT_LT(next(after, 0, 1).error(), 1e-6) << "one lens";
  EXPECT_LT(next(after).error(), 1e-6) << "both lenses again";
}

TEST(InterleavedSums, DoNotDriftInTwentyThousandFrames) {
  // Two pictures in turn: every sum changes in each rotation.
  const RigParameters rig = rig_of("equirect", 64, 32, PixelFormat::rgb8);
  Shots shots(rig, PixelFormat::rgb8, room);
  const auto estimator = estimator_of(rig, interleaved(3));
  Descriptor last;
  for (int i = 0; i <= 20'000; ++i)
    last = light_of(*estimator, shots.at((i + 1) * kFrame_ns, static_cast<std::uint64_t>(i / 3 % 2), 1));
  // The last three frames were the first picture.
  EXPECT_LT(difference(last, light_of(*estimator_of(rig, interleaved(1)), shots.at(kFrame_ns, 0, 1))), 2e-6);
}

TEST(RunRotation, ReadsEachRunOnceInARotation) {
  using namespace estimate;
  const RigParameters rig = rig_of("pair", 480, 360, PixelFormat::rgb8);
  const RigTable table = *make_rig_table(rig);
  const BlockLayout layout(table, 8);
  const CellGrid grid = layout.make_grid(table);
  for (const int n : {2, 4, 8, 16}) {
    RunRotation rotation(layout, grid);
    ASSERT_GT(rotation.runs().size(), 100U);
    std::vector<int> times(layout.size());
    std::ptrdiff_t visible = 0;
    Projection projection;
    for (int frame = 0; frame <= n; ++frame) {
      const auto read = rotation.begin_frame(n, {frame * kFrame_ns + 1});
      const auto count = std::ranges::count(read, 1);
      if (frame == 0) {
        visible = count;
        EXPECT_EQ(rotation.changed().size(), rotation.runs().size()) << "the first frame is whole";
        for (std::size_t block = 0; block < layout.size(); ++block) EXPECT_EQ(read[block], grid.solid_angle(block) > 0);
      } else {
        EXPECT_NEAR(static_cast<double>(count) * n / static_cast<double>(visible), 1, 0.3);
        for (std::size_t block = 0; block < times.size(); ++block) times[block] += read[block];
      }
      (void)rotation.finish_frame(projection);
    }
    EXPECT_EQ(std::ranges::count(times, 1), visible) << n;
  }
}

TEST(RunRotation, ReadsWatchedBlocksAloneOfTheirRuns) {
  using namespace estimate;
  const RigParameters rig = rig_of("pair", 480, 360, PixelFormat::rgb8);
  const RigTable table = *make_rig_table(rig);
  const BlockLayout layout(table, 8);
  const CellGrid grid = layout.make_grid(table);
  RunRotation rotation(layout, grid);
  Projection projection;
  (void)rotation.begin_frame(16, {1});
  (void)rotation.finish_frame(projection);
  const auto middle = static_cast<std::uint32_t>(layout.block_of(1, 240, 180));
  const std::uint32_t watched[] = {middle, middle + 1, middle, 0};
  ASSERT_EQ(grid.solid_angle(0), 0) << "the corner of a picture";
  rotation.watch(watched, 0);
  std::ptrdiff_t fewest = static_cast<std::ptrdiff_t>(layout.size());
  for (int frame = 1; frame <= 16; ++frame) {
    const auto read = rotation.begin_frame(16, {frame * kFrame_ns});
    EXPECT_EQ(read[middle] + read[middle + 1], 2);
    EXPECT_EQ(read[0], 0);
    fewest = std::min<std::ptrdiff_t>(fewest, read[middle - 1] + read[middle + 2]);
    (void)rotation.finish_frame(projection);
  }
  EXPECT_EQ(fewest, 0);
}

}  // namespace
}  // namespace lightwell
