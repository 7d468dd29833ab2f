// The control endpoint with regular and with random requests.
#include "usb_camera/device.hpp"

#include <random>

#include <gtest/gtest.h>

#include "hil/usb_camera/known_source.hpp"
#include "hil/usb_camera/video_host.hpp"

namespace lightwell::usb_camera {
namespace {

class DeviceTest : public ::testing::Test {
 protected:
  DeviceTest() { options_.formats = formats_for("single"); }

  SetupReply setup(std::uint8_t type, std::uint8_t request, std::uint16_t value, std::uint16_t index,
                   std::uint16_t length, const Bytes& data = {}) {
    return device_.setup({type, request, value, index, length}, data, host_);
  }
  std::uint8_t error_code(std::uint8_t interface) {
    const SetupReply reply = setup(0xA1, 0x81, interface == 0 ? 0x0200 : 0x0600, interface, 1);
    EXPECT_FALSE(reply.stalled);
    return reply.data.empty() ? 255 : reply.data[0];
  }
  void configure() { EXPECT_TRUE(device_.set_configuration(1)); }

  bench::KnownSource source_;
  FrameLog log_;
  DeviceOptions options_{.stream = {}, .formats = formats_for("single"), .payload_bytes = 0, .identity = {}};
  Device device_{options_, source_, log_};
  bench::VideoHost host_{640 * 480 * 2 + 12, 16384};
};

TEST_F(DeviceTest, TruncatesDescriptorsToTheRequestedLength) {
  EXPECT_EQ(setup(0x80, 6, 0x0100, 0, 8).data.size(), 8U);
  EXPECT_EQ(setup(0x80, 6, 0x0100, 0, 64).data, device_descriptor());
  EXPECT_EQ(setup(0x80, 6, 0x0200, 0, 9).data.size(), 9U);
  EXPECT_EQ(setup(0x80, 6, 0x0200, 0, 4096).data, configuration_descriptor(formats_for("single")));
  EXPECT_EQ(setup(0x80, 6, 0x0600, 0, 10).data, device_qualifier());
  EXPECT_FALSE(setup(0x80, 6, 0x0302, 0x0409, 255).stalled);
  EXPECT_TRUE(setup(0x80, 6, 0x0309, 0x0409, 255).stalled);
  EXPECT_TRUE(setup(0x80, 6, 0x0201, 0, 9).stalled) << "there is one configuration";
  EXPECT_TRUE(setup(0x80, 6, 0x0F00, 0, 9).stalled);
}

TEST_F(DeviceTest, ConfigurationAndInterfaces) {
  EXPECT_EQ(setup(0x80, 8, 0, 0, 1).data, (Bytes{0}));
  EXPECT_TRUE(setup(0x81, 10, 0, 1, 1).stalled) << "not configured";
  EXPECT_TRUE(setup(0xA1, 0x81, 0x0200, 0, 1).stalled) << "not configured";
  EXPECT_TRUE(setup(0x00, 9, 2, 0, 0).stalled);
  EXPECT_TRUE(setup(0x00, 9, 257, 0, 0).stalled);
  EXPECT_FALSE(setup(0x00, 9, 1, 0, 0).stalled);
  EXPECT_EQ(setup(0x80, 8, 0, 0, 1).data, (Bytes{1}));
  EXPECT_EQ(setup(0x81, 10, 0, 1, 1).data, (Bytes{0}));
  EXPECT_FALSE(setup(0x01, 11, 0, 1, 0).stalled);
  EXPECT_TRUE(setup(0x01, 11, 1, 1, 0).stalled) << "a bulk camera has one setting";
  EXPECT_TRUE(setup(0x01, 11, 0, 2, 0).stalled);
  device_.bus_reset();
  EXPECT_EQ(setup(0x80, 8, 0, 0, 1).data, (Bytes{0}));
  EXPECT_EQ(device_.counts().resets, 1U);
}

TEST_F(DeviceTest, TheErrorCodeGivesTheReasonOfAStall) {
  configure();
  EXPECT_EQ(error_code(0), 0);
  EXPECT_TRUE(setup(0x21, 1, 0x0400, kProcessingUnit << 8, 2, {0xFF, 0xFF}).stalled);
  EXPECT_EQ(error_code(0), 4) << "out of range";
  EXPECT_EQ(error_code(0), 4) << "reading does not change it";
  EXPECT_TRUE(setup(0x21, 1, 0x0400, kCameraTerminal << 8, 4, {9, 0, 0, 0}).stalled);
  EXPECT_EQ(error_code(0), 2) << "automatic mode";
  EXPECT_TRUE(setup(0xA1, 0x81, 0x0400, 7 << 8, 2).stalled);
  EXPECT_EQ(error_code(0), 5) << "no such unit";
  EXPECT_TRUE(setup(0xA1, 0x81, 0x7700, kProcessingUnit << 8, 2).stalled);
  EXPECT_EQ(error_code(0), 6) << "no such control";
  EXPECT_TRUE(setup(0xA1, 0x81, 0x0900, 0, 2).stalled);
  EXPECT_EQ(error_code(0), 6) << "no such control of the interface";
  EXPECT_TRUE(setup(0xA1, 0x01, 0x0400, kProcessingUnit << 8, 2).stalled);
  EXPECT_EQ(error_code(0), 7) << "set, but in the other direction";
  EXPECT_FALSE(setup(0xA1, 0x81, 0x0400, kProcessingUnit << 8, 2).stalled);
  EXPECT_EQ(error_code(0), 0);
  EXPECT_EQ(device_.counts().stalls, 6U);
}

TEST_F(DeviceTest, ACommitStartsAStreamWithTheCurrentControls) {
  configure();
  EXPECT_FALSE(setup(0x21, 1, 0x0200, kCameraTerminal << 8, 1, {1}).stalled);
  EXPECT_FALSE(setup(0x21, 1, 0x0400, kCameraTerminal << 8, 4, {77, 0, 0, 0}).stalled);
  const Bytes probe = setup(0xA1, 0x81, 0x0100, 1, 34).data;
  EXPECT_FALSE(setup(0x21, 1, 0x0100, 1, 34, probe).stalled);
  EXPECT_EQ(source_.configured, 0);
  EXPECT_FALSE(setup(0x21, 1, 0x0200, 1, 34, probe).stalled);
  EXPECT_EQ(source_.configured, 1);
  host_.queue(device_.stream(), 5);
  device_.stream().run({0}, host_);
  for (std::int64_t t = 0; t < 10 && host_.frames.empty(); ++t) {
    for (int k = 0; k < 20; ++k) {
      host_.queue(device_.stream(), 5);
      device_.stream().run({t * 10'000'000}, host_);
    }
  }
  ASSERT_FALSE(host_.frames.empty());
  EXPECT_EQ(get(host_.frames[0].bytes, 0, 4), 77U);
}

TEST_F(DeviceTest, ACommitThatTheFrameSourceRejectsStalls) {
  configure();
  source_.refuse = {StatusCode::not_found, "no scene"};
  const Bytes probe = setup(0xA1, 0x81, 0x0100, 1, 34).data;
  EXPECT_TRUE(setup(0x21, 1, 0x0200, 1, 34, probe).stalled);
  EXPECT_EQ(error_code(1), 1) << "not ready";
}

TEST_F(DeviceTest, ReportsAnEndpointHalt) {
  configure();
  EXPECT_EQ(setup(0x82, 0, 0, 0x81, 2).data, (Bytes{0, 0}));
  EXPECT_FALSE(setup(0x02, 3, 0, 0x81, 0).stalled);
  EXPECT_EQ(setup(0x82, 0, 0, 0x81, 2).data, (Bytes{1, 0}));
  host_.queue(device_.stream(), 1);
  EXPECT_EQ(host_.count(TransferStatus::stalled), 1);
  EXPECT_FALSE(setup(0x02, 1, 0, 0x81, 0).stalled);
  EXPECT_EQ(setup(0x82, 0, 0, 0x81, 2).data, (Bytes{0, 0}));
  EXPECT_TRUE(setup(0x02, 1, 0, 0x82, 0).stalled);
  EXPECT_TRUE(setup(0x82, 0, 0, 0x02, 2).stalled);
}

TEST_F(DeviceTest, PowerOnResetsControlsAndABusResetDoesNot) {
  configure();
  EXPECT_FALSE(setup(0x21, 1, 0x0400, kProcessingUnit << 8, 2, {0x2C, 1}).stalled);
  device_.bus_reset();
  EXPECT_EQ(device_.controls().settings().gain, 3);
  device_.power_on();
  EXPECT_EQ(device_.controls().settings().gain, 1);
}

TEST_F(DeviceTest, SurvivesRandomRequests) {
  std::mt19937 random(20261122);
  const auto byte = [&] { return static_cast<std::uint8_t>(random()); };
  // Three quarters of the requests are nearly valid, to reach more code; the others are random.
  const std::vector<std::uint8_t> types = {0x00, 0x01, 0x02, 0x80, 0x81, 0x82, 0x21,
                                           0xA1, 0x21, 0xA1, 0x22, 0xC0, 0x40};
  const std::vector<std::uint8_t> requests = {0, 1, 3, 5, 6, 8, 9, 10, 11, 0x81, 0x82, 0x83, 0x84, 0x85, 0x86, 0x87};
  for (int i = 0; i < 200'000; ++i) {
    SetupPacket packet;
    const bool near = random() % 4 != 0;
    packet.request_type = near ? types[random() % types.size()] : byte();
    packet.request = near ? requests[random() % requests.size()] : byte();
    packet.value = static_cast<std::uint16_t>(near ? (random() % 16) << 8 | random() % 3 : random());
    packet.index = static_cast<std::uint16_t>(near ? (random() % 5) << 8 | random() % 3 : random());
    packet.length = static_cast<std::uint16_t>(random() % 8 == 0 ? random() : random() % 40);
    Bytes data(packet.request_type & 0x80 ? 0 : random() % 40);
    for (auto& b : data) b = byte();
    const SetupReply reply = device_.setup(packet, data, host_);
    ASSERT_LE(reply.data.size(), packet.length);
    if (reply.stalled) {
      ASSERT_TRUE(reply.data.empty());
    }
    if (random() % 16 == 0) device_.stream().submit(random(), random() % 4 == 0 ? random() : random() % 2000, host_);
    if (random() % 64 == 0) device_.stream().cancel(random() % 100, host_);
    if (random() % 4096 == 0) (void)device_.set_configuration(1);
    ASSERT_LE(device_.stream().waiting_transfers(), Stream::kMaxTransfers);
  }
  EXPECT_GT(host_.count(TransferStatus::refused), 0) << "too many or too long transfers";
  const SensorSettings settings = device_.controls().settings();
  EXPECT_GT(settings.exposure_s, 0);
  EXPECT_GE(settings.gain, 1);
  EXPECT_GE(settings.kelvin, 2800);
  // The device still works.
  device_.power_on();
  configure();
  EXPECT_EQ(setup(0x80, 6, 0x0100, 0, 64).data, device_descriptor());
}

}  // namespace
}  // namespace lightwell::usb_camera
