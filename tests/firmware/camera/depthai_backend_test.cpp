// Tests of the OAK backend: options, pictures, and frames of a simulated camera with ground truth.
#include <condition_variable>
#include <cstdlib>
#include <limits>
#include <mutex>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "camera/backends/depthai/oak_device.hpp"
#include "camera/conformance/conformance.hpp"
#include "camera/conformance/session.hpp"
#include "firmware/camera/simulated_oak.hpp"

namespace lightwell::oak {
namespace {

using conformance::BackendUnderTest;
using conformance::CameraConformance;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using State = CameraBackend::State;

// ---- options

Result<OakOptions> parsed(const std::string& rest, const CameraConfig& config = {}) {
  const Result<CameraUri> uri = parse_camera_uri("depthai:" + rest);
  if (!uri) return uri.status();
  return parse_options(*uri, config);
}

CameraConfig exposing(std::vector<double> exposure_s, double gain = 1) {
  CameraConfig config;
  config.capture.exposure_s = std::move(exposure_s);
  config.capture.gain = gain;
  return config;
}

TEST(OakUri, SettingsAreRead) {
  const auto o = parsed("14442C10D13EABCE00?socket=B&format=bayer10&white_balance=4200K&row_readout=18.5us",
                        exposing({0.001, 0.008}, 2));
  ASSERT_TRUE(o.ok()) << o.status().message();
  EXPECT_EQ(o->id, "14442C10D13EABCE00");
  EXPECT_EQ(o->socket, 'B');
  EXPECT_EQ(o->format, PixelFormat::bayer_rggb10);
  EXPECT_EQ(o->white_balance_k, 4200);
  EXPECT_EQ(o->row_readout.ns, 18'500);
  EXPECT_THAT(o->exposure_us, ElementsAre(1000U, 8000U));
  EXPECT_EQ(o->iso, 200U);
  EXPECT_THAT(o->notes, IsEmpty());
  const auto of_the_uri = parsed("X?exposure=1ms,8ms&gain=2");
  ASSERT_TRUE(of_the_uri.ok()) << of_the_uri.status().message();
  EXPECT_EQ(of_the_uri->exposure_us, o->exposure_us);
  EXPECT_EQ(of_the_uri->iso, o->iso);
}

TEST(OakUri, FormerNamesAreAcceptedWithANote) {
  const auto o = parsed("X?white=4200K&readout=18.5us", exposing({0.001}));
  ASSERT_TRUE(o.ok()) << o.status().message();
  EXPECT_EQ(o->white_balance_k, 4200);
  EXPECT_EQ(o->row_readout.ns, 18'500);
  EXPECT_THAT(o->notes, ElementsAre(HasSubstr("'readout' is now called 'row_readout'"),
                                    HasSubstr("'white' is now called 'white_balance'")));
}

TEST(OakUri, InvalidParametersAreNamed) {
  for (const auto& [rest, word] :
       std::vector<std::pair<std::string, std::string>>{{"", "no camera is named"},
                                                        {"X?socket=K", "A to J"},
                                                        {"X?sockt=A", "socket"},
                                                        {"X?format=rgb8", "neither"},
                                                        {"X?white_balance=12001", "1000K to 12000K"},
                                                        {"X?white_balance=500K", "white_balance"},
                                                        {"X?white_balance=nanK", "white_balance"},
                                                        {"X?colour_gains=1,1", "colour_gains"},
                                                        {"X?row_readout=20", "row_readout"},
                                                        {"X?row_readout=-1us", "row_readout"}}) {
    const auto o = parsed(rest);
    ASSERT_FALSE(o.ok()) << rest;
    EXPECT_EQ(o.status().code(), StatusCode::invalid_argument);
    EXPECT_THAT(o.status().message(), HasSubstr(word)) << rest;
  }
  CameraConfig odd;
  odd.width = 642;
  EXPECT_FALSE(parsed("X", odd).ok()) << "raw pixels are packed in groups of four";
  odd = {};
  odd.frame_rate = 0;
  EXPECT_FALSE(parsed("X", odd).ok());
  EXPECT_FALSE(parsed("X", exposing({std::numeric_limits<double>::quiet_NaN()})).ok());
  EXPECT_FALSE(parsed("X", exposing({0.01}, 0)).ok());
}

TEST(OakUri, ValuesOutsideTheRangesAreClampedWithANote) {
  const auto o = parsed("X", exposing({0.1, 1e-9}, 100));
  ASSERT_TRUE(o.ok());
  EXPECT_THAT(o->exposure_us, ElementsAre(33'333U, 1U)) << "limits: the frame interval at 30 frames/s, and 1 us";
  EXPECT_EQ(o->iso, 1600U);
  EXPECT_THAT(o->notes, Contains(HasSubstr("100 ms becomes 33.33 ms")));
  EXPECT_THAT(o->notes, Contains(HasSubstr("gain 100 becomes 16")));
  EXPECT_THAT(parsed("X")->notes, Contains(HasSubstr("no exposure is set")));
}

// ---- pictures

TEST(OakPicture, MidExposureIsHalfAnExposureBeforeItsEndAndLaterInTheCentreRow) {
  OakPicture p;
  p.timestamp_ns = 1'000'000'000;
  p.exposure_us = 10'000;
  p.height = 400;
  EXPECT_EQ(mid_exposure(p, {}, {1'100'000'000})->ns, 995'000'000);
  EXPECT_EQ(mid_exposure(p, {10'000}, {1'100'000'000})->ns, 997'000'000);
}

TEST(OakPicture, TimestampsInTheFutureOrLongAgoAreRefused) {
  OakPicture p;
  p.timestamp_ns = 10'000'000'000;
  EXPECT_FALSE(mid_exposure(p, {}, {9'999'999'999}));
  EXPECT_FALSE(mid_exposure(p, {}, {15'000'000'001}));
  EXPECT_TRUE(mid_exposure(p, {}, {15'000'000'000}));
}

TEST(OakPicture, UnpacksFourRawPixelsFromFiveBytes) {
  // 0x3FF, 0, 0x155, 0x2AA in one row; the next row is shifted by a byte of padding.
  const std::vector<std::byte> packed{
      std::byte{0xFF}, std::byte{0x00}, std::byte{0x55}, std::byte{0xAA}, std::byte{0b10'01'00'11}, std::byte{0xEE},
      std::byte{0x80}, std::byte{0x01}, std::byte{0x00}, std::byte{0x00}, std::byte{0b11'00'00'01}};
  OakPicture p;
  p.data = packed;
  p.width = 4;
  p.height = 2;
  p.stride = 6;
  std::vector<std::uint16_t> words(8);
  ASSERT_TRUE(unpack_raw10(p, words).ok());
  EXPECT_THAT(words, ElementsAre(0x3FF, 0, 0x155, 0x2AA, 0x201, 4, 0, 3));
}

TEST(OakPicture, TruncatedRawPicturesAreRefused) {
  const std::vector<std::byte> packed(10);
  OakPicture p;
  p.data = std::span(packed).first(9);
  p.width = 4;
  p.height = 2;
  p.stride = 5;
  std::vector<std::uint16_t> words(8);
  EXPECT_EQ(unpack_raw10(p, words).code(), StatusCode::data_loss);
  p.data = packed;
  EXPECT_TRUE(unpack_raw10(p, words).ok());
  EXPECT_FALSE(unpack_raw10(p, std::span(words).first(7)).ok());
  p.stride = 4;
  EXPECT_FALSE(unpack_raw10(p, words).ok());
  p.stride = 5;
  p.width = 6;
  EXPECT_FALSE(unpack_raw10(p, words).ok());
  p.width = 0;
  EXPECT_FALSE(unpack_raw10(p, words).ok());
}

// ---- the backend

std::unique_ptr<CameraBackend> backend_on(const std::shared_ptr<OakOnTheTable>& table, std::vector<double> exposure_s,
                                          const std::string& rest = "X") {
  CameraConfig config = exposing(std::move(exposure_s));
  config.width = 32;
  config.height = 16;
  config.frame_rate = 1e6 / static_cast<double>(table->interval.count());
  Result<OakOptions> options = parsed(rest, config);
  EXPECT_TRUE(options.ok());
  return make_oak_backend(std::move(*options), std::make_unique<SimulatedOak>(table));
}

const std::vector<double> kSingle{0.002}, kBracket{0.0005, 0.002, 0.008};

BackendUnderTest under_test(const std::string& name, const std::vector<double>& exposure_s, const std::string& rest) {
  auto table = std::make_shared<OakOnTheTable>();
  BackendUnderTest camera;
  camera.name = name;
  camera.make = [=]() -> Result<std::unique_ptr<CameraBackend>> {
    table->plugged = true;
    return backend_on(table, exposure_s, rest);
  };
  camera.disconnect = [table] { table->plugged = false; };
  return camera;
}

INSTANTIATE_TEST_SUITE_P(Oak, CameraConformance,
                         conformance::cameras({under_test("nv12", kSingle, "X"),
                                               under_test("nv12_bracket", kBracket, "X"),
                                               under_test("raw", kSingle, "X?format=bayer10")}),
                         conformance::name_of);

/// Records metadata and ground truth of frames.
class Listener final : public FrameSink {
 public:
  void push(Frame frame) override {
    OakTruth truth;
    std::memcpy(&truth, frame.views()[0].data.data(), sizeof truth);
    const std::lock_guard lock(mutex_);
    frame_reports_.emplace_back(frame.info, truth);
    changed_.notify_all();
  }
  [[nodiscard]] bool wait_for(std::size_t frames) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(10), [&] { return frame_reports_.size() >= frames; });
  }
  [[nodiscard]] std::vector<std::pair<FrameInfo, OakTruth>> frame_reports() {
    const std::lock_guard lock(mutex_);
    return frame_reports_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::pair<FrameInfo, OakTruth>> frame_reports_;
};

TEST(OakFrames, ReportTheirTrueExposureAndTime) {
  for (const std::vector<double>& exposures : {kSingle, kBracket}) {
    const auto camera = backend_on(std::make_shared<OakOnTheTable>(), exposures);
    ASSERT_TRUE(camera->open().ok());
    Listener listener;
    ASSERT_TRUE(camera->start(listener).ok());
    EXPECT_TRUE(listener.wait_for(15));
    camera->stop();
    for (const auto& [info, truth] : listener.frame_reports()) {
      EXPECT_NEAR(info.exposure_s, 1e-6 * truth.exposure_us, 1e-9);
      EXPECT_NEAR(static_cast<double>(info.mid_exposure.ns), static_cast<double>((truth.begin_ns + truth.end_ns) / 2),
                  1.0);
    }
  }
}

Status refusal(OakOnTheTable* changed, const std::vector<double>& exposure_s) {
  const std::shared_ptr<OakOnTheTable> table(changed);
  const Result<CameraInfo> info = backend_on(table, exposure_s)->open();
  EXPECT_FALSE(info.ok());
  return info.status();
}

TEST(OakOpen, ReportsTheError) {
  auto* unplugged = new OakOnTheTable;
  unplugged->plugged = false;
  EXPECT_EQ(refusal(unplugged, kSingle).code(), StatusCode::not_found);
  auto* dark = new OakOnTheTable;
  dark->gives_frames = false;
  EXPECT_THAT(refusal(dark, kSingle).message(), HasSubstr("no frame came"));
  auto* stubborn = new OakOnTheTable;
  stubborn->exposure_factor = 2;
  EXPECT_THAT(refusal(stubborn, kBracket).message(),
              HasSubstr("an exposure of 0.5 ms was requested, but it reports 1 ms"));
  auto* unsynchronised = new OakOnTheTable;
  unsynchronised->clock_offset_ns = -60'000'000'000;
  EXPECT_THAT(refusal(unsynchronised, kSingle).message(), HasSubstr("not of this host's clock"));
}

TEST(OakLoss, FramesResumeAfterReconnection) {
  const auto table = std::make_shared<OakOnTheTable>();
  const auto camera = backend_on(table, kBracket);
  ASSERT_TRUE(camera->open().ok());
  conformance::RecordingSink sink;
  sink.timeout = std::chrono::seconds(6);
  sink.keep(2);
  ASSERT_TRUE(camera->start(sink).ok());
  ASSERT_TRUE(sink.wait_for(5, *camera));
  table->plugged = false;
  const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(6);
  while (camera->state() != State::lost && std::chrono::steady_clock::now() < limit)
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  ASSERT_EQ(camera->state(), State::lost);
  const std::size_t before = sink.count();
  table->plugged = true;
  while (sink.count() < before + 3 && std::chrono::steady_clock::now() < limit)
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  EXPECT_GE(sink.count(), before + 3);
  EXPECT_EQ(camera->state(), State::streaming);
  const std::vector<Frame> held = sink.take_kept();
  EXPECT_EQ(held.size(), 2U) << "frames pushed before the disconnection are still lent";
  camera->stop();
}

}  // namespace
}  // namespace lightwell::oak
