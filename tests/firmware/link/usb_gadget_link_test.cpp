// UsbGadgetLink on a port that the test controls.
#include "link/usb_gadget/usb_gadget_link.hpp"

#include <cerrno>
#include <condition_variable>
#include <deque>
#include <mutex>

#include <gtest/gtest.h>

#include <lightwell/link_message.hpp>

#include "support/fake_commands.hpp"
#include "support/plane_messages.hpp"
#include "support/wait.hpp"

namespace lightwell::test {
namespace {

using Bytes = std::vector<std::byte>;
using Kind = PortEvent::Kind;

/// A port whose transfers are begun by the link and ended by the test.
class ManualPort final : public GadgetPort {
 public:
  Status open() override { return open_status; }
  void close() override { closed = true; }
  bool begin_send(std::span<const std::byte> bytes) override {
    const std::lock_guard lock(mutex_);
    if (send_failures > 0) {
      --send_failures;
      return false;
    }
    sending_ = Bytes(bytes.begin(), bytes.end());
    return true;
  }
  bool begin_receive(std::span<std::byte> bytes) override {
    const std::lock_guard lock(mutex_);
    receiving_ = bytes;
    return true;
  }
  PortEvent wait(Duration timeout) override {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::nanoseconds(timeout.ns), [&] { return !events_.empty() || woken_; });
    woken_ = false;
    if (events_.empty()) return {Kind::woken};
    const PortEvent event = events_.front();
    events_.pop_front();
    return event;
  }
  void wake() override {
    const std::lock_guard lock(mutex_);
    woken_ = true;
    changed_.notify_all();
  }

  // Called by the test.

  void emit(PortEvent event) {
    const std::lock_guard lock(mutex_);
    events_.push_back(event);
    changed_.notify_all();
  }
  /// Waits for a receive transfer of the link and completes it with these bytes.
  void deliver(const Bytes& bytes) {
    ASSERT_TRUE(becomes_true("the link reads", [&] { return reads(); }));
    const std::lock_guard lock(mutex_);
    std::copy(bytes.begin(), bytes.end(), receiving_.begin());
    receiving_ = {};
    events_.push_back({Kind::received, bytes.size(), 0});
    changed_.notify_all();
  }
  /// Waits for a send transfer of the link, completes it and returns its bytes.
  std::optional<Bytes> take() {
    if (!becomes_true("the link sends", [&] { return sends(); })) return std::nullopt;
    const std::lock_guard lock(mutex_);
    Bytes bytes = *std::exchange(sending_, std::nullopt);
    events_.push_back({Kind::sent, bytes.size(), 0});
    changed_.notify_all();
    return bytes;
  }
  /// Waits for a send transfer of the link and ends it with an error.
  void fail() {
    ASSERT_TRUE(becomes_true("the link sends", [&] { return sends(); }));
    const std::lock_guard lock(mutex_);
    sending_.reset();
    events_.push_back({Kind::sent, 0, ESHUTDOWN});
    changed_.notify_all();
  }
  bool sends() {
    const std::lock_guard lock(mutex_);
    return sending_.has_value();
  }
  bool reads() {
    const std::lock_guard lock(mutex_);
    return !receiving_.empty();
  }

