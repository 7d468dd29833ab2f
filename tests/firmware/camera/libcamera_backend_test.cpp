// Tests of make_lens_backend() with simulated cameras and ground truth: conformance suite, exposures, pairs,
// disconnections.
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "camera/backends/libcamera/lens.hpp"
#include "camera/conformance/conformance.hpp"
#include "camera/conformance/session.hpp"
#include "firmware/camera/simulated_lens.hpp"

namespace lightwell::libcam {
namespace {

using conformance::BackendUnderTest;
using conformance::RecordingSink;
using ::testing::HasSubstr;
using State = CameraBackend::State;
using Cameras = std::vector<std::shared_ptr<SimulatedCamera>>;

std::unique_ptr<CameraBackend> backend_on(const Cameras& cameras, const std::vector<double>& exposure_s) {
  LibcameraOptions options;
  options.frame_rate = 1e6 / static_cast<double>(cameras[0]->options().interval.count());
  options.capture.exposure_s = exposure_s;
  auto mailbox = std::make_shared<Mailbox>();
  std::vector<std::unique_ptr<Lens>> lenses;
  for (const auto& camera : cameras)
    lenses.push_back(std::make_unique<SimulatedLens>(camera, static_cast<int>(lenses.size()), mailbox));
  return make_lens_backend(std::move(options), std::move(lenses), std::move(mailbox));
}

Cameras one(SimulatedCameraOptions options) { return {std::make_shared<SimulatedCamera>(std::move(options))}; }

Cameras pair(SimulatedCameraOptions options, std::chrono::microseconds phase) {
  Cameras both = one(options);
  options.id = "other";
  options.phase = phase;
  both.push_back(std::make_shared<SimulatedCamera>(options));
  return both;
}

SimulatedCameraOptions saying(bool says, int interval_us = 10'000) {
  SimulatedCameraOptions o;
  o.reports_exposure = says;
  o.interval = std::chrono::microseconds(interval_us);
  return o;
}

const std::vector<double> kSingle{0.002}, kBracket{0.0005, 0.002, 0.008};

// ---- the suite

BackendUnderTest under_test(const std::string& name, const std::function<Cameras()>& plugged,
                            const std::vector<double>& exposure_s) {
  // The cameras of the newest backend, for `disconnect`.
  auto newest = std::make_shared<Cameras>();
  BackendUnderTest camera;
  camera.name = name;
  camera.make = [=]() -> Result<std::unique_ptr<CameraBackend>> {
    *newest = plugged();
    return backend_on(*newest, exposure_s);
  };
  camera.disconnect = [newest] { newest->back()->unplug(); };
  return camera;
}

std::vector<BackendUnderTest> backends() {
  using namespace std::chrono_literals;
  return {
      under_test(
          "one_that_says", [] { return one(saying(true)); }, kSingle),
      under_test(
          "one_that_is_silent", [] { return one(saying(false)); }, kSingle),
      under_test(
          "bracket_that_says", [] { return one(saying(true)); }, kBracket),
      under_test(
          "bracket_that_is_silent", [] { return one(saying(false)); }, kBracket),
      under_test(
          "two_that_say", [] { return pair(saying(true), 3ms); }, kSingle),
      under_test(
          "bracket_of_two_that_say", [] { return pair(saying(true), 3ms); }, kBracket),
      under_test(
          "bracket_of_two_that_are_silent", [] { return pair(saying(false), 3ms); }, kBracket),
      under_test("equal_exposures_of_two_that_say", [] { return pair(saying(true), 3ms); }, {0.001, 0.001, 0.008}),
  };
}

using conformance::CameraConformance;
INSTANTIATE_TEST_SUITE_P(Libcamera, CameraConformance, conformance::cameras(backends()), conformance::name_of);

// ---- the truth

/// Metadata and ground truth of a frame.
struct FrameReport {
  FrameInfo info;
  std::vector<Truth> truths;
  std::vector<int> lenses;
};

/// Records the frames of a run; after each frame `more` is called with their number.
class Listener final : public FrameSink {
 public:
  void push(Frame frame) override {
    FrameReport report{frame.info, {}, {}};
    for (const View& view : frame.views()) {
      report.truths.push_back(truth_of(view));
      report.lenses.push_back(view.lens);
    }
    const std::lock_guard lock(mutex_);
    frame_reports_.push_back(std::move(report));
    changed_.notify_all();
  }
  [[nodiscard]] bool wait_for(std::size_t frames) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(10), [&] { return frame_reports_.size() >= frames; });
  }
  [[nodiscard]] std::vector<FrameReport> frame_reports() {
    const std::lock_guard lock(mutex_);
    return frame_reports_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<FrameReport> frame_reports_;
};

std::vector<FrameReport> frames_of(const Cameras& cameras, const std::vector<double>& exposure_s, std::size_t frames) {
  const std::unique_ptr<CameraBackend> camera = backend_on(cameras, exposure_s);
  const Result<CameraInfo> info = camera->open();
  EXPECT_TRUE(info.ok()) << info.status().message();
  if (!info) return {};
  Listener listener;
  const Status started = camera->start(listener);
  EXPECT_TRUE(started.ok()) << started.message();
  EXPECT_TRUE(listener.wait_for(frames)) << listener.frame_reports().size() << " frames came";
  camera->stop();
  return listener.frame_reports();
}

void expect_true_exposures(const std::vector<FrameReport>& frames) {
  for (const FrameReport& f : frames) {
    for (const Truth& t : f.truths) {
      ASSERT_EQ(t.magic, kTruthMagic);
      EXPECT_NEAR(f.info.exposure_s, 1e-6 * t.exposure_us, 1e-9) << "frame " << f.info.sequence;
    }
  }
}

TEST(LibcameraFrames, ReportTheirTrueExposureWithAndWithoutExposureMetadata) {
  for (const bool says : {true, false}) {
    for (const std::vector<double>& exposures : {kSingle, kBracket}) {
      const std::vector<FrameReport> frames = frames_of(one(saying(says)), exposures, 24);
      EXPECT_GE(frames.size(), 24U);
      expect_true_exposures(frames);
    }
  }
}

TEST(LibcameraFrames, HaveTheMidExposureTime) {
  for (const FrameReport& f : frames_of(one(saying(true)), kBracket, 24))
    EXPECT_NEAR(static_cast<double>(f.info.mid_exposure.ns),
                static_cast<double>((f.truths[0].begin_ns + f.truths[0].end_ns) / 2), 1000.0);
}

TEST(LibcameraFrames, OfABracketComeAtTheFullRateIfTheCameraReportsExposures) {
  const std::vector<FrameReport> frames = frames_of(one(saying(true, 20'000)), kBracket, 30);
  // Almost all of thirty frames arrive; a busy machine may lose some.
  ASSERT_GE(frames.size(), 30U);
  EXPECT_LE(frames[29].truths[0].number - frames[0].truths[0].number, 45U);
}

TEST(LibcameraFrames, OfTwoCamerasArePairedInTheOrderOfTheLenses) {
  const std::vector<FrameReport> frames = frames_of(pair(saying(true), std::chrono::milliseconds(4)), kSingle, 30);
  expect_true_exposures(frames);
  for (const FrameReport& f : frames) {
    EXPECT_THAT(f.lenses, ::testing::ElementsAre(0, 1));
    const std::int64_t apart = f.truths[1].end_ns - f.truths[0].end_ns;
    EXPECT_EQ(std::abs(apart), 4'000'000) << "not the nearest frames";
    EXPECT_NEAR(static_cast<double>(f.info.mid_exposure.ns),
                static_cast<double>((f.truths[0].end_ns + f.truths[1].end_ns) / 2 - 1'000'000), 1000.0);
  }
}

TEST(LibcameraFrames, OfTwoCamerasInABracketComeAtTheFullRateOnceTheirCyclesAreAligned) {
  const std::vector<FrameReport> frames =
      frames_of(pair(saying(true, 20'000), std::chrono::milliseconds(4)), kBracket, 60);
  expect_true_exposures(frames);
  ASSERT_GE(frames.size(), 60U);
  EXPECT_LE(frames[59].truths[0].number - frames[15].truths[0].number, 66U) << "more than a few of 44 frames were lost";
  EXPECT_LE(frames[15].truths[0].number, 60U) << "alignment took too long";
}

TEST(LibcameraFrames, OfTwoCamerasRealignAfterOneHasLostAFrame) {
  // The exposure of the lost frame goes to the next one, so the cycles differ by one from then on.
  Cameras cameras = one(saying(true, 20'000));
  SimulatedCameraOptions losing = saying(true, 20'000);
  losing.id = "losing";
  losing.lost_every = 50;
  cameras.push_back(std::make_shared<SimulatedCamera>(losing));
  const std::vector<FrameReport> frames = frames_of(cameras, kBracket, 60);
  expect_true_exposures(frames);
  ASSERT_GE(frames.size(), 60U);
  EXPECT_LE(frames[59].truths[0].number - frames[0].truths[0].number, 110U);
}

TEST(LibcameraFrames, OfTwoCamerasInABracketHaveTheSameExposure) {
  for (const bool says : {true, false}) {
    const std::vector<FrameReport> frames = frames_of(pair(saying(says), std::chrono::milliseconds(4)), kBracket, 12);
    EXPECT_GE(frames.size(), 12U);
    expect_true_exposures(frames);
  }
}

TEST(LibcameraFrames, LostByOneOfTwoCamerasAreDroppedAndTheOthersContinue) {
  Cameras cameras = one(saying(true));
  SimulatedCameraOptions losing = saying(true);
  losing.id = "losing";
  losing.lost_every = 5;
  losing.phase = std::chrono::milliseconds(2);
  cameras.push_back(std::make_shared<SimulatedCamera>(losing));
  const std::vector<FrameReport> frames = frames_of(cameras, kSingle, 40);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_NE(frames[i].truths[1].number % 5, 0U);
    if (i == 0) continue;
    EXPECT_EQ(frames[i].info.sequence - frames[i - 1].info.sequence,
              frames[i].truths[0].number - frames[i - 1].truths[0].number)
        << "lost frames must leave a gap";
  }
}

// ---- open()

Status refusal(const Cameras& cameras, const std::vector<double>& exposure_s) {
  const Result<CameraInfo> info = backend_on(cameras, exposure_s)->open();
  EXPECT_FALSE(info.ok());
  return info.status();
}

TEST(LibcameraOpen, ACameraWithoutFramesIsUnavailable) {
  SimulatedCameraOptions dead = saying(true);
  dead.gives_frames = false;
  const Status s = refusal(one(dead), kSingle);
  EXPECT_EQ(s.code(), StatusCode::unavailable);
  EXPECT_THAT(s.message(), HasSubstr("no whole frame came"));
}

TEST(LibcameraOpen, TheSameCameraCannotBeBothLenses) {
  const Cameras same = one(saying(true));
  EXPECT_THAT(refusal({same[0], same[0]}, kSingle).message(), HasSubstr("cannot be both lenses"));
}

TEST(LibcameraOpen, TwoCamerasMustGiveTheSamePictures) {
  SimulatedCameraOptions larger = saying(true);
  larger.id = "larger";
  larger.width = 64;
  Cameras cameras = one(saying(true));
  cameras.push_back(std::make_shared<SimulatedCamera>(larger));
  EXPECT_EQ(refusal(cameras, kSingle).code(), StatusCode::failed_precondition);
}

TEST(LibcameraOpen, DeclaresTheExposuresOfTheSensor) {
  SimulatedCameraOptions rounding = saying(true);
  rounding.exposure_factor = 1.02;
  const std::unique_ptr<CameraBackend> camera = backend_on(one(rounding), kBracket);
  const Result<CameraInfo> info = camera->open();
  ASSERT_TRUE(info.ok()) << info.status().message();
  ASSERT_EQ(info->exposure_s.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(info->exposure_s[i], 1.02 * kBracket[i], 1e-5);
  EXPECT_NEAR(info->frame_rate, 100, 5);
}

TEST(LibcameraOpen, ABracketThatTheSensorCannotExposeIsRefused) {
  SimulatedCameraOptions stubborn = saying(true);
  stubborn.exposure_factor = 2;
  EXPECT_EQ(refusal(one(stubborn), kBracket).code(), StatusCode::failed_precondition);
}

// ---- cables

TEST(LibcameraLoss, FramesResumeWithinTwoSecondsOfTheReconnection) {
  for (const bool two : {false, true}) {
    const Cameras cameras = two ? pair(saying(true), std::chrono::milliseconds(3)) : one(saying(true));
    const std::unique_ptr<CameraBackend> camera = backend_on(cameras, kSingle);
    ASSERT_TRUE(camera->open().ok());
    auto sink = std::make_shared<RecordingSink>();
    sink->timeout = std::chrono::seconds(6);
    sink->keep(2);
    ASSERT_TRUE(camera->start(*sink).ok());
    ASSERT_TRUE(sink->wait_for(5, *camera));
    for (int round = 0; round < 2; ++round) {
      cameras.back()->unplug();
      const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(6);
      while (camera->state() != State::lost && std::chrono::steady_clock::now() < limit)
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
      ASSERT_EQ(camera->state(), State::lost);
      std::this_thread::sleep_for(std::chrono::milliseconds(300));
      const std::size_t before = sink->count();
      cameras.back()->plug();
      const auto plugged = std::chrono::steady_clock::now();
      while (sink->count() == before && std::chrono::steady_clock::now() < limit)
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
      ASSERT_GT(sink->count(), before);
      EXPECT_LT(std::chrono::steady_clock::now() - plugged, std::chrono::seconds(2));
      EXPECT_EQ(camera->state(), State::streaming);
    }
    // Frames of the disconnected device were held all the time; their release must not fail.
    const std::vector<Frame> held = sink->take_kept();
    ASSERT_EQ(held.size(), 2U);
    for (const Frame& f : held) EXPECT_EQ(truth_of(f.views()[0]).magic, kTruthMagic);
    const std::vector<conformance::ReceivedFrame> seen = sink->seen();
    for (std::size_t i = 1; i < seen.size(); ++i) {
      EXPECT_GT(seen[i].info.sequence, seen[i - 1].info.sequence);
      EXPECT_GT(seen[i].info.mid_exposure, seen[i - 1].info.mid_exposure);
    }
    camera->stop();
    EXPECT_EQ(camera->state(), State::idle);
  }
}

TEST(LibcameraLoss, AStoppedCameraThatWasReplacedMeanwhileStartsAgain) {
  const Cameras cameras = one(saying(true));
  const std::unique_ptr<CameraBackend> camera = backend_on(cameras, kSingle);
  ASSERT_TRUE(camera->open().ok());
  Listener listener;
  ASSERT_TRUE(camera->start(listener).ok());
  ASSERT_TRUE(listener.wait_for(3));
  camera->stop();
  cameras[0]->unplug();
  EXPECT_EQ(camera->start(listener).code(), StatusCode::unavailable);
  cameras[0]->plug();
  ASSERT_TRUE(camera->start(listener).ok());
  EXPECT_TRUE(listener.wait_for(6));
  camera->stop();
}

}  // namespace
}  // namespace lightwell::libcam
