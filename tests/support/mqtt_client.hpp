// A client of a broker that publishes whatever bytes it is told to, and keeps what comes.
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

/// MQTT 5 without TLS, on the loopback; one thread of the library's.
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
  void publish(const BrokerMessage& note);
  /// For `on_message`: QoS 0, without waiting.
  void answer(const BrokerMessage& note) { EXPECT_EQ(send(note, 0), 0); }
  /// As fast as they go, without waiting for the broker.
  void flood(const BrokerMessage& note, std::size_t times);

  [[nodiscard]] std::vector<BrokerMessage> notes() const;
  /// The last of a topic, waited for.
  [[nodiscard]] std::optional<BrokerMessage> newest(const std::string& topic) const;
  [[nodiscard]] std::size_t count(const std::string& topic) const;

 private:
  struct Callbacks;
  friend struct Callbacks;
  const std::vector<std::string> subscriptions_;
  const std::function<void(const BrokerMessage&)> on_message_;
  mosquitto* client_ = nullptr;
  mutable std::mutex mutex_;
  std::vector<BrokerMessage> notes_;
  std::size_t subscribed_ = 0;
  std::size_t published_ = 0;
  [[nodiscard]] int send(const BrokerMessage& note, int qos);
};

}  // namespace lightwell::test
