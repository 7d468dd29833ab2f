// Tests of the libcamera backend's options, format and control choice, and timestamps.
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "camera/backends/libcamera/choices.hpp"
#include "camera/backends/libcamera/lens.hpp"

namespace lightwell::libcam {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// ---- options

Result<LibcameraOptions> parsed(const std::string& rest, const CameraConfig& config = {}) {
  const Result<CameraUri> uri = parse_camera_uri("libcamera:" + rest);
  if (!uri) return uri.status();
  return parse_options(*uri, config);
}

TEST(LibcameraUri, NamesOneCameraOrTwoInTheOrderOfTheLenses) {
  const auto one = parsed(R"(\_SB_.PCI0.XHC1-1.1:1.0-046d:0825)");
  ASSERT_TRUE(one.ok());
  EXPECT_THAT(one->cameras, ElementsAre(R"(\_SB_.PCI0.XHC1-1.1:1.0-046d:0825)"));
  const auto two = parsed("/base/soc/i2c0mux/i2c@1/imx219@10,2?format=bayer10");
  ASSERT_TRUE(two.ok());
  EXPECT_THAT(two->cameras, ElementsAre("/base/soc/i2c0mux/i2c@1/imx219@10", "2"));
  EXPECT_EQ(two->format, PixelFormat::bayer_rggb10);
}

TEST(LibcameraUri, SettingsAreRead) {
  const auto o = parsed(
      "1?row_readout=18.9us&timestamp=exposure&colour_gains=1.8,1.5&control_delay=5&exposure=0.001,0.008&gain=2.5");
  ASSERT_TRUE(o.ok()) << o.status().message();
  EXPECT_EQ(o->row_readout.ns, 18900);
  EXPECT_EQ(o->timestamp_event, TimestampEvent::exposure);
  EXPECT_THAT(*o->capture.colour_gains, ElementsAre(1.8, 1.5));
  EXPECT_EQ(o->control_delay, 5);
  EXPECT_THAT(o->capture.exposure_s, ElementsAre(0.001, 0.008));
  EXPECT_EQ(o->capture.gain, 2.5);
  EXPECT_THAT(o->notes, IsEmpty());
}

TEST(LibcameraUri, FormerNamesAreAcceptedWithANote) {
  const auto o = parsed("1?readout=18.9us&stamp=exposure&white=1.8,1.5&settle=5");
  ASSERT_TRUE(o.ok()) << o.status().message();
  EXPECT_EQ(o->row_readout.ns, 18900);
  EXPECT_EQ(o->timestamp_event, TimestampEvent::exposure);
  EXPECT_THAT(*o->capture.colour_gains, ElementsAre(1.8, 1.5));
  EXPECT_EQ(o->control_delay, 5);
  EXPECT_THAT(o->notes, ElementsAre(HasSubstr("'row_readout'"), HasSubstr("'timestamp'"), HasSubstr("'colour_gains'"),
                                    HasSubstr("'control_delay'")));
}

TEST(LibcameraUri, InvalidParametersAreNamed) {
  for (const auto& [rest, word] :
       std::vector<std::pair<std::string, std::string>>{{"", "cam --list"},
                                                        {"1,", "cam --list"},
                                                        {"1,2,3", "at most 2"},
                                                        {"1,1", "both lenses"},
                                                        {"1?formt=nv12", "format"},
                                                        {"1?format=rgb_f32", "none of"},
                                                        {"1?format=mjpeg", "none of"},
                                                        {"1?row_readout=20", "unit"},
                                                        {"1?row_readout=-20us", "row_readout"},
                                                        {"1?row_readout=nanus", "row_readout"},
                                                        {"1?timestamp=middle", "neither"},
                                                        {"1?colour_gains=2", "two gains"},
                                                        {"1?colour_gains=0,1", "two gains"},
                                                        {"1?colour_gains=inf,1", "two gains"},
                                                        {"1?white_balance=5000K", "white_balance"},
                                                        {"1?control_delay=1.5", "control_delay"},
                                                        {"1?control_delay=-1", "control_delay"}}) {
    const auto o = parsed(rest);
    ASSERT_FALSE(o.ok()) << rest;
    EXPECT_EQ(o.status().code(), StatusCode::invalid_argument) << rest;
    EXPECT_THAT(o.status().message(), HasSubstr(word)) << rest;
  }
}

TEST(LibcameraUri, NumbersOfTheConfigurationAreChecked) {
  const auto refused = [](auto change) {
    CameraConfig config;
    change(config);
    return !parsed("1", config).ok();
  };
  EXPECT_TRUE(refused([](CameraConfig& c) { c.width = 0; }));
  EXPECT_TRUE(refused([](CameraConfig& c) { c.height = 1 << 20; }));
  EXPECT_TRUE(refused([](CameraConfig& c) { c.frame_rate = -1; }));
  EXPECT_TRUE(refused([](CameraConfig& c) { c.frame_rate = std::nan(""); }));
  EXPECT_TRUE(refused([](CameraConfig& c) { c.capture.gain = 0; }));
  EXPECT_TRUE(refused([](CameraConfig& c) { c.capture.exposure_s = {0.01, 0}; }));
  EXPECT_TRUE(refused([](CameraConfig& c) { c.capture.exposure_s.assign(9, 0.01); }));
  EXPECT_FALSE(refused([](CameraConfig& c) { c.frame_rate = 0; })) << "the camera's own rate";
}

// ---- formats

constexpr std::uint32_t fourcc(const char* c) {
  return static_cast<std::uint32_t>(c[0]) | static_cast<std::uint32_t>(c[1]) << 8 |
         static_cast<std::uint32_t>(c[2]) << 16 | static_cast<std::uint32_t>(c[3]) << 24;
}
const SupportedFormat kMjpeg{fourcc("MJPG"), 0, "MJPEG"}, kYuyv{fourcc("YUYV"), 0, "YUYV"},
    kNv12{fourcc("NV12"), 0, "NV12"}, kRgb{fourcc("RG24"), 0, "RGB888"}, kBgr{fourcc("BG24"), 0, "BGR888"},
    kRaw10{fourcc("RG10"), 0, "SRGGB10"}, kPacked10{fourcc("RG10"), (std::uint64_t{11} << 56) | 1, "SRGGB10_CSI2P"},
    kOtherOrder{fourcc("BG10"), 0, "SBGGR10"};

TEST(LibcameraFormat, BytesRedGreenBlueAreDrmsBgr888AndNeverItsRgb888) {
  EXPECT_EQ(format_of(kBgr.fourcc, 0), PixelFormat::rgb8);
  EXPECT_FALSE(format_of(kRgb.fourcc, 0)) << "blue comes first in memory";
}

TEST(LibcameraFormat, PackedRawFormatsAndOtherBayerOrdersAreNotSupported) {
  EXPECT_EQ(format_of(kRaw10.fourcc, kRaw10.modifier), PixelFormat::bayer_rggb10);
  EXPECT_FALSE(format_of(kPacked10.fourcc, kPacked10.modifier));
  EXPECT_FALSE(format_of(kOtherOrder.fourcc, 0)) << "blue at the top left";
}

TEST(LibcameraFormat, PrefersTheRequestedFormatThenProcessedThenRaw) {
  const std::vector<SupportedFormat> offered{kMjpeg, kRaw10, kBgr, kYuyv, kNv12};
  EXPECT_EQ(*choose_format(offered, std::nullopt), 4U);
  EXPECT_EQ(*choose_format(offered, PixelFormat::bayer_rggb10), 1U);
  EXPECT_EQ(*choose_format(offered, PixelFormat::rgb8), 2U);
  EXPECT_EQ(*choose_format(std::vector{kMjpeg, kPacked10, kRaw10}, std::nullopt), 2U)
      << "raw, because no other format is offered";
}

TEST(LibcameraFormat, ARefusalListsWhatTheCameraOffers) {
  const auto none = choose_format(std::vector{kMjpeg, kRgb}, std::nullopt);
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.status().code(), StatusCode::failed_precondition);
  EXPECT_THAT(none.status().message(), HasSubstr("it offers: MJPEG, RGB888"));
  const auto wish = choose_format(std::vector{kMjpeg, kYuyv}, PixelFormat::nv12);
  EXPECT_THAT(wish.status().message(), HasSubstr("does not offer nv12; it offers: MJPEG, YUYV (yuyv)"));
  EXPECT_THAT(choose_format({}, std::nullopt).status().message(), HasSubstr("it offers: nothing"));
}

