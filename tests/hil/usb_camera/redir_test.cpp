// The camera over its socket, with a guest in this process instead of QEMU.
#include <random>
#include <thread>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include "hil/usb_camera/known_source.hpp"
#include "hil/usb_camera/redir_guest.hpp"
#include "support/temp_dir.hpp"
#include "support/wait.hpp"
#include "usb_camera/server.hpp"

namespace lightwell::usb_camera {
namespace {

using bench::RedirGuest;
using ::testing::HasSubstr;

/// Runs the camera in a separate thread.
class RedirTest : public ::testing::Test {
 protected:
  void SetUp() override { start(Pace::free); }
  void TearDown() override { stop(); }

  void start(Pace pace) {
    DeviceOptions options;
    options.formats = formats_for("single");
    options.stream.pace = pace;
    device_ = std::make_unique<Device>(options, source_, log_);
    CommandTargets targets;
    targets.device = device_.get();
    targets.log = &log_;
    Result<std::unique_ptr<Server>> server = Server::open({folder_.path("redir"), folder_.path("control")}, targets);
    ASSERT_TRUE(server) << server.status().message();
    server_ = std::move(*server);
    thread_ = std::thread([this] { EXPECT_TRUE(server_->run().ok()); });
  }
  void stop() {
    if (!thread_.joinable()) return;
    server_->stop();
    thread_.join();
    server_.reset();
  }

  [[nodiscard]] std::unique_ptr<RedirGuest> guest() {
    Result<FileDescriptor> socket = connect_to(folder_.path("redir"));
    EXPECT_TRUE(socket) << socket.status().message();
    return std::make_unique<RedirGuest>(std::move(*socket));
  }
  /// A guest that has configured the camera.
  [[nodiscard]] std::unique_ptr<RedirGuest> ready_guest() {
    auto g = guest();
    EXPECT_TRUE(g->until([&] { return g->connected; })) << "the camera is plugged in";
    EXPECT_TRUE(g->set_configuration(1));
    return g;
  }

  std::string say(const std::string& line) {
    Result<FileDescriptor> socket = connect_to(folder_.path("control"));
    EXPECT_TRUE(socket);
    const std::string text = line + "\n";
    EXPECT_EQ(::send(socket->get(), text.data(), text.size(), MSG_NOSIGNAL), static_cast<ssize_t>(text.size()));
    std::string out;
    char c = 0;
    while (::recv(socket->get(), &c, 1, 0) == 1 && c != '\n') out += c;
    return out;
  }

