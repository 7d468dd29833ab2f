// One client of a broker, kept connected by the thread that turns it. All that sees libmosquitto, of both ends; where
// that was not found, the library lightwell_mqtt_session is left out.
//   MqttLogin     as whom
//   MqttMessage   what came
//   MqttSession   the connection that comes back
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

#include <lightwell/back_off.hpp>
#include <lightwell/mqtt.hpp>
#include <lightwell/time.hpp>

struct mosquitto;

namespace lightwell {

/// Paths and names are empty where there is none.
struct MqttLogin {
  std::string client_id, user, password;
  std::string ca_file, certificate_file, key_file;
};

/// Lives during the call that hands it over.
struct MqttMessage {
  std::string_view topic;
  std::span<const std::byte> payload;
  std::string_view response_topic;
  std::span<const std::byte> correlation;
};

/// MQTT 5, QoS 0. Every connection is a new one, so that nothing waits in a queue of the old. One thread calls all but
/// wake(), resolving() and connected().
class MqttSession {
 public:
  struct Options {
    MqttAddress address;
    MqttLogin login;
    /// The broker publishes it, retained, when this client is lost. No topic: nothing.
    std::string will_topic, will_payload;
    /// Made on every connection, before on_connected. One that the broker refuses ends the connection.
    std::vector<std::string> subscriptions;
    /// Pauses between attempts, and how long a broker may take to accept.
    Duration retry_min, retry_max, connect_timeout;
    /// The broker never sends more bytes at once.
    std::uint32_t largest_packet = 16 * 1024;
    /// What the kernel may hold of what was published and not yet taken; 0: as much as it likes.
    int send_buffer_bytes = 0;
    std::function<void()> on_connected;
    /// Why, for a person.
    std::function<void(const std::string&)> on_lost;
    std::function<void(const MqttMessage&)> on_message;
  };
  explicit MqttSession(Options options);
  ~MqttSession();
  MqttSession(const MqttSession&) = delete;
  MqttSession& operator=(const MqttSession&) = delete;

  /// Connects where that is due, then waits for the broker, for wake(), or for `patience` at most. Looking up the
  /// broker's name may take longer than that: the system's resolver knows no hurry.
  void run_once(Duration timeout);
  /// Any thread: the turn that waits, or the next one, ends at once.
  void wake() const;

  /// The turn is in the system's resolver, or just about to enter or leave it. Any thread.
  [[nodiscard]] bool resolving() const { return resolving_; }
  /// The broker has accepted us. Any thread.
  [[nodiscard]] bool connected() const { return connected_; }
  /// Connected, and all that was published has left for the network.
  [[nodiscard]] bool idle() const;

  /// Each hands its message to the network as far as that takes it now; what is left follows in turn(). False where it
  /// cannot be sent.
  bool publish(const std::string& topic, std::span<const std::byte> payload, bool retained);
  /// An empty message that asks for an answer.
  bool request(const std::string& topic, const std::string& response_topic, std::span<const std::byte> correlation);
  /// To the topic and with the correlation of what was asked, not retained.
  bool respond(const MqttMessage& question, std::span<const std::byte> payload);

  /// Says goodbye, so that no last will is published, where that goes out within `patience`. Nothing follows.
  void close(Duration timeout);

 private:
  struct Callbacks;
  friend struct Callbacks;
  struct Properties;
  struct Free {
    void operator()(mosquitto* client) const;
  };

  void attempt(std::int64_t now_ns);
  [[nodiscard]] std::string configure(mosquitto* client) const;
  void handle_disconnect(std::string why);
  void serve(short events);
  void wait_for_wake(std::int64_t timeout_ns) const;
  bool send(const std::string& topic, std::span<const std::byte> payload, bool retained, const Properties& properties);

  const Options options_;
  int wake_ = -1;  ///< eventfd
  Backoff backoff_;
  std::unique_ptr<mosquitto, Free> client_;
  std::int64_t attempt_ns_ = 0, next_attempt_ns_ = 0;
  std::atomic<bool> connected_{false}, resolving_{false};
  std::string library_error_;          ///< The library's last complaint: the reason of a failure that its codes do not tell.
  std::string disconnected_;  ///< Why, set by its callback; empty while it lives.
};

}  // namespace lightwell