  Status open_status;
  int send_failures = 0;
  bool closed = false;

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<PortEvent> events_;
  bool woken_ = false;
  std::optional<Bytes> sending_;
  std::span<std::byte> receiving_;
};

class UsbGadgetLinkTest : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(link_->start().ok()); }
  void TearDown() override { link_->stop(); }

  Bytes request() {
    Bytes message, frame;
    encode_info_request(++requests_, message);
    EXPECT_TRUE(host_.write(FrameKind::request, message, frame).ok());
    return frame;
  }
  Bytes plane_request() {
    Bytes message, frame;
    encode_plane_request(++requests_, message);
    EXPECT_TRUE(host_.write(FrameKind::request, message, frame).ok());
    return frame;
  }
  static EncodedDescriptor descriptor(int number) {
    return std::make_shared<const Bytes>(100, static_cast<std::byte>(number));
  }
  /// A host connects, sends a request and reads the response.
  void connect_host() {
    port_->emit({Kind::enabled});
    port_->deliver(request());
    EXPECT_EQ(next().kind, FrameKind::response);
  }
  /// A host connects and requests planes.
  void connect_host_with_planes() {
    connect_host();
    port_->deliver(plane_request());
    EXPECT_EQ(next().kind, FrameKind::response);
  }
  /// The name of the plane's message in the next frame.
  std::string next_plane() {
    const ReceivedFrame frame = next();
    return frame.kind == FrameKind::plane ? plane_name(frame.payload) : "a frame of another kind";
  }
  /// The status of the response in the next frame.
  StatusCode next_status() {
    const ReceivedFrame frame = next();
    const Result<LinkResponse> response = decode_link_response(frame.payload);
    EXPECT_TRUE(frame.kind == FrameKind::response && response.ok());
    return response->status.code();
  }
  struct ReceivedFrame {
    FrameKind kind{};
    std::uint64_t number = 0;
    Bytes payload;
  };
  ReceivedFrame next() {
    ReceivedFrame received;
    const std::optional<Bytes> bytes = port_->take();
    if (!bytes) {
      ADD_FAILURE() << "nothing is sent";
      return received;
    }
    const FrameReader::FrameCallback take = [&](const LinkFrame& f) {
      received = {f.kind, f.sequence, {f.payload.begin(), f.payload.end()}};
    };
    reader_.push(*bytes, take);
    reader_.end_transfer(take);
    return received;
  }

  FakeCommands commands_;
  ManualPort* port_ = new ManualPort;  // Owned by the link.
  std::unique_ptr<UsbGadgetLink> link_ = make_usb_gadget_link(std::unique_ptr<GadgetPort>(port_), 42, commands_);
  FrameWriter host_{7};
  FrameReader reader_;
  std::uint32_t requests_ = 0;
};

TEST_F(UsbGadgetLinkTest, SendsNothingUntilAHostSendsARequest) {
  link_->publish(descriptor(1));
  port_->emit({Kind::enabled});
  ASSERT_TRUE(becomes_true("the link reads", [&] { return port_->reads(); }));
  link_->publish(descriptor(2));
  EXPECT_FALSE(port_->sends()) << "it would be outdated when a host connects";
  EXPECT_EQ(link_->usb_counters().descriptors_without_listener, 2U);
  EXPECT_EQ(link_->counters().clients, 0U);
  port_->deliver(request());
  EXPECT_EQ(next().kind, FrameKind::response);
  EXPECT_EQ(link_->counters().clients, 1U);
  link_->publish(descriptor(3));
  EXPECT_EQ(next().payload, *descriptor(3));
}

TEST_F(UsbGadgetLinkTest, ASlowHostGetsTheNewestAndDoesNotBlockThePublisher) {
  connect_host();
  link_->publish(descriptor(1));
  ASSERT_TRUE(becomes_true("the first transfer is in progress", [&] { return port_->sends(); }));
  for (int i = 2; i <= 9; ++i) link_->publish(descriptor(i));
  EXPECT_EQ(link_->counters().coalesced, 7U);
  EXPECT_EQ(next().payload, *descriptor(1));
  EXPECT_EQ(next().payload, *descriptor(9));
  EXPECT_FALSE(port_->sends());
}

TEST_F(UsbGadgetLinkTest, SendsResponsesBeforeDescriptors) {
  connect_host();
  link_->publish(descriptor(1));
  ASSERT_TRUE(becomes_true("the first transfer is in progress", [&] { return port_->sends(); }));
  link_->publish(descriptor(2));
  port_->deliver(request());
  ASSERT_TRUE(becomes_true("the request was received", [&] { return link_->usb_counters().requests == 2; }));
  EXPECT_EQ(next().payload, *descriptor(1));
  EXPECT_EQ(next().kind, FrameKind::response);
  EXPECT_EQ(next().payload, *descriptor(2));
}

TEST_F(UsbGadgetLinkTest, AFailedTransferIsCountedAndVisibleInTheSequenceNumbers) {
  connect_host();
  link_->publish(descriptor(1));
  port_->fail();
  link_->publish(descriptor(2));
  const ReceivedFrame received = next();
  EXPECT_EQ(received.payload, *descriptor(2));
  EXPECT_EQ(received.number, 3U) << "1 was the response, 2 the failed frame";
  EXPECT_EQ(reader_.counters().lost, 1U);
  EXPECT_EQ(link_->usb_counters().frames_failed, 1U);
  EXPECT_EQ(link_->usb_counters().frames_begun, 3U);
}

TEST_F(UsbGadgetLinkTest, RetriesWhenATransferCannotBegin) {
  connect_host();
  port_->send_failures = 2;
  for (int i = 1; i <= 3; ++i) {
    link_->publish(descriptor(i));
    std::this_thread::sleep_for(std::chrono::milliseconds(40));
  }
  EXPECT_TRUE(becomes_true("the link sends again", [&] { return port_->sends(); }));
  EXPECT_EQ(link_->usb_counters().frames_failed, 2U);
}