  test::TempDir folder_;
  bench::KnownSource source_;
  FrameLog log_;
  std::unique_ptr<Device> device_;
  std::unique_ptr<Server> server_;
  std::thread thread_;
};

TEST_F(RedirTest, ConnectsAsAHighSpeedCamera) {
  const auto g = ready_guest();
  EXPECT_EQ(g->vendor, kVendor);
  EXPECT_EQ(g->product, kProduct);
  EXPECT_EQ(g->speed, 2) << "high";
  EXPECT_EQ(g->interfaces, 2);
  EXPECT_EQ(g->stream_endpoint_type, 2) << "bulk";
  EXPECT_EQ(g->stream_packet, 512);
  const auto descriptor = g->control(0x80, 6, 0x0200, 0, 4096);
  ASSERT_TRUE(descriptor);
  EXPECT_EQ(descriptor->data, configuration_descriptor(formats_for("single")));
  const auto stalled = g->control(0x80, 6, 0x0F00, 0, 4096);
  ASSERT_TRUE(stalled);
  EXPECT_TRUE(stalled->stalled);
  EXPECT_FALSE(g->set_configuration(7));
}

TEST_F(RedirTest, StreamsAHundredCompleteFrames) {
  const auto g = ready_guest();
  ASSERT_TRUE(g->commit(1, 2, 333333));
  ASSERT_TRUE(g->stream(100));
  stop();
  std::vector<FrameRecord> sent;
  for (const FrameRecord& r : log_.records())
    if (r.outcome == Outcome::sent) sent.push_back(r);
  ASSERT_GE(sent.size(), 100U);
  for (std::size_t i = 0; i < 100; ++i) {
    const std::vector<std::byte> picture = bench::known_picture(sent[i].number, sent[i].settings, 160 * 120 * 2);
    const auto& got = g->video->frames[i].bytes;
    ASSERT_EQ(got.size(), picture.size());
    EXPECT_TRUE(std::equal(got.begin(), got.end(), reinterpret_cast<const std::uint8_t*>(picture.data()))) << i;
    EXPECT_EQ(g->video->frames[i].presentation, clock_ticks(sent[i].began));
  }
}

TEST_F(RedirTest, UnplugAndReplugOnOneConnection) {
  const auto g = ready_guest();
  ASSERT_TRUE(g->commit(1, 2, 333333));
  ASSERT_TRUE(g->stream(5));
  EXPECT_EQ(say(R"({"command": "unplug"})"), R"({"ok":true})");
  ASSERT_TRUE(g->until([&] { return !g->connected; }));
  EXPECT_THAT(say(R"({"command": "status"})"), HasSubstr(R"("plugged":false)"));
  EXPECT_EQ(say(R"({"command": "plug"})"), R"({"ok":true})");
  ASSERT_TRUE(g->until([&] { return g->connected; }));
  EXPECT_EQ(g->connects, 2);
  ASSERT_TRUE(g->set_configuration(1));
  g->video.reset();
  ASSERT_TRUE(g->commit(1, 2, 333333));
  EXPECT_TRUE(g->stream(5));
}

TEST_F(RedirTest, UnplugByClosingAndANewConnection) {
  auto g = ready_guest();
  EXPECT_EQ(say(R"({"command": "unplug", "how": "close"})"), R"({"ok":true})");
  ASSERT_TRUE(g->until([&] { return g->gone; }));
  g = guest();  // As QEMU's chardev with reconnect=1; the connection is accepted when the camera is plugged in.
  EXPECT_EQ(say(R"({"command": "plug"})"), R"({"ok":true})");
  ASSERT_TRUE(g->until([&] { return g->connected; }));
  ASSERT_TRUE(g->set_configuration(1));
  ASSERT_TRUE(g->commit(1, 2, 333333));
  EXPECT_TRUE(g->stream(5));
}

TEST_F(RedirTest, AcceptsANewGuestAfterOneHasDied) {
  {
    const auto g = ready_guest();
    ASSERT_TRUE(g->commit(1, 1, 333333));
    ASSERT_TRUE(g->stream(2));
  }
  const auto g = ready_guest();
  ASSERT_TRUE(g->commit(1, 2, 333333));
  EXPECT_TRUE(g->stream(5));
}

TEST_F(RedirTest, AStallAndItsRecovery) {
  const auto g = ready_guest();
  ASSERT_TRUE(g->commit(1, 2, 333333));
  ASSERT_TRUE(g->stream(3));
  EXPECT_EQ(say(R"({"command": "stall"})"), R"({"ok":true})");
  ASSERT_TRUE(g->until([&] { return g->video->count(TransferStatus::stalled) > 0; }));
  const auto status = g->control(0x82, 0, 0, 0x81, 2);
  ASSERT_TRUE(status);
  EXPECT_EQ(status->data, (Bytes{1, 0}));
  ASSERT_TRUE(g->control(0x02, 1, 0, 0x81, 0));
  g->video.reset();
  EXPECT_TRUE(g->stream(5));
}

TEST_F(RedirTest, InjectedFaultsReachTheGuest) {
  const auto g = ready_guest();
  ASSERT_TRUE(g->commit(1, 2, 333333));
  EXPECT_EQ(say(R"({"command": "tear", "frames": 2})"), R"({"ok":true})");
  ASSERT_TRUE(g->stream(4));
  EXPECT_EQ(g->video->frames[0].bytes.size(), 2 * (160 * 120 * 2 / 3U));
  EXPECT_EQ(g->video->frames[2].bytes.size(), 160 * 120 * 2U);
  EXPECT_THAT(say(R"({"command": "counters"})"), HasSubstr(R"("torn":2)"));
}

TEST_F(RedirTest, CancelledTransfersAreAnswered) {
  const auto g = ready_guest();
  for (std::uint64_t id = 500; id < 510; ++id) g->submit(id, 16384);
  for (std::uint64_t id = 500; id < 510; ++id) g->cancel(id);
  ASSERT_TRUE(g->until([&] { return g->bulk_results.size() == 10; }));
  for (const auto& [id, status] : g->bulk_results) EXPECT_EQ(status, TransferStatus::cancelled) << id;
}

TEST_F(RedirTest, ABusResetEndsTheStream) {
  const auto g = ready_guest();
  ASSERT_TRUE(g->commit(1, 2, 333333));
  ASSERT_TRUE(g->stream(3));
  g->reset_bus();
  EXPECT_TRUE(g->control(0xA1, 0x81, 0x0100, 1, 34)->stalled) << "not configured";
  ASSERT_TRUE(g->set_configuration(1));
  g->video.reset();
  ASSERT_TRUE(g->commit(1, 2, 333333));
  EXPECT_TRUE(g->stream(3));
}

TEST_F(RedirTest, RejectsUnsupportedRequests) {
  const auto g = ready_guest();
  g->send_unsupported_requests();
  g->submit(700, 512, 0x82);
  g->submit(701, std::size_t{1} << 24);
  ASSERT_TRUE(g->until([&] { return g->refusals == 4 && g->bulk_results.size() == 2; }));
  EXPECT_EQ(g->bulk_results[700], TransferStatus::refused);
  EXPECT_EQ(g->bulk_results[701], TransferStatus::refused);
  ASSERT_TRUE(g->commit(1, 2, 333333));
  EXPECT_TRUE(g->stream(3));
}

TEST_F(RedirTest, AGuestThatDoesNotReadIsThrottled) {
  // The guest requests 200,000 descriptors and reads none.
  Result<FileDescriptor> socket = connect_to(folder_.path("redir"));
  ASSERT_TRUE(socket);
  auto g = std::make_unique<RedirGuest>(std::move(*socket));
  ASSERT_TRUE(g->until([&] { return g->connected; }));
  // type 100 (control packet), length 10, id of 64 bits, then the header of GET_DESCRIPTOR(configuration).
  Bytes ask;
  put(ask, 100, 4);
  put(ask, 10, 4);
  put(ask, 1, 8);
  for (const unsigned b : {0x80U, 6U, 0x80U, 0U, 0x00U, 0x02U, 0U, 0U, 0x00U, 0x10U}) put(ask, b, 1);
  Bytes many;
  for (int i = 0; i < 1000; ++i) many.insert(many.end(), ask.begin(), ask.end());
  std::thread flood([&] {
    for (int i = 0; i < 200; ++i) g->send_raw(many);
  });
  // 200,000 responses of 1.5 kB would be 300 MB. The camera must not buffer them, and must still serve its control
  // socket.
  const auto setups = [&] {
    const std::string counters = say(R"({"command": "counters"})");
    const std::size_t at = counters.find("\"setups\":");
    return at == std::string::npos ? 0UL : std::stoul(counters.substr(at + 9));
  };
  unsigned long before = 0, now = 0;
  EXPECT_TRUE(test::becomes_true("the camera stops reading the flood", [&] {
    before = std::exchange(now, setups());
    return now > 0 && now == before;
  }));
  EXPECT_LT(now, 20'000U);
  stop();
  flood.join();
}

TEST_F(RedirTest, SurvivesRandomBytes) {
  std::mt19937 random(7);
  for (int round = 0; round < 50; ++round) {
    const auto g = guest();
    if (round % 2 == 0) {
      ASSERT_TRUE(g->until([&] { return g->connected; }));
    }
    Bytes noise(static_cast<std::size_t>(random() % 4000));
    for (auto& b : noise) b = static_cast<std::uint8_t>(random() % 4 == 0 ? random() : random() % 4);
    g->send_raw(noise);
  }
  const auto g = ready_guest();
  ASSERT_TRUE(g->commit(1, 2, 333333));
  EXPECT_TRUE(g->stream(3));
}

TEST_F(RedirTest, ClientsOfTheControlSocketAreBounded) {
  std::vector<FileDescriptor> clients;
  for (int i = 0; i < 20; ++i) {
    Result<FileDescriptor> socket = connect_to(folder_.path("control"));
    if (socket) clients.push_back(std::move(*socket));
  }
  const std::string endless(100'000, 'x');
  for (const FileDescriptor& client : clients)
    (void)::send(client.get(), endless.data(), endless.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  EXPECT_TRUE(test::becomes_true("clients with endless lines are disconnected and others are served", [&] {
    return say(R"({"command": "status"})").find(R"("ok":true)") != std::string::npos;
  }));
}

TEST_F(RedirTest, ASecondCameraCannotHaveTheSameSocket) {
  CommandTargets targets;
  targets.device = device_.get();
  targets.log = &log_;
  const auto second = Server::open({folder_.path("redir"), ""}, targets);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.status().code(), StatusCode::resource_exhausted);
}

class PacedRedirTest : public RedirTest {
 protected:
  void SetUp() override { start(Pace::rate); }
};

TEST_F(PacedRedirTest, ControlsOverTheWireActOnTheFrameStated) {
  const auto g = ready_guest();
  ASSERT_TRUE(g->control(0x21, 1, 0x0200, kCameraTerminal << 8, 1, {1}));
  ASSERT_TRUE(g->control(0x21, 1, 0x0400, kCameraTerminal << 8, 4, {20, 0, 0, 0}));
  ASSERT_TRUE(g->commit(1, 2, 166666));
  ASSERT_TRUE(g->stream(5));
  ASSERT_TRUE(g->control(0x21, 1, 0x0400, kCameraTerminal << 8, 4, {40, 0, 0, 0}));
  ASSERT_TRUE(g->stream(10));
  EXPECT_EQ(get(g->video->frames[4].bytes, 0, 4), 20U);
  EXPECT_EQ(get(g->video->frames.back().bytes, 0, 4), 40U) << "the frame source writes the exposure into its images";
}

}  // namespace
}  // namespace lightwell::usb_camera
