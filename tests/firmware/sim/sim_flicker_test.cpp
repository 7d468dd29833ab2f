// Tests of the simulated camera with mains flicker: light of each row, closing of the ring, and detection by the
// estimator.
#include <cmath>
#include <cstring>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "camera/backends/sim/frame_ring.hpp"
#include "camera/backends/sim/sim_backend.hpp"
#include "estimate/frames/flicker.hpp"
#include "estimate/panorama/panorama_estimator.hpp"
#include "sim/sensor.hpp"

namespace lightwell {
namespace {

using testing::HasSubstr;

constexpr double kReadout = 60e-6;
constexpr int kWidth = 320, kRows = 240;

sim::Panorama room() {
  return sim::from_function(128, [](Vec3d d) {
    const auto v = static_cast<float>(1 + 0.6 * d.y + 0.3 * std::sin(9 * d.x) * std::cos(7 * d.z));
    return Radiance{v, v, v};
  });
}

/// A rendered ring with the metadata of its frames.
class FlickeringCamera {
 public:
  FlickeringCamera(PixelFormat format, double rate, sim::MainsFlicker flicker, std::vector<double> exposure_s,
                   sim::Motion motion = {})
      : format_(format), rate_(rate), exposure_s_(std::move(exposure_s)) {
    rig_ = *sim::make_rig("pair", kWidth, kRows, format);
    RingRequest request;
    request.frames = 24;
    request.bracket = exposure_s_.size();
    request.switch_period = motion.switch_period_frames;
    request.bytes_per_picture = 2 * picture_bytes(format, packed_stride(format, kWidth), kRows);
    request.periods_per_frame = flicker.hz / rate;
    plan = *plan_moving(request);
    motion.frame_rate = rate;
    motion.cycle_frames = plan.cycle;
    const sim::Scene scene(room(), motion);
    RingSource source;
    source.scene = &scene;
    source.rig = &rig_;
    source.sensor = sim::sensor_of(rig_, format, 1);
    black_ = source.sensor.photometry.black_level;
    source.exposure_s = exposure_s_;
    flicker_ = {plan.periods_per_frame * rate, flicker.depth};
    source.timing = {kReadout, flicker_, rate, format != PixelFormat::rgb_f32};
    ring.render(plan, source, {});
  }

  [[nodiscard]] double exposure(std::uint64_t sequence) const { return exposure_s_[sequence % exposure_s_.size()]; }

  [[nodiscard]] FrameInfo info(std::uint64_t sequence) const {
    FrameInfo out;
    out.sequence = sequence;
    out.exposure_s = exposure(sequence);
    out.row_readout = Duration::from_seconds(kReadout);
    const double exposing = format_ == PixelFormat::rgb_f32 ? 0 : out.exposure_s;
    out.mid_exposure.ns = std::llround((static_cast<double>(sequence) / rate_ - exposing / 2) * 1e9);
    return out;
  }

  /// Mean green value of a row, per second of exposure; for Bayer formats linear, with the black level subtracted.
  [[nodiscard]] double row(std::uint64_t sequence, std::size_t lens, int j) const {
    const auto bytes = ring.view(plan.picture(sequence), lens);
    const std::size_t stride = packed_stride(format_, kWidth) * static_cast<std::size_t>(j);
    double sum = 0;
    int n = 0;
    for (int i = 0; i < kWidth; ++i) {
      double v = 0;
      if (format_ == PixelFormat::rgb_f32) {
        float f = 0;
        std::memcpy(&f, bytes.data() + stride + static_cast<std::size_t>(12 * i + 4), sizeof f);
        v = static_cast<double>(f);
      } else {
        if ((i + j) % 2 == 0) continue;
        std::uint16_t word = 0;
        std::memcpy(&word, bytes.data() + stride + static_cast<std::size_t>(2 * i), sizeof word);
        v = word / 4095.0 - black_;
        if (v < 0.01) continue;
      }
      sum += v;
      ++n;
    }
    return n > 0 ? sum / n / exposure(sequence) : 0;
  }