TEST_F(UsbGadgetLinkTest, ANewStreamNeedsARequestAndResumeSendsTheNewest) {
  connect_host();
  // As after a reset: enabled again without a preceding disable.
  port_->emit({Kind::enabled});
  ASSERT_TRUE(becomes_true("no host is listening", [&] { return link_->counters().clients == 0; }));
  link_->publish(descriptor(1));
  EXPECT_FALSE(port_->sends());
  port_->deliver(request());
  EXPECT_EQ(next().kind, FrameKind::response);

  port_->emit({Kind::suspended});
  port_->deliver(Bytes{});  // Queued behind the event, so that the link has processed it.
  ASSERT_TRUE(becomes_true("the link reads", [&] { return port_->reads(); }));
  link_->publish(descriptor(2));
  link_->publish(descriptor(3));
  EXPECT_FALSE(port_->sends());
  port_->emit({Kind::resumed});
  EXPECT_EQ(next().payload, *descriptor(3));
}

TEST_F(UsbGadgetLinkTest, InvalidInputIsRefusedAndCounted) {
  connect_host();
  const Bytes replayed = request();
  port_->deliver(replayed);
  EXPECT_EQ(next().kind, FrameKind::response);
  port_->deliver(replayed);
  port_->deliver(Bytes(16 * 1024, std::byte{'L'}));
  port_->deliver(Bytes(77, std::byte{0xEE}));
  Bytes frame, damaged = request();
  damaged[20] ^= std::byte{1};  // A byte of the sequence number.
  port_->deliver(damaged);
  Bytes cut = request();
  cut.resize(cut.size() / 2);
  port_->deliver(cut);
  ASSERT_TRUE(host_.write(FrameKind::descriptor, *descriptor(1), frame).ok());
  port_->deliver(frame);
  ASSERT_TRUE(host_.write(FrameKind::request, Bytes(50, std::byte{0xFF}), frame).ok());
  port_->deliver(frame);
  port_->deliver(request());
  EXPECT_EQ(next().kind, FrameKind::response);
  const UsbGadgetCounters c = link_->usb_counters();
  EXPECT_EQ(c.requests, 3U);
  EXPECT_EQ(c.from_host.replayed, 1U);
  EXPECT_EQ(c.from_host.bad_headers, 1U);
  EXPECT_GE(c.from_host.cut_off, 1U);
  EXPECT_EQ(c.invalid_requests, 2U);
  EXPECT_GE(c.from_host.skipped_bytes, 16U * 1024 + 77);
  EXPECT_EQ(link_->counters().messages_refused, c.from_host.refused() + 2);
  EXPECT_FALSE(commands_.lux_);
}

TEST_F(UsbGadgetLinkTest, TheNumberOfQueuedResponsesIsLimited) {
  connect_host();
  for (int i = 0; i < 40; ++i) port_->deliver(request());
  ASSERT_TRUE(becomes_true("all requests were received", [&] { return link_->usb_counters().requests == 41; }));
  // One response is being sent, sixteen are queued.
  EXPECT_EQ(link_->usb_counters().responses_dropped, 40U - 17U);
}

