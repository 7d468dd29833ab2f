// Captured planes over MQTT: from a fake probe at a real broker, with other clients that publish on its topic.
#include <chrono>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/plane_codec.hpp>

#include "core/clock_map.hpp"
#include "host_sdk/probe_at_broker.hpp"
#include "support/captured_planes.hpp"

namespace lightwell::test {
namespace {

using ::testing::HasSubstr;

std::string text_of(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

class MqttPlaneTest : public ::testing::Test {
 protected:
  MqttPlaneTest() {
    attic_.say_alive();
    ProbeOptions options = patient();
    options.plane = PlaneReception::receive;
    Result<Probe> probe = Probe::connect(broker_.uri("venue/attic"), options);
    EXPECT_TRUE(probe.ok()) << probe.status().message();
    probe_.emplace(std::move(*probe));
  }
  /// The plane's data is of `age_ns` before now, by the probe's clock.
  void publish_plane(PlaneEncoder& encoder, CapturedPlane& plane, std::int64_t age_ns, MqttClient& client) {
    plane.info.mid_exposure = {attic_.now() - age_ns};
    const auto messages = encoder.encode(plane, {attic_.now()});
    ASSERT_TRUE(messages.ok()) << messages.status().message();
    for (const auto& message : *messages) client.publish(attic_.topics.plane, text_of(message));
  }
  ::testing::AssertionResult revision_becomes(std::uint64_t revision) {
    return becomes_true("revision " + std::to_string(revision) + " is there; " + probe_->stats().last_error,
                        [&] { return probe_->plane().revision() == revision; });
  }
  static void wait_until_a_capture_can_be_replaced() {
    std::this_thread::sleep_for(std::chrono::nanoseconds(core::PlaneReplayProtection::kMinCaptureTime.ns));
  }
  /// Waits until the SDK has processed what was published before.
  void settle() {
    ++sequence_;
    attic_.say(attic_.descriptor(sequence_, 0));
    ASSERT_TRUE(newest_becomes(*probe_, sequence_));
  }

  Broker broker_;
  ProbeAtBroker attic_{broker_};
  MqttClient mallory_{broker_.port()};
  std::optional<Probe> probe_;
  PlaneEncoder encoder_{{.images = ImageRecipients::all_clients, .key_interval = {1'000'000'000'000}}};
  CapturedPlane plane_ = linear_plane();
  std::uint64_t sequence_ = 0;
};

TEST_F(MqttPlaneTest, ReceivesThePlaneOnRequestOnly) {
  const Result<Probe> without = Probe::connect(broker_.uri("venue/attic"), patient());
  ASSERT_TRUE(without.ok());
  publish_plane(encoder_, plane_, 500 * kMs, attic_.client);
  ASSERT_TRUE(revision_becomes(1));
  EXPECT_EQ(probe_->plane().info().capture, plane_.info.capture);
  EXPECT_NEAR(probe_->plane().diffuse({}).value.r, 0.5, 0.003);
  attic_.say(attic_.descriptor(77, 0));
  ASSERT_TRUE(newest_becomes(*without, 77));
  EXPECT_EQ(without->plane().validity(), Validity::none);
}

TEST_F(MqttPlaneTest, HostileMessagesAreRejectedAndCounted) {
  publish_plane(encoder_, plane_, 500 * kMs, attic_.client);
  ASSERT_TRUE(revision_becomes(1));
  mallory_.publish(attic_.topics.plane, "");
  mallory_.publish(attic_.topics.plane, std::string(1000, '\xFF'));
  mallory_.publish(attic_.topics.plane, attic_.descriptor(5, 0));
  EXPECT_TRUE(becomes_true("all are counted", [&] { return probe_->stats().undecodable == 3; }));
  mallory_.publish(attic_.topics.plane, std::string(kMaxPlaneMessageBytes + 1, 'x'));
  EXPECT_TRUE(becomes_true("it is counted", [&] { return probe_->stats().oversized == 1; }));
  settle();
  EXPECT_EQ(probe_->plane().revision(), 1U);
  publish_plane(encoder_, plane_, 0, attic_.client);
  EXPECT_TRUE(revision_becomes(2));
}

TEST_F(MqttPlaneTest, RecordedAndFutureMessagesAreRejected) {
  PlaneEncoder old(PlaneEncoderOptions{.images = ImageRecipients::all_clients});
  CapturedPlane yesterday = linear_plane(32, 10, 10);
  yesterday.info.capture = 0xBAD;
  publish_plane(encoder_, plane_, 500 * kMs, attic_.client);
  ASSERT_TRUE(revision_becomes(1));
  publish_plane(old, yesterday, 600'000 * kMs, mallory_);
  publish_plane(old, yesterday, -600'000 * kMs, mallory_);
  EXPECT_TRUE(becomes_true("all are counted", [&] { return probe_->stats().untimely == 2; }))
      << probe_->stats().untimely;
  EXPECT_THAT(probe_->stats().last_error, HasSubstr("plane"));
  EXPECT_EQ(probe_->plane().info().capture, plane_.info.capture);
  publish_plane(encoder_, plane_, 0, attic_.client);
  EXPECT_TRUE(revision_becomes(2)) << "the probe's capture goes on";
}

/// Whoever may publish can forge a capture; that of the probe is back with its next frame, and its next repetition.
TEST_F(MqttPlaneTest, AForgedCaptureDoesNotLast) {
  publish_plane(encoder_, plane_, 500 * kMs, attic_.client);
  ASSERT_TRUE(revision_becomes(1));
  PlaneEncoder forger(PlaneEncoderOptions{.images = ImageRecipients::all_clients});
  CapturedPlane forged = linear_plane(32, 10, 10);
  forged.info.capture = 0xBAD;
  wait_until_a_capture_can_be_replaced();
  publish_plane(forger, forged, 100 * kMs, mallory_);
  ASSERT_TRUE(becomes_true("the forged one is there", [&] { return probe_->plane().info().capture == 0xBAD; }));
  wait_until_a_capture_can_be_replaced();
  plane_.info.mid_exposure = {attic_.now()};
  ASSERT_TRUE(encoder_.encode(plane_, {attic_.now()}).ok());
  for (const auto& message : encoder_.whole()) attic_.client.publish(attic_.topics.plane, text_of(message));
  EXPECT_TRUE(
      becomes_true("the probe's is back", [&] { return probe_->plane().info().capture == plane_.info.capture; }));
}

}  // namespace
}  // namespace lightwell::test
