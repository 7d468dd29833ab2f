// An MQTT client that publishes arbitrary bytes and keeps all received messages.
#pragma once

#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

struct mosquitto;

namespace lightwell::test {

struct BrokerMessage {
  std::string topic, payload;
  bool retained = false;
  std::string response_topic, correlation;
};

/// MQTT 5 without TLS, on the loopback address; uses one thread of libmosquitto.
class MqttClient {
 public:
  /// `on_message` runs on the library's thread.
  explicit MqttClient(int port, const std::vector<std::string>& subscriptions = {},
                      std::function<void(const BrokerMessage&)> on_message = {});
  ~MqttClient();
  MqttClient(const MqttClient&) = delete;
  MqttClient& operator=(const MqttClient&) = delete;

  enum class Keep { retained, live };
  void publish(const std::string& topic, const std::string& payload, Keep keep = Keep::live);
  void publish(const BrokerMessage& message);
  /// Publishes with QoS 0, without waiting; may be called from `on_message`.
  void answer(const BrokerMessage& message) { EXPECT_EQ(send(message, 0), 0); }
  /// Publishes a message `times` times without waiting for the broker.
  void flood(const BrokerMessage& message, std::size_t times);

  [[nodiscard]] std::vector<BrokerMessage> messages() const;
  /// Waits for a message of the topic and returns the last one.
  [[nodiscard]] std::optional<BrokerMessage> newest(const std::string& topic) const;
  [[nodiscard]] std::size_t count(const std::string& topic) const;

 private:
  struct Callbacks;
  friend struct Callbacks;
  const std::vector<std::string> subscriptions_;
  const std::function<void(const BrokerMessage&)> on_message_;
  mosquitto* client_ = nullptr;
  mutable std::mutex mutex_;
  std::vector<BrokerMessage> messages_;
  std::size_t subscribed_ = 0;
  std::size_t published_ = 0;
  [[nodiscard]] int send(const BrokerMessage& message, int qos);
};

}  // namespace lightwell::test
