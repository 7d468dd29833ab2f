#include <string>

#include <gtest/gtest.h>

#include <lightwell/mqtt.hpp>
#include <lightwell/status.hpp>

#include "support/fake_commands.hpp"

namespace lightwell {
namespace {

std::string parsed(std::string_view uri) {
  const Result<MqttAddress> address = parse_mqtt_address(uri);
  return address.ok() ? address->uri() : "refused: " + address.status().message();
}

std::span<const std::byte> bytes(std::string_view text) { return std::as_bytes(std::span(text)); }

TEST(MqttAddress, NamesABrokerAndATopic) {
  EXPECT_EQ(parsed("mqtt://broker/venue/attic"), "mqtt://broker:1883/venue/attic");
  EXPECT_EQ(parsed("mqtts://broker/venue/attic/"), "mqtts://broker:8883/venue/attic");
  EXPECT_EQ(parsed("mqtt://10.0.0.7:2000/attic"), "mqtt://10.0.0.7:2000/attic");
  EXPECT_EQ(parsed("mqtt://[fe80::1]:2000/a/b"), "mqtt://[fe80::1]:2000/a/b");
  EXPECT_EQ(parse_mqtt_address("mqtt://[::1]/a")->host, "::1");
  EXPECT_TRUE(parse_mqtt_address("mqtt://broker", MqttBase::optional).ok());
}

TEST(MqttAddress, InvalidAddressIsRejectedWithTheRemedy) {
  for (const char* bad :
       {"", "mqtt://", "mqtt:///a", "mqtt://broker", "mqtt://broker/", "mqtt://broker:0/a", "mqtt://broker:70000/a",
        "mqtt://broker:1883x/a", "mqtt://::1/a", "mqtt://[::1/a", "mqtt://[::1]x/a", "mqtt://broker/venue/+",
        "mqtt://broker/#", "mqtt://broker/$SYS/a", "mqtt://broker//a", "mqtt://broker/a//b", "mqtt://broker/a\n",
        "mqtt://bro ker/a", "http://broker/a"}) {
    const Result<MqttAddress> address = parse_mqtt_address(bad);
    ASSERT_FALSE(address.ok()) << bad;
    EXPECT_EQ(address.status().code(), StatusCode::invalid_argument);
    EXPECT_NE(address.status().message().find("mqtt://BROKER"), std::string::npos) << address.status().message();
  }
  EXPECT_FALSE(parse_mqtt_address("mqtt://broker/" + std::string(201, 'a')).ok());
}

TEST(MqttAddress, RejectsAPasswordInTheAddress) {
  const std::string said = parsed("mqtt://ann:s3cret@broker/a");
  EXPECT_NE(said.find("their own fields"), std::string::npos) << said;
}

TEST(MqttTopics, ResponseTopicMustBeBelowTheProbesReplyTopic) {
  const MqttTopics topics("venue/attic");
  EXPECT_TRUE(is_reply_topic(topics, "venue/attic/clock/reply/0123abcd"));
  for (const std::string bad :
       {"", "venue/attic/status", "venue/attic/clock", "venue/attic/clock/reply", "venue/attic/clock/reply/",
        "venue/attic/clock/reply/a/b", "venue/attic/clock/reply/+", "venue/attic/clock/reply/#",
        "venue/attic/clock/reply/a b", "venue/cellar/clock/reply/a"})
    EXPECT_FALSE(is_reply_topic(topics, bad)) << bad;
  EXPECT_FALSE(is_reply_topic(topics, topics.replies + std::string(300, 'a')));
}

TEST(MqttAddress, SaysWhetherALoginMayGoOverPlainText) {
  const Result<MqttAddress> plain = parse_mqtt_address("mqtt://broker/venue/attic?security=plain");
  ASSERT_TRUE(plain.ok()) << plain.status().message();
  EXPECT_EQ(plain->base, "venue/attic");
  EXPECT_TRUE(check_plain_login(*plain).ok());
  EXPECT_EQ(plain->uri(), "mqtt://broker:1883/venue/attic") << "the permission for plain text is not passed on";
  const Status refused = check_plain_login(*parse_mqtt_address("mqtt://broker/venue/attic"));
  EXPECT_EQ(refused.code(), StatusCode::invalid_argument);
  EXPECT_NE(refused.message().find("mqtt://broker:1883/venue/attic?security=plain"), std::string::npos);
}

TEST(MqttLogin, IsTheFirstTwoLines) {
  using Login = std::pair<std::string, std::string>;
  EXPECT_EQ(mqtt_login_of("ann\ns3cret\n"), Login("ann", "s3cret"));
  EXPECT_EQ(mqtt_login_of("ann\r\ns3cret"), Login("ann", "s3cret"));
  EXPECT_EQ(mqtt_login_of("ann"), Login("ann", ""));
  EXPECT_EQ(mqtt_login_of(""), Login("", ""));
}

TEST(StatusMessage, RoundTripsIdentityAndCounters) {
  StatusSnapshot s = test::FakeCommands().status();
  s.probe_id = 0xFFFFFFFF;
  s.counters.frames = ~std::uint64_t{0};
  const Result<StatusSnapshot> back = decode_status(bytes(encode_status(s)));
  ASSERT_TRUE(back.ok()) << back.status().message();
  EXPECT_EQ(*back, s);
  s.T_world_probe.reset();
  EXPECT_EQ(*decode_status(bytes(encode_status(s))), s);
}

TEST(StatusMessage, TextsOfTheRecordingAreLimited) {
  StatusSnapshot s = test::FakeCommands().status();
  s.recording->end_reason.assign(1000, 'x');
  EXPECT_EQ(decode_status(bytes(encode_status(s)))->recording->end_reason, std::string(256, 'x')) << "cut by the probe";
  // InfoResponse { probe_name: "attic" recording { file or end_reason } } with a text of `size` bytes.
  const auto forged = [](int field, std::size_t size) {
    const auto nested = [](int number, const std::string& text) {
      const auto byte = [](std::size_t v) { return static_cast<char>(v); };
      const std::size_t size_low = text.size() & 0x7F;
      return std::string{static_cast<char>(number * 8 + 2), byte(0x80 | size_low), byte(text.size() >> 7)} + text;
    };
    return nested(1, "attic") + nested(9, nested(field, std::string(size, 'x')));
  };
  for (const int field : {2, 6}) {
    EXPECT_TRUE(decode_status(bytes(forged(field, 256))).ok());
    EXPECT_EQ(decode_status(bytes(forged(field, 257))).status().code(), StatusCode::invalid_argument);
  }
  s.recording.reset();
  EXPECT_EQ(*decode_status(bytes(encode_status(s))), s);
}

TEST(StatusMessage, InvalidMountingIsDropped) {
  StatusSnapshot s = test::FakeCommands().status();
  s.T_world_probe->pose.rotation = {0, 0, 0, 0};
  const Result<StatusSnapshot> back = decode_status(bytes(encode_status(s)));
  ASSERT_TRUE(back.ok()) << back.status().message();
  EXPECT_FALSE(back->T_world_probe);
}

TEST(StatusMessage, GonePayloadIsNotAStatus) { EXPECT_FALSE(decode_status(bytes(kMqttGone)).ok()); }

TEST(StatusMessage, TruncatedOrOversizedIsRejected) {
  StatusSnapshot s;
  s.probe_name = "attic";
  s.version = "0.1.0";
  s.camera = "sim:city";
  const std::string whole = encode_status(s);
  EXPECT_FALSE(decode_status({}).ok()) << "a probe has a name";
  for (std::size_t n = 1; n < whole.size(); ++n) {
    // Truncated between two fields, it is a valid shorter message, whose fields must have the sent values.
    const Result<StatusSnapshot> cut = decode_status(bytes(whole).first(n));
    EXPECT_EQ(cut.ok() ? cut->probe_name : "attic", "attic") << n;
  }
  s.probe_name = std::string(65, 'a');
  EXPECT_FALSE(decode_status(bytes(encode_status(s))).ok());
  s.probe_name = "attic";
  s.camera = std::string(257, 'a');
  EXPECT_FALSE(decode_status(bytes(encode_status(s))).ok());
}

TEST(ClockMessage, DecodesAClockOrRejects) {
  const Result<ProbeTime> clock = decode_clock(bytes(encode_clock({1'234'567'890'123})));
  ASSERT_TRUE(clock.ok());
  EXPECT_EQ(clock->ns, 1'234'567'890'123);
  EXPECT_FALSE(decode_clock({}).ok());
  EXPECT_FALSE(decode_clock(bytes(encode_clock({0}))).ok());
  EXPECT_FALSE(decode_clock(bytes(encode_clock({-1}))).ok()) << "differences would leave the range";
  EXPECT_FALSE(decode_clock(bytes(std::string_view("\x31\x01\x02", 3))).ok()) << "cut off";
}

}  // namespace
}  // namespace lightwell