TEST_F(UsbGadgetLinkTest, StopsSendingToAHostWithoutRequests) {
  connect_host();
  EXPECT_TRUE(becomes_true(
      "the host no longer counts as listening", [&] { return link_->counters().clients == 0; },
      std::chrono::milliseconds(kListenerTimeout.ns / 1'000'000 + 20'000)));
  link_->publish(descriptor(1));
  EXPECT_EQ(link_->usb_counters().descriptors_without_listener, 1U);
}

TEST_F(UsbGadgetLinkTest, PlanesAreSentOnRequestOnly) {
  connect_host();
  link_->publish_plane(plane_update(1, 1, 2));
  link_->publish(descriptor(1));
  EXPECT_EQ(next().payload, *descriptor(1));
  EXPECT_FALSE(port_->sends());
  // What is known is sent at once, whole.
  port_->deliver(plane_request());
  EXPECT_EQ(next_status(), StatusCode::ok);
  EXPECT_EQ(next_plane(), "whole1.0");
  EXPECT_EQ(next_plane(), "whole1.1");
  link_->publish_plane(plane_update(2, 1, 2));
  EXPECT_EQ(next_plane(), "change2.0");
  EXPECT_EQ(link_->usb_counters().plane_messages_begun, 3U);
  EXPECT_EQ(link_->usb_counters().descriptors_begun, 1U);

  // The next host gets none without a request of its own.
  port_->emit({Kind::enabled});
  connect_host();
  link_->publish_plane(plane_update(3, 1, 2));
  link_->publish(descriptor(2));
  EXPECT_EQ(next().payload, *descriptor(2));
  EXPECT_FALSE(port_->sends());
}

TEST_F(UsbGadgetLinkTest, APlaneDelaysADescriptorByOneMessageAtMost) {
  connect_host_with_planes();
  link_->publish_plane(plane_update(1, 7, 7, kMaxPlaneMessageBytes));
  ASSERT_TRUE(becomes_true("the first message is in progress", [&] { return port_->sends(); }));
  for (int k = 0; k < 6; ++k) {
    link_->publish(descriptor(k));
    port_->deliver(request());
    ASSERT_TRUE(becomes_true("the request was received",
                             [&] { return link_->usb_counters().requests == static_cast<unsigned>(k + 3); }));
    EXPECT_EQ(next_plane(), "whole1." + std::to_string(k)) << "it was in progress";
    EXPECT_EQ(next().kind, FrameKind::response);
    EXPECT_EQ(next().payload, *descriptor(k));
    ASSERT_TRUE(becomes_true("the next message is in progress", [&] { return port_->sends(); }));
  }
  EXPECT_EQ(next_plane(), "whole1.6");
}

/// A host that reads more slowly than descriptors come gets the plane all the same.
TEST_F(UsbGadgetLinkTest, DescriptorsDoNotStarveAPlane) {
  connect_host_with_planes();
  link_->publish_plane(plane_update(1, 3, 3));
  int planes = 0;
  for (int k = 0; k < 8; ++k) {
    ASSERT_TRUE(becomes_true("a transfer is in progress", [&] { return port_->sends(); }));
    link_->publish(descriptor(k));
    planes += next().kind == FrameKind::plane ? 1 : 0;
  }
  EXPECT_EQ(planes, 3);
}

TEST_F(UsbGadgetLinkTest, ASlowHostGetsTheNewestPlaneWhole) {
  connect_host_with_planes();
  link_->publish_plane(plane_update(1, 1, 2));
  ASSERT_TRUE(becomes_true("the first message is in progress", [&] { return port_->sends(); }));
  for (int number = 2; number <= 9; ++number) link_->publish_plane(plane_update(number, 1, 2));
  EXPECT_EQ(link_->usb_counters().planes_replaced, 7U);
  EXPECT_EQ(next_plane(), "whole1.0");
  EXPECT_EQ(next_plane(), "whole1.1");
  EXPECT_EQ(next_plane(), "whole9.0");
  EXPECT_EQ(next_plane(), "whole9.1");
  // So does one whose transfer failed.
  link_->publish_plane(plane_update(10, 1, 1));
  port_->fail();
  link_->publish_plane(plane_update(11, 1, 1));
  EXPECT_EQ(next_plane(), "whole11.0");
}

TEST_F(UsbGadgetLinkTest, RequestsOfPlanesAreLimited) {
  connect_host_with_planes();
  link_->publish_plane(plane_update(1, 1, 1));
  EXPECT_EQ(next_plane(), "whole1.0");
  for (int k = 0; k < 3; ++k) {
    port_->deliver(plane_request());
    EXPECT_EQ(next_status(), StatusCode::resource_exhausted);
  }
  EXPECT_FALSE(port_->sends()) << "the plane is not sent again";
  EXPECT_EQ(link_->usb_counters().plane_requests_refused, 3U);
  EXPECT_EQ(link_->counters().messages_refused, 3U);
  std::this_thread::sleep_for(std::chrono::nanoseconds(kPlaneRepeat.ns));
  port_->deliver(plane_request());
  EXPECT_EQ(next_status(), StatusCode::ok);
  EXPECT_EQ(next_plane(), "whole1.0");
}

TEST(UsbGadgetLinkStart, FailsWithThePortsReason) {
  FakeCommands commands;
  auto port = std::make_unique<ManualPort>();
  port->open_status = Status(StatusCode::not_found, "no FunctionFS");
  const auto link = make_usb_gadget_link(std::move(port), 1, commands);
  EXPECT_EQ(link->start().message(), "no FunctionFS");
  link->stop();

  const auto real = make_usb_gadget_link({.functionfs_mount = "/nonexistent"}, commands);
  EXPECT_EQ(real->start().code(), StatusCode::not_found);
}

}  // namespace
}  // namespace lightwell::test
