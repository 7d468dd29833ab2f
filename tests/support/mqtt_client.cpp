#include "support/mqtt_client.hpp"

#include <cstdlib>
#include <mosquitto.h>
#include <mqtt_protocol.h>
#include <utility>

#include "support/wait.hpp"

namespace lightwell::test {

struct MqttClient::Callbacks {
  static void connected(mosquitto* client, void* data, int reason, int, const mosquitto_property*) {
    auto& self = *static_cast<MqttClient*>(data);
    EXPECT_EQ(reason, 0) << mosquitto_reason_string(reason);
    for (const std::string& topic : self.subscriptions_) mosquitto_subscribe(client, nullptr, topic.c_str(), 0);
    if (self.subscriptions_.empty()) subscribed(client, data, 0, 0, nullptr, nullptr);
  }
  static void subscribed(mosquitto*, void* data, int, int, const int*, const mosquitto_property*) {
    auto& self = *static_cast<MqttClient*>(data);
    const std::lock_guard lock(self.mutex_);
    ++self.subscribed_;
  }
  static void published(mosquitto*, void* data, int, int, const mosquitto_property*) {
    auto& self = *static_cast<MqttClient*>(data);
    const std::lock_guard lock(self.mutex_);
    ++self.published_;
  }
  static void message(mosquitto*, void* data, const mosquitto_message* m, const mosquitto_property* properties) {
    auto& self = *static_cast<MqttClient*>(data);
    BrokerMessage received{m->topic,
                           std::string(static_cast<const char*>(m->payload), static_cast<std::size_t>(m->payloadlen)),
                           m->retain,
                           {},
                           {}};
    char* topic = nullptr;
    if (mosquitto_property_read_string(properties, MQTT_PROP_RESPONSE_TOPIC, &topic, false) != nullptr)
      received.response_topic = topic;
    std::free(topic);
    void* bytes = nullptr;
    std::uint16_t size = 0;
    if (mosquitto_property_read_binary(properties, MQTT_PROP_CORRELATION_DATA, &bytes, &size, false) != nullptr)
      received.correlation.assign(static_cast<const char*>(bytes), size);
    std::free(bytes);
    if (self.on_message_) self.on_message_(received);
    const std::lock_guard lock(self.mutex_);
    self.messages_.push_back(std::move(received));
  }
};

MqttClient::MqttClient(int port, const std::vector<std::string>& subscriptions,
                       std::function<void(const BrokerMessage&)> on_message)
    : subscriptions_(subscriptions), on_message_(std::move(on_message)) {
  mosquitto_lib_init();
  client_ = mosquitto_new(nullptr, true, this);
  mosquitto_int_option(client_, MOSQ_OPT_PROTOCOL_VERSION, MQTT_PROTOCOL_V5);
  mosquitto_connect_v5_callback_set(client_, Callbacks::connected);
  mosquitto_subscribe_v5_callback_set(client_, Callbacks::subscribed);
  mosquitto_publish_v5_callback_set(client_, Callbacks::published);
  mosquitto_message_v5_callback_set(client_, Callbacks::message);
  EXPECT_EQ(mosquitto_connect(client_, "127.0.0.1", port, 60), MOSQ_ERR_SUCCESS);
  EXPECT_EQ(mosquitto_loop_start(client_), MOSQ_ERR_SUCCESS);
  const std::size_t wanted = subscriptions_.empty() ? 1 : subscriptions_.size();
  EXPECT_TRUE(becomes_true("the client has what it subscribes to", [&] {
    const std::lock_guard lock(mutex_);
    return subscribed_ >= wanted;
  }));
}

MqttClient::~MqttClient() {
  mosquitto_disconnect(client_);
  mosquitto_loop_stop(client_, true);
  mosquitto_destroy(client_);
}

void MqttClient::publish(const std::string& topic, const std::string& payload, Keep keep) {
  publish(BrokerMessage{topic, payload, keep == Keep::retained, {}, {}});
}

int MqttClient::send(const BrokerMessage& message, int qos) {
  mosquitto_property* properties = nullptr;
  if (!message.response_topic.empty())
    mosquitto_property_add_string(&properties, MQTT_PROP_RESPONSE_TOPIC, message.response_topic.c_str());
  if (!message.correlation.empty())
    mosquitto_property_add_binary(&properties, MQTT_PROP_CORRELATION_DATA, message.correlation.data(),
                                  static_cast<std::uint16_t>(message.correlation.size()));
  const int rc = mosquitto_publish_v5(client_, nullptr, message.topic.c_str(), static_cast<int>(message.payload.size()),
                                      message.payload.data(), qos, message.retained, properties);
  mosquitto_property_free_all(&properties);
  return rc;
}

void MqttClient::publish(const BrokerMessage& message) {
  const auto published = [&] {
    const std::lock_guard lock(mutex_);
    return published_;
  };
  const std::size_t before = published();
  // QoS 1: the broker has received it when this returns.
  EXPECT_EQ(send(message, 1), MOSQ_ERR_SUCCESS);
  EXPECT_TRUE(becomes_true("the broker has taken it", [&] { return published() > before; }));
}

void MqttClient::flood(const BrokerMessage& message, std::size_t times) {
  for (std::size_t i = 0; i < times; ++i) EXPECT_EQ(send(message, 0), MOSQ_ERR_SUCCESS);
}

std::vector<BrokerMessage> MqttClient::messages() const {
  const std::lock_guard lock(mutex_);
  return messages_;
}

std::optional<BrokerMessage> MqttClient::newest(const std::string& topic) const {
  EXPECT_TRUE(becomes_true("something comes on " + topic, [&] { return count(topic) > 0; }));
  const std::lock_guard lock(mutex_);
  for (auto message = messages_.rbegin(); message != messages_.rend(); ++message)
    if (message->topic == topic) return *message;
  return std::nullopt;
}

std::size_t MqttClient::count(const std::string& topic) const {
  const std::lock_guard lock(mutex_);
  std::size_t n = 0;
  for (const BrokerMessage& message : messages_) n += message.topic == topic ? 1U : 0U;
  return n;
}

}  // namespace lightwell::test