  [[nodiscard]] Flicker recognised(std::uint64_t frames) const {
    estimate::FlickerDetector detector;
    std::vector<float> light[2];
    for (std::uint64_t s = 0; s < frames; ++s) {
      std::vector<estimate::RowProfile> profiles;
      for (std::size_t lens = 0; lens < 2; ++lens) {
        light[lens].assign(kRows / 8, 0);
        for (int j = 0; j < kRows; ++j)
          light[lens][static_cast<std::size_t>(j / 8)] += static_cast<float>(row(s, lens, j));
        profiles.push_back({light[lens], kRows, 8});
      }
      (void)detector.add(info(s), profiles);
    }
    return detector.state();
  }

  /// The estimator's result after `brackets` brackets.
  [[nodiscard]] Flicker estimated(std::uint64_t brackets) const {
    const auto made = make_panorama_estimator(rig_, {});
    Estimator& estimator = **made;
    Descriptor out;
    const std::uint64_t size = exposure_s_.size();
    for (std::uint64_t first = 0; first < brackets * size; first += size) {
      std::vector<Frame> bracket;
      for (std::uint64_t s = first; s < first + size; ++s) {
        Frame& frame = bracket.emplace_back();
        frame.info = info(s);
        frame.info.bracket_index = static_cast<int>(s - first);
        frame.info.bracket_size = static_cast<int>(size);
        for (int lens = 0; lens < 2; ++lens)
          frame.add_view({lens, format_, kWidth, kRows, packed_stride(format_, kWidth),
                          ring.view(plan.picture(s), static_cast<std::size_t>(lens))});
      }
      const Status status = estimator.estimate(bracket, out);
      if (!status.ok()) ADD_FAILURE() << status.message();
    }
    return out.flicker;
  }

  RingPlan plan;
  FrameRing ring;
  [[nodiscard]] const sim::MainsFlicker& flicker() const { return flicker_; }