// ---- controls

LibcameraOptions asking(std::vector<double> exposure_s) {
  LibcameraOptions o;
  o.cameras = {"1"};
  o.capture.exposure_s = std::move(exposure_s);
  return o;
}

SupportedControls all_offered() {
  SupportedControls c;
  c.manual_exposure = c.manual_white_balance = true;
  c.exposure_us = ControlRange{75, 66'666, std::nullopt};
  c.gain = ControlRange{1, 16, 1.0};
  c.colour_gain = ControlRange{0, 32, std::nullopt};
  c.duration_us = ControlRange{16'666, 1'000'000, std::nullopt};
  return c;
}

TEST(LibcameraControls, SwitchesAllOfferedAutomaticControlsOffWithoutNotes) {
  const auto chosen = choose_controls(all_offered(), asking({0.004, 0.016}));
  ASSERT_TRUE(chosen.ok());
  EXPECT_TRUE(chosen->manual_exposure && chosen->manual_white_balance && chosen->set_exposure);
  EXPECT_THAT(chosen->exposure_us, ElementsAre(4000, 16'000));
  EXPECT_EQ(chosen->gain, 1.0F);
  EXPECT_THAT(*chosen->colour_gains, ElementsAre(1.0F, 1.0F));
  EXPECT_EQ(chosen->duration_us, 33'333);
  EXPECT_THAT(chosen->notes, IsEmpty());
}

TEST(LibcameraControls, ClampsExposuresToTheRangeWithANote) {
  const auto chosen = choose_controls(all_offered(), asking({1e-6, 0.5}));
  ASSERT_TRUE(chosen.ok());
  EXPECT_THAT(chosen->exposure_us, ElementsAre(75, 66'666));
  EXPECT_THAT(chosen->notes, ::testing::Contains(HasSubstr("0.001 ms becomes 0.075 ms")));
  EXPECT_EQ(chosen->duration_us, 67'333) << "the frame duration must contain the longest exposure";
  EXPECT_THAT(chosen->notes, ::testing::Contains(HasSubstr("frame rate 30 becomes 14.85")));
}

TEST(LibcameraControls, RoundsExposuresOfUsbCamerasTo100Microseconds) {
  SupportedControls usb;
  usb.manual_exposure = true;
  usb.exposure_us = ControlRange{100, 1'000'000, 15'600.0};
  const auto chosen = choose_controls(usb, asking({0.00016, 0.00012, 0.00001}));
  ASSERT_TRUE(chosen.ok());
  EXPECT_THAT(chosen->exposure_us, ElementsAre(200, 100, 100)) << "0.16 ms must be rounded, not truncated";
  EXPECT_THAT(chosen->notes, ::testing::Contains(HasSubstr("0.16 ms becomes 0.2 ms")));
}

TEST(LibcameraControls, NotesMissingControls) {
  LibcameraOptions asked = asking({0.01});
  asked.capture.gain = 4;
  const auto chosen = choose_controls({}, asked);
  ASSERT_TRUE(chosen.ok());
  EXPECT_FALSE(chosen->set_exposure);
  EXPECT_EQ(chosen->assumed_gain(), 1);
  for (const char* control : {"ExposureTime", "AeEnable", "AnalogueGain", "AwbEnable", "FrameDurationLimits"})
    EXPECT_THAT(chosen->notes, ::testing::Contains(HasSubstr(control)));
}

TEST(LibcameraControls, ABracketOnACameraWithoutExposureIsRefused) {
  const auto chosen = choose_controls({}, asking({0.001, 0.01}));
  ASSERT_FALSE(chosen.ok());
  EXPECT_EQ(chosen.status().code(), StatusCode::failed_precondition);
}

TEST(LibcameraControls, TheDefaultExposureIsTheCamerasWithinAFrame) {
  EXPECT_THAT(choose_controls(all_offered(), asking({}))->exposure_us, ElementsAre(10'000));
  SupportedControls with_default = all_offered();
  with_default.exposure_us->preset = 5000;
  EXPECT_THAT(choose_controls(with_default, asking({}))->exposure_us, ElementsAre(5000));
  with_default.exposure_us->preset = 60'000;
  EXPECT_LE(choose_controls(with_default, asking({}))->exposure_us[0], 33'334);
}

TEST(LibcameraControls, InvalidRangesCountAsNotOffered) {
  SupportedControls odd = all_offered();
  odd.exposure_us = ControlRange{100, 0, std::nullopt};
  odd.gain = ControlRange{std::nan(""), 4, std::nullopt};
  odd.duration_us = ControlRange{0, 0, std::nullopt};
  const auto chosen = choose_controls(odd, asking({0.01}));
  ASSERT_TRUE(chosen.ok());
  EXPECT_FALSE(chosen->set_exposure);
  EXPECT_FALSE(chosen->gain);
  EXPECT_FALSE(chosen->duration_us);
}

TEST(LibcameraControls, ARateOfZeroLeavesTheCameraItsOwn) {
  LibcameraOptions asked = asking({0.01});
  asked.frame_rate = 0;
  const auto chosen = choose_controls(all_offered(), asked);
  EXPECT_FALSE(chosen->duration_us);
  EXPECT_THAT(chosen->notes, Not(::testing::Contains(HasSubstr("rate"))));
}

// ---- times

constexpr std::int64_t kSecond = 1'000'000'000;

TEST(SensorClock, MonotonicTimestampsAreUnchanged) {
  SensorClock clock;
  const ClockReading now{100 * kSecond, 100 * kSecond + 3600 * kSecond};
  EXPECT_EQ(clock.to_probe_time(now.monotonic_ns - 40'000'000, now)->ns, now.monotonic_ns - 40'000'000);
}

TEST(SensorClock, BoottimeTimestampsLoseTheSuspendedTime) {
  SensorClock clock;
  const ClockReading now{100 * kSecond, 100 * kSecond + 3600 * kSecond};
  EXPECT_EQ(clock.to_probe_time(now.boottime_ns - 40'000'000, now)->ns, now.monotonic_ns - 40'000'000);
}

TEST(SensorClock, AfterAShortSuspensionATimestampInTheFutureRevealsTheClock) {
  SensorClock clock;
  const std::int64_t slept = 10'000'000;
  const ClockReading now{100 * kSecond, 100 * kSecond + slept};
  // 4 ms ago by CLOCK_BOOTTIME is 6 ms in the future by CLOCK_MONOTONIC.
  EXPECT_EQ(clock.to_probe_time(now.boottime_ns - 4'000'000, now)->ns, now.monotonic_ns - 4'000'000);
  // From then on older timestamps are read as CLOCK_BOOTTIME, too.
  EXPECT_EQ(clock.to_probe_time(now.boottime_ns - 30'000'000, now)->ns, now.monotonic_ns - 30'000'000);
}

TEST(SensorClock, TimestampsOfAnotherClockAreRefused) {
  const ClockReading now{100 * kSecond, 3700 * kSecond};
  for (const std::int64_t stamp :
       {std::int64_t{0}, std::int64_t{-5}, 1'700'000'000 * kSecond, 50 * kSecond, 1000 * kSecond}) {
    SensorClock clock;
    EXPECT_FALSE(clock.to_probe_time(stamp, now)) << stamp;
  }
}

TEST(SensorClock, ReadsBothClocksAtOneInstant) {
  const ClockReading a = read_clocks(), b = read_clocks();
  EXPECT_GE(a.boottime_ns, a.monotonic_ns - 1'000'000) << "CLOCK_BOOTTIME includes suspended time";
  EXPECT_GE(b.monotonic_ns, a.monotonic_ns);
  EXPECT_LT(std::abs((b.boottime_ns - b.monotonic_ns) - (a.boottime_ns - a.monotonic_ns)), 1'000'000);
  EXPECT_LT(std::abs(a.monotonic_ns - monotonic_now_ns()), kSecond);
}

TEST(FrameTiming, MidExposureIsHalfAnExposureBeforeReadout) {
  const FrameTiming global{0.010, {}, 480, TimestampEvent::readout};
  EXPECT_EQ(mid_exposure({kSecond}, global).ns, kSecond - 5'000'000);
  EXPECT_EQ(exposure_begin({kSecond}, global).ns, kSecond - 10'000'000);
}

TEST(FrameTiming, TheCentreRowOfARollingShutterIsLater) {
  const FrameTiming rolling{0.010, {20'000}, 480, TimestampEvent::readout};
  EXPECT_EQ(mid_exposure({kSecond}, rolling).ns, kSecond - 5'000'000 + 240 * 20'000);
  EXPECT_EQ(exposure_begin({kSecond}, rolling).ns, kSecond - 10'000'000) << "of the first row";
}

TEST(FrameTiming, AStartTimestampIsHalfAnExposureBeforeMidExposure) {
  const FrameTiming documented{0.010, {20'000}, 480, TimestampEvent::exposure};
  EXPECT_EQ(mid_exposure({kSecond}, documented).ns, kSecond + 5'000'000 + 240 * 20'000);
}

TEST(MeasuredInterval, IsTheTimePerFrameOrNominalIfImplausible) {
  EXPECT_EQ(measured_interval({10 * 33}, 10, {7}).ns, 33);
  EXPECT_EQ(measured_interval({10 * 33}, 0, {7}).ns, 7) << "sequence numbers do not change";
  EXPECT_EQ(measured_interval({-33}, 1, {7}).ns, 7) << "time decreases";
  EXPECT_EQ(measured_interval({33}, ~std::uint64_t{0}, {7}).ns, 7) << "sequence numbers decrease";
}

}  // namespace
}  // namespace lightwell::libcam
