// Tests of the simulated camera: frames, metadata, and ground truth.
#include "camera/backends/sim/sim_backend.hpp"

#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <stop_token>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/equirect.hpp>

#include "imaging/uri.hpp"
#include "support/temp_dir.hpp"

namespace lightwell {
namespace {

using testing::HasSubstr;

/// Radiance of the lamp as decoded from RGBE: mantissa (128 + 0.5) / 256 (Ward 1991), times 16.
constexpr double kLamp = 128.5 / 256 * 16;

/// A Radiance HDR file with grey of radiance 0.5 and a lamp at +X.
class SceneFile {
 public:
  SceneFile() {
    constexpr int kWidth = 64, kHeight = 32;
    std::string text = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 32 +X 64\n";
    for (int j = 0; j < kHeight; ++j) {
      for (int i = 0; i < kWidth; ++i) {
        const bool lamp = equirect_direction((i + 0.5) / kWidth, (j + 0.5) / kHeight).x > 0.95;
        text += {'\x80', '\x80', '\x80', lamp ? '\x84' : '\x80'};
      }
    }
    path_ = folder_.write("scene.hdr", text);
  }
  [[nodiscard]] std::string uri(const std::string& query) const {
    return "sim:" + path_ + (query.empty() ? "" : "?" + query);
  }

 private:
  test::TempDir folder_;
  std::string path_;
};

/// Holds all frames until they are taken.
class HoldingSink : public FrameSink {
 public:
  void push(Frame frame) override {
    const std::lock_guard lock(mutex_);
    ++pushed_;
    frames_.push_back(std::move(frame));
    if (frames_.size() > keep_) frames_.erase(frames_.begin());
    came_.notify_all();
  }
  void keep(std::size_t frames) {
    const std::lock_guard lock(mutex_);
    keep_ = frames;
    if (frames_.size() > keep_) frames_.resize(keep_);
  }
  /// Waits until `pushed` frames in total have come; false after five seconds.
  [[nodiscard]] bool wait_for(int pushed) {
    std::unique_lock lock(mutex_);
    return came_.wait_for(lock, std::chrono::seconds(5), [&] { return pushed_ >= pushed; });
  }
  [[nodiscard]] std::vector<Frame> take() {
    const std::lock_guard lock(mutex_);
    return std::move(frames_);
  }
  [[nodiscard]] int pushed() {
    const std::lock_guard lock(mutex_);
    return pushed_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable came_;
  std::vector<Frame> frames_;
  std::size_t keep_ = 1000;
  int pushed_ = 0;
};

class SimBackendTest : public testing::Test {
 protected:
  Result<std::unique_ptr<CameraBackend>> make(const std::string& query) {
    const Result<CameraUri> uri = parse_camera_uri(file.uri(query));
    if (!uri) return uri.status();
    return make_sim_backend(*uri, config);
  }
  std::unique_ptr<CameraBackend> made(const std::string& query) {
    Result<std::unique_ptr<CameraBackend>> camera = make(query);
    EXPECT_TRUE(camera.ok()) << camera.status().message();
    return std::move(*camera);
  }