 private:
  PixelFormat format_;
  double rate_;
  std::vector<double> exposure_s_;
  RigParameters rig_;
  double black_ = 0;
  sim::MainsFlicker flicker_;
};

TEST(SimFlicker, EachRowHasTheLightOfItsOwnTime) {
  const FlickeringCamera steady(PixelFormat::rgb_f32, 30, {}, {1}), camera(PixelFormat::rgb_f32, 30, {100, 0.3}, {1});
  for (const std::uint64_t s : {0U, 1U, 7U}) {
    for (int j = 10; j < kRows - 10; j += 23) {
      const double t = static_cast<double>(s) / 30 + (j - (kRows - 1) / 2.0) * kReadout;
      EXPECT_NEAR(camera.row(s, 1, j) / steady.row(s, 1, j), camera.flicker().factor(t, 0), 1e-5) << "row " << j;
    }
  }
}

TEST(SimFlicker, AnExposureAveragesAndPrecedesTheFrameTime) {
  const std::vector<double> bracket = {0.0022, 0.0044};
  const FlickeringCamera steady(PixelFormat::bayer_rggb12, 30, {}, bracket);
  const FlickeringCamera camera(PixelFormat::bayer_rggb12, 30, {120, 0.5}, bracket);
  for (const std::uint64_t s : {0U, 1U, 5U}) {
    const double e = bracket[s % 2];
    for (int j = 30; j < kRows - 30; j += 23) {
      const double t = static_cast<double>(s) / 30 - e / 2 + (j - (kRows - 1) / 2.0) * kReadout;
      // Both pictures have 1 % noise per pixel, averaged over 160 pixels.
      EXPECT_NEAR(camera.row(s, 0, j) / steady.row(s, 0, j), camera.flicker().factor(t, e), 0.01) << "row " << j;
    }
  }
}

TEST(SimFlicker, TheRingClosesWithWholePeriods) {
  for (const double rate : {24.0, 25.0, 27.0, 29.97, 30.0, 60.0}) {
    for (const double hz : {100.0, 120.0}) {
      for (const std::uint64_t bracket : {1U, 3U}) {
        RingRequest request;
        request.bracket = bracket;
        request.bytes_per_picture = 1000;
        request.periods_per_frame = hz / rate;
        const RingPlan plan = *plan_moving(request);
        const double periods = plan.periods_per_frame * static_cast<double>(plan.cycle);
        EXPECT_NEAR(periods, std::round(periods), 1e-9);
        EXPECT_EQ(plan.cycle % bracket, 0U);
        EXPECT_LE(plan.cycle, 2 * (32 + bracket));
        // The mains frequency varies by 0.2 Hz, the flicker by twice that.
        EXPECT_NEAR(plan.periods_per_frame * rate, hz, 0.15) << rate << " frames/s";
      }
    }
  }
}

TEST(SimFlicker, IsDetectedDespiteSensorNoise) {
  EXPECT_EQ(FlickeringCamera(PixelFormat::bayer_rggb12, 27, {100, 0.3}, {0.003}).recognised(40), Flicker::hz100);
  EXPECT_EQ(FlickeringCamera(PixelFormat::bayer_rggb12, 27, {120, 0.05}, {0.003}).recognised(40), Flicker::hz120);
  EXPECT_EQ(FlickeringCamera(PixelFormat::bayer_rggb12, 27, {}, {0.003}).recognised(40), Flicker::none);
  EXPECT_EQ(FlickeringCamera(PixelFormat::bayer_rggb12, 30, {120, 0.3}, {0.003}).recognised(40), Flicker::unknown);
  sim::Motion lively;
  lively.turn_rad_per_s = 0.5;
  lively.switch_period_frames = 6;
  EXPECT_EQ(FlickeringCamera(PixelFormat::bayer_rggb12, 27, {100, 0.1}, {0.003}, lively).recognised(40),
            Flicker::hz100);
}

TEST(SimFlicker, IsFoundInTheExposuresOfABracket) {
  const std::vector<double> bracket = {0.001, 0.002, 0.004};
  for (const PixelFormat format : {PixelFormat::rgb8, PixelFormat::nv12, PixelFormat::yuyv, PixelFormat::bayer_rggb8,
                                   PixelFormat::bayer_rggb10, PixelFormat::bayer_rggb12}) {
    SCOPED_TRACE(std::string(to_string(format)));
    EXPECT_EQ(FlickeringCamera(format, 27, {100, 0.2}, bracket).estimated(20), Flicker::hz100);
    EXPECT_EQ(FlickeringCamera(format, 27, {120, 0.2}, bracket).estimated(20), Flicker::hz120);
  }
}

TEST(SimFlicker, IsNotFoundInBracketsOfSteadyLight) {
  const std::vector<double> bracket = {0.001, 0.002, 0.004};
  sim::Motion lively;
  lively.turn_rad_per_s = 0.5;
  lively.switch_period_frames = 6;
  for (const PixelFormat format : {PixelFormat::rgb8, PixelFormat::nv12, PixelFormat::bayer_rggb12}) {
    SCOPED_TRACE(std::string(to_string(format)));
    EXPECT_EQ(FlickeringCamera(format, 27, {}, bracket).estimated(20), Flicker::none);
    for (const std::uint64_t brackets : {10U, 20U, 40U}) {
      const Flicker found = FlickeringCamera(format, 27, {}, bracket, lively).estimated(brackets);
      EXPECT_TRUE(found == Flicker::none || found == Flicker::unknown) << brackets;
    }
  }
}

TEST(SimFlicker, OptionsAreChecked) {
  CameraConfig config{.uri = {}, .width = 64, .height = 48, .frame_rate = 30};
  const auto parsed = [&](const std::string& query) {
    return parse_sim_options(*parse_camera_uri("sim:city?" + query), config);
  };
  const auto message = [&](const std::string& query) {
    EXPECT_EQ(parsed(query).status().code(), StatusCode::invalid_argument) << query;
    return parsed(query).status().message();
  };
  EXPECT_EQ(parsed("flicker=100hz&depth=0.2")->flicker.hz, 100);
  EXPECT_EQ(parsed("flicker=100hz&depth=0.2")->flicker.depth, 0.2);
  EXPECT_EQ(parsed("flicker=120")->flicker.depth, 0.3);
  EXPECT_EQ(parsed("seed=2")->flicker.hz, 0);
  EXPECT_THAT(message("flicker=50V"), HasSubstr("hz"));
  EXPECT_THAT(message("flicker=0hz"), HasSubstr("1000"));
  EXPECT_THAT(message("flicker=100hz&depth=1.5"), HasSubstr("depth"));
  EXPECT_THAT(message("flicker=100hz&depth=x"), HasSubstr("number"));
  EXPECT_THAT(message("depth=0.3"), HasSubstr("flicker=100hz"));
  config.frame_rate = 0;
  EXPECT_THAT(message("flicker=100hz"), HasSubstr("frame_rate"));
}

}  // namespace
}  // namespace lightwell
