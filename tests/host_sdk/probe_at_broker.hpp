// A fake probe at a real broker that publishes scripted messages.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>

#include <lightwell/codec.hpp>
#include <lightwell/mqtt.hpp>
#include <lightwell/probe.hpp>
#include <lightwell/status.hpp>
#include <lightwell/time.hpp>

#include "host_sdk/scenes.hpp"
#include "support/broker.hpp"
#include "support/mqtt_client.hpp"

namespace lightwell::test {

inline constexpr std::int64_t kMs = 1'000'000;

/// Its clock is this host's plus an offset.
class ProbeAtBroker {
 public:
  explicit ProbeAtBroker(const Broker& broker, const std::string& base = "venue/attic")
      : topics(base), client(broker.port(), {topics.clock}, [this](const BrokerMessage& question) {
          ++clock_requests;
          if (answers) client.answer({question.response_topic, encode_clock({now()}), false, {}, question.correlation});
        }) {}

  [[nodiscard]] std::int64_t now() const { return monotonic_now_ns() + offset_ns; }

  void say_alive() {
    StatusSnapshot status;
    status.probe_name = "attic";
    status.version = "0.1.0";
    client.publish(topics.status, encode_status(status), MqttClient::Keep::retained);
  }
  void say_gone() { client.publish(topics.status, std::string(kMqttGone), MqttClient::Keep::retained); }

  /// Age by the probe's clock; negative: in the future.
  [[nodiscard]] std::string descriptor(std::uint64_t sequence, std::int64_t age_ns) const {
    return encoded(numbered(sequence, now() - age_ns));
  }
  void say(const std::string& bytes) { client.publish(topics.descriptor, bytes, MqttClient::Keep::retained); }

  const MqttTopics topics;
  std::atomic<std::int64_t> offset_ns{3'600'000 * kMs};
  std::atomic<bool> answers{true};
  std::atomic<int> clock_requests{0};
  MqttClient client;  // last: its thread uses the others
};

/// Generous limit of the age, because builds with sanitizers are slow.
inline ProbeOptions patient() {
  ProbeOptions options;
  options.max_age = {60'000 * kMs};
  options.connect_timeout = {kTestTimeout.count() * kMs};
  return options;
}

[[nodiscard]] inline ::testing::AssertionResult newest_becomes(const Probe& probe, std::uint64_t sequence) {
  return becomes_true("descriptor " + std::to_string(sequence) + " is the newest; " + probe.stats().last_error,
                      [&] { return probe.latest().descriptor().sequence == sequence; });
}

}  // namespace lightwell::test