  SceneFile file;
  CameraConfig config{.uri = {}, .width = 64, .height = 48, .frame_rate = 200};
};

TEST_F(SimBackendTest, OpenReturnsTheRigAndTheFrameProperties) {
  const auto camera = made("sensor=nv12");
  EXPECT_EQ(camera->state(), CameraBackend::State::idle);
  const Result<CameraInfo> info = camera->open();
  ASSERT_TRUE(info.ok()) << info.status().message();
  EXPECT_EQ(info->width, 64);
  EXPECT_EQ(info->height, 48);
  EXPECT_EQ(info->format, PixelFormat::nv12);
  EXPECT_EQ(info->lenses, 2);
  EXPECT_EQ(info->frame_rate, 200);
  ASSERT_TRUE(info->calibration);
  EXPECT_TRUE(info->calibration->validate().ok());
  ASSERT_EQ(info->exposure_s.size(), 1U);
  // The 99th percentile of luminance is that of the lamp. Radiance 1 gives full scale in 10 ms; the target of 95 % of
  // the saturation value 0.98 is 0.95 * 0.955 in linear light.
  EXPECT_NEAR(info->exposure_s[0], 0.95 * 0.955 * 0.01 / kLamp, 2e-5);
}

TEST_F(SimBackendTest, AnEquirectangularPictureIsMadeTwiceAsWideAsHigh) {
  const auto camera = made("rig=equirect");
  const Result<CameraInfo> info = camera->open();
  ASSERT_TRUE(info.ok()) << info.status().message();
  EXPECT_EQ(info->width, 64);
  EXPECT_EQ(info->height, 32);
  EXPECT_EQ(info->lenses, 1);
}

TEST_F(SimBackendTest, FramesHaveBracketIndexAndTime) {
  config.capture.exposure_s = {0.0001, 0.001, 0.004};
  const auto camera = made("sensor=rgb8&row_readout=20us");
  ASSERT_TRUE(camera->open().ok());
  HoldingSink sink;
  sink.keep(6);
  ASSERT_TRUE(camera->start(sink).ok());
  EXPECT_EQ(camera->state(), CameraBackend::State::streaming);
  EXPECT_TRUE(sink.wait_for(12));
  camera->stop();
  EXPECT_EQ(camera->state(), CameraBackend::State::idle);
  const std::vector<Frame> frames = sink.take();
  ASSERT_EQ(frames.size(), 6U);
  const Duration first_due_after = Duration::from_seconds(frames[0].info.exposure_s / 2 + 24 * 20e-6);
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const FrameInfo& info = frames[k].info;
    EXPECT_EQ(info.bracket_size, 3);
    EXPECT_EQ(info.bracket_index, static_cast<int>(info.sequence % 3));
    EXPECT_EQ(info.exposure_s, config.capture.exposure_s[info.sequence % 3]);
    EXPECT_EQ(info.row_readout.ns, 20000);
    // Delivered at the scheduled time or later; late delivery does not shift the exposure.
    const Duration due_after = Duration::from_seconds(info.exposure_s / 2 + 24 * 20e-6);
    EXPECT_GE((info.delivered - info.mid_exposure).ns, due_after.ns);
    const Duration since_first = info.mid_exposure + due_after - (frames[0].info.mid_exposure + first_due_after);
    const auto ticks = static_cast<double>(info.sequence - frames[0].info.sequence);
    EXPECT_NEAR(since_first.seconds(), ticks / 200, 1e-8) << "rounded to nanoseconds";
    if (k > 0) {
      EXPECT_GT(info.sequence, frames[k - 1].info.sequence);
    }
    ASSERT_EQ(frames[k].views().size(), 2U);
    EXPECT_EQ(frames[k].views()[1].lens, 1);
    EXPECT_EQ(frames[k].views()[1].data.size(), 64U * 48 * 3);
  }
}

TEST_F(SimBackendTest, ALongExposureLowersTheRate) {
  config.capture.exposure_s = {0.001, 0.04};
  const auto camera = made("sensor=rgb8");
  const Result<CameraInfo> info = camera->open();
  ASSERT_TRUE(info.ok());
  EXPECT_NEAR(info->frame_rate, 25, 1e-9);
}

TEST_F(SimBackendTest, FollowsTheClock) {
  const auto camera = made("");
  ASSERT_TRUE(camera->open().ok());
  HoldingSink sink;
  sink.keep(1);
  ASSERT_TRUE(camera->start(sink).ok());
  EXPECT_TRUE(sink.wait_for(2));
  const std::vector<Frame> first = sink.take();
  ASSERT_FALSE(first.empty());
  EXPECT_TRUE(sink.wait_for(60));
  const std::vector<Frame> last = sink.take();
  camera->stop();
  ASSERT_FALSE(last.empty());
  const double passed = (last.back().info.delivered - first.back().info.delivered).seconds();
  const auto ticks = static_cast<double>(last.back().info.sequence - first.back().info.sequence);
  // On a loaded machine each delivery may be late; the ticks do not drift, because late ones are skipped.
  EXPECT_NEAR(passed, ticks / 200, 0.05);
}

TEST_F(SimBackendTest, HeldFramesAreUnchangedAndTheSequenceShowsTheLoss) {
  const auto camera = made("sensor=rgb8&yaw_rate=30deg/s&frames=8");
  ASSERT_TRUE(camera->open().ok());
  HoldingSink sink;
  ASSERT_TRUE(camera->start(sink).ok());
  const int limit = required_buffer_count(1);
  EXPECT_TRUE(sink.wait_for(limit));
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(sink.pushed(), limit) << "no more than may be lent";
  std::vector<Frame> held = sink.take();
  const std::uint64_t before = held.back().info.sequence;
  const auto first = held[0].views()[0].data;
  const std::vector<std::byte> copy(first.begin(), first.end());
  held.resize(1);
  EXPECT_TRUE(sink.wait_for(limit + 1));
  camera->stop();
  const std::vector<Frame> later = sink.take();
  ASSERT_FALSE(later.empty());
  EXPECT_GT(later[0].info.sequence, before + 5) << "a pause of 100 ms at 200 frames/s must leave a gap";
  EXPECT_TRUE(std::equal(first.begin(), first.end(), copy.begin(), copy.end()));
}

TEST_F(SimBackendTest, SequenceContinuesAfterARestart) {
  const auto camera = made("");
  ASSERT_TRUE(camera->open().ok());
  HoldingSink sink;
  sink.keep(1);
  std::uint64_t last = 0;
  for (int round = 1; round <= 3; ++round) {
    ASSERT_TRUE(camera->start(sink).ok());
    EXPECT_FALSE(camera->start(sink).ok()) << "it is already running";
    EXPECT_TRUE(sink.wait_for(sink.pushed() + 3));
    camera->stop();
    const std::vector<Frame> frames = sink.take();
    ASSERT_FALSE(frames.empty());
    EXPECT_GT(frames.back().info.sequence, last);
    last = frames.back().info.sequence;
  }
}

TEST_F(SimBackendTest, WithoutAFrameRateWaitsOnlyForFreeBuffers) {
  config.frame_rate = 0;
  const auto camera = made("");
  ASSERT_TRUE(camera->open().ok());
  HoldingSink sink;
  sink.keep(2);
  ASSERT_TRUE(camera->start(sink).ok());
  EXPECT_TRUE(sink.wait_for(500));
  camera->stop();
  const std::vector<Frame> frames = sink.take();
  EXPECT_EQ(frames.back().info.sequence + 1, static_cast<std::uint64_t>(sink.pushed()))
      << "without ticks there must be no gaps";
}

/// Has space for a given number of frames, and counts frames pushed beyond that.
class LimitedSink final : public FrameSink {
 public:
  explicit LimitedSink(int room) : room_(room) {}
  void push(Frame /*frame*/) override {
    const std::lock_guard lock(mutex_);
    (--room_ >= 0 ? pushed : excess) += 1;
    full_.notify_all();
  }
  [[nodiscard]] bool wait_for_space(std::stop_token stop) override {
    std::unique_lock lock(mutex_);
    return full_.wait(lock, stop, [this] {
      waiting_ |= room_ <= 0;
      full_.notify_all();
      return room_ > 0;
    });
  }
  /// Waits until the camera waits for space; false after five seconds.
  [[nodiscard]] bool camera_waits() {
    std::unique_lock lock(mutex_);
    return full_.wait_for(lock, std::chrono::seconds(5), [this] { return waiting_; });
  }

