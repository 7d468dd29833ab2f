// MQTT client with automatic reconnection, run by one thread. The only user of libmosquitto, for probe and host;
// without libmosquitto the library lightwell_mqtt_session is not built.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <lightwell/backoff.hpp>
#include <lightwell/mqtt.hpp>
#include <lightwell/socket_wait.hpp>
#include <lightwell/time.hpp>

struct mosquitto;

namespace lightwell {

/// Empty strings mean none.
struct MqttLogin {
  std::string client_id, user, password;
  std::string ca_file, certificate_file, key_file;
};

/// Valid during the callback that receives it.
struct MqttMessage {
  std::string_view topic;
  std::span<const std::byte> payload;
  std::string_view response_topic;
  std::span<const std::byte> correlation;
};

/// MQTT 5, QoS 0. Every connection has a clean session, so that no messages of an old one are queued. One thread calls
/// everything except wake(), resolving() and connected().
class MqttSession {
 public:
  struct Options {
    MqttAddress address;
    MqttLogin login;
    /// Last will: the broker publishes it, retained, if the connection to this client is lost. Empty topic: no will.
    std::string will_topic, will_payload;
    /// Topics subscribed on every connection, before on_connected. The connection ends if the broker refuses one.
    std::vector<std::string> subscriptions;
    /// First and longest pause between attempts, and limit of one connection attempt.
    Duration retry_min, retry_max, connect_timeout;
    /// Maximum Packet Size (MQTT 5), bytes: the broker sends no larger packet.
    std::uint32_t largest_packet = 16 * 1024;
    /// Send buffer of the socket (SO_SNDBUF), bytes; 0: the system's default.
    int send_buffer_bytes = 0;
    std::function<void()> on_connected;
    /// Called with a human-readable reason.
    std::function<void(const std::string&)> on_lost;
    std::function<void(const MqttMessage&)> on_message;
  };
  explicit MqttSession(Options options);

  /// Connects if an attempt is due, then processes events until the broker sends something, wake() is called, or
  /// `timeout` has passed. Resolving the broker's name may take longer, because the system's resolver has no timeout.
  void run_once(Duration timeout);
  /// Makes the current or the next run_once() return at once. Any thread.
  void wake() const;

  /// run_once() is inside the system's resolver, or just before or after it. Any thread.
  [[nodiscard]] bool resolving() const { return resolving_; }
  /// The broker has accepted the connection. Any thread.
  [[nodiscard]] bool connected() const { return connected_; }
  /// Connected, and all published messages have been passed to the network.
  [[nodiscard]] bool idle() const;

  /// publish(), request() and respond() write as much of the message as the socket accepts; run_once() sends the rest.
  /// False if it cannot be sent.
  bool publish(const std::string& topic, std::span<const std::byte> payload, bool retained);
  /// Publishes an empty message with a response topic and correlation data (MQTT 5, 4.10 Request / Response).
  bool request(const std::string& topic, const std::string& response_topic, std::span<const std::byte> correlation);
  /// Responds to the request's response topic with its correlation data; not retained.
  bool respond(const MqttMessage& request, std::span<const std::byte> payload);

  /// Sends DISCONNECT, so that the broker publishes no last will, if that is possible within `timeout`. The session
  /// cannot be used afterwards.
  void close(Duration timeout);

 private:
  struct Callbacks;
  friend struct Callbacks;
  struct Free {
    void operator()(mosquitto* client) const;
  };

  void attempt(std::int64_t now_ns);
  [[nodiscard]] std::string configure(mosquitto* client) const;
  void handle_disconnect(std::string why);
  void serve(SocketEvents events);
  /// An empty response topic or correlation means none.
  bool send(const std::string& topic, std::span<const std::byte> payload, bool retained,
            const std::string& response_topic, std::span<const std::byte> correlation);

  const Options options_;
  SocketWait wait_;
  Backoff backoff_;
  std::int64_t attempt_ns_ = 0, next_attempt_ns_ = 0;
  std::atomic<bool> connected_{false}, resolving_{false};
  std::string library_error_;  ///< Last error logged by libmosquitto: more specific than its return codes.
  std::string disconnected_;   ///< Reason of the disconnection, set by the library's callback; empty while connected.
  std::unique_ptr<mosquitto, Free> client_;  // Last, because its callbacks use the other members.
};

}  // namespace lightwell