  int pushed = 0, excess = 0;  ///< Valid after the camera has stopped.

 private:
  std::mutex mutex_;
  std::condition_variable_any full_;
  int room_;
  bool waiting_ = false;
};

TEST_F(SimBackendTest, WithoutAFrameRateWaitsForSpaceInTheSink) {
  config.frame_rate = 0;
  const auto camera = made("");
  ASSERT_TRUE(camera->open().ok());
  LimitedSink sink(5);
  ASSERT_TRUE(camera->start(sink).ok());
  EXPECT_TRUE(sink.camera_waits());
  camera->stop();
  EXPECT_EQ(sink.pushed, 5);
  EXPECT_EQ(sink.excess, 0);
}

TEST_F(SimBackendTest, EveryFrameEqualsTheGroundTruth) {
  // Equirectangular lens and ideal sensor: each value is the mean radiance of the scene over a pixel.
  const auto camera = made("rig=equirect&yaw_rate=300deg/s&lamp_switch=20ms&frames=16");
  ASSERT_TRUE(camera->open().ok());
  const auto& sim = dynamic_cast<const SimBackend&>(*camera);
  EXPECT_FALSE(sim.sanitize_counts().any());
  HoldingSink sink;
  sink.keep(3);
  ASSERT_TRUE(camera->start(sink).ok());
  int on = 0, off = 0, target = 0;
  while (on == 0 || off == 0) {
    target += 3;
    ASSERT_TRUE(sink.wait_for(target));
    for (const Frame& frame : sink.take()) {
      const sim::SceneState state = sim.scene().state_at(sim.scene_index(frame.info.sequence));
      (state.lamp_factor < 1 ? off : on) += 1;
      // Direction of the lamp in the rotated probe frame.
      const Vec3d lamp = rotate(state.rotation_world_probe.inverse(), Vec3d{1, 0, 0});
      const EquirectUv uv = equirect_uv(lamp);
      const auto x = static_cast<std::size_t>(uv.u * 64), y = static_cast<std::size_t>(uv.v * 32);
      float red = 0;
      std::memcpy(&red, frame.views()[0].data.data() + 12 * (y * 64 + x), sizeof red);
      EXPECT_NEAR(static_cast<double>(red), kLamp * state.lamp_factor, 1e-5);
    }
  }
  camera->stop();
}

TEST_F(SimBackendTest, ARollingShutterShearsAMovingScene) {
  // 10 ms from the top row to the bottom row at 600 degrees/s: 6 degrees, one pixel.
  const auto picture = [&](const std::string& readout) {
    const auto camera = made("rig=equirect&yaw_rate=600deg/s&frames=16&row_readout=" + readout);
    EXPECT_TRUE(camera->open().ok());
    HoldingSink sink;
    EXPECT_TRUE(camera->start(sink).ok());
    EXPECT_TRUE(sink.wait_for(4));
    camera->stop();
    const Frame frame = std::move(sink.take()[3]);
    EXPECT_EQ(frame.info.sequence % 16, 3U);
    const auto data = frame.views()[0].data;
    return std::vector<std::byte>(data.begin(), data.end());
  };
  config.frame_rate = 20;
  const auto global = picture("0us"), rolling = picture("300us");
  const auto row_differs = [&](std::size_t row) {
    return std::memcmp(&global[row * 768], &rolling[row * 768], 768) != 0;
  };
  EXPECT_TRUE(row_differs(12) && row_differs(19)) << "above and below the centre row";
}

TEST_F(SimBackendTest, ParametersAreCheckedByName) {
  const auto message = [&](const std::string& query) {
    const auto camera = make(query);
    EXPECT_EQ(camera.status().code(), StatusCode::invalid_argument) << query;
    return camera.status().message();
  };
  EXPECT_THAT(message("sensr=rgb8"), HasSubstr("sensor"));
  EXPECT_THAT(message("sensor=rgb9"), HasSubstr("rgb_f32"));
  EXPECT_THAT(message("yaw_rate=30deg"), HasSubstr("deg/s"));
  EXPECT_THAT(message("lamp_switch=1min"), HasSubstr("ms"));
  EXPECT_THAT(message("frames=0"), HasSubstr("frames"));
  EXPECT_THAT(message("frames=-3"), HasSubstr("frames"));
  EXPECT_THAT(message("exposure=1ms,0s"), HasSubstr("above zero"));
  EXPECT_THAT(message("exposure=1ms,2ms,3ms,4ms,5ms,6ms,7ms,8ms,9ms"), HasSubstr("8"));
  EXPECT_THAT(message("gain=0"), HasSubstr("gain: 0"));
  config.capture.exposure_s = {0.01};
  EXPECT_THAT(message("exposure=1ms"), HasSubstr("leave one of them out"));
  config.capture = {.white_balance_k = 5000};
  EXPECT_THAT(message(""), HasSubstr("camera.white_balance_k"));
}

TEST_F(SimBackendTest, FormerNamesOfParametersAreAcceptedWithANote) {
  const auto camera = made("turn=30deg/s&switch=20ms&ring=8&readout=20us&sensor=rgb8");
  const Result<CameraInfo> info = camera->open();
  ASSERT_TRUE(info.ok()) << info.status().message();
  for (const char* name : {"yaw_rate", "lamp_switch", "frames", "row_readout"})
    EXPECT_THAT(info->notes, ::testing::Contains(HasSubstr("is now called '" + std::string(name) + "'")));
  const Result<SimOptions> options =
      parse_sim_options(*parse_camera_uri(file.uri("turn=1rad/s&switch=2s&ring=8&readout=20us")), config);
  EXPECT_EQ(options->yaw_rate_rad_per_s, 1);
  EXPECT_EQ(options->lamp_switch_s, 2);
  EXPECT_EQ(options->frames, 8U);
}

TEST_F(SimBackendTest, OpenErrorsStateTheReason) {
  const auto failure = [&](const std::string& text) {
    Result<std::unique_ptr<CameraBackend>> camera = make_sim_backend(*parse_camera_uri(text), config);
    EXPECT_TRUE(camera.ok());
    return (*camera)->open().status();
  };
  EXPECT_EQ(failure("sim:/nowhere/room.hdr").code(), StatusCode::not_found);
  EXPECT_EQ(failure("sim:cty").code(), StatusCode::invalid_argument);
  EXPECT_THAT(failure(file.uri("rig=pear")).message(), HasSubstr("'pair'"));
  HoldingSink sink;
  EXPECT_EQ(made("")->start(sink).code(), StatusCode::failed_precondition) << "not open";
}

TEST(SimOptions, UnitsAreUnderstood) {
  EXPECT_NEAR(*uri_duration_s("1.5ms"), 0.0015, 1e-18);
  EXPECT_NEAR(*uri_duration_s("20us"), 20e-6, 1e-18);
  EXPECT_EQ(*uri_duration_s("2"), 2);
  EXPECT_EQ(*uri_duration_s("0s"), 0);
  EXPECT_FALSE(uri_duration_s("-1s").ok());
  EXPECT_FALSE(uri_duration_s("").ok());
  EXPECT_FALSE(uri_duration_s("nan").ok());
  EXPECT_NEAR(*parse_yaw_rate_rad_per_s("180deg/s"), 3.14159265358979, 1e-13);
  EXPECT_NEAR(*parse_yaw_rate_rad_per_s("-0.5rad/s"), -0.5, 1e-15);
  EXPECT_NEAR(*parse_yaw_rate_rad_per_s("90"), 1.5707963267949, 1e-12);
}

TEST(RingPlan, AMovingSceneHasWholeBracketsAndPeriods) {
  RingRequest request;
  request.frames = 32;
  request.bracket = 3;
  request.bytes_per_picture = 1000;
  EXPECT_EQ(plan_moving(request)->cycle, 33U);
  request.switch_period = 10;
  EXPECT_EQ(plan_moving(request)->cycle, 60U);
}

TEST(RingPlan, MemoryShortensTheRingButNotBelowABracket) {
  RingRequest request;
  request.frames = 32;
  request.bracket = 3;
  request.switch_period = 10;
  request.bytes_per_picture = 100;
  request.memory_cap = 2000;
  const Result<RingPlan> plan = plan_moving(request);
  ASSERT_TRUE(plan.ok());
  EXPECT_EQ(plan->cycle, 18U);
  EXPECT_EQ(plan->switch_period, 9U) << "the cycle must contain both states of the lamps";
  EXPECT_EQ(plan->wanted, 60U);
  request.memory_cap = 299;
  EXPECT_EQ(plan_moving(request).status().code(), StatusCode::resource_exhausted);
  EXPECT_EQ(plan_still(request).status().code(), StatusCode::resource_exhausted);
}

TEST(RingPlan, AStaticSceneNeedsOnlyNoise) {
  RingRequest request;
  request.frames = 1000;
  request.bracket = 2;
  request.bytes_per_picture = 100;
  EXPECT_EQ(plan_still(request)->pictures(), 8U);
  request.switch_period = 30;
  const RingPlan plan = *plan_still(request);
  EXPECT_EQ(plan.pictures(), 16U);
  for (std::uint64_t sequence = 0; sequence < 200; ++sequence) {
    const std::uint64_t picture = plan.picture(sequence);
    EXPECT_LT(picture, 16U);
    EXPECT_EQ(picture % 2, sequence % 2) << "the exposure must be that of its bracket index";
    EXPECT_EQ(plan.scene_index_of_picture(picture) / 30, plan.scene_index(sequence) / 30)
        << "the state of the lamps must be the same";
  }
}

}  // namespace
}  // namespace lightwell
