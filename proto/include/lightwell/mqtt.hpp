// Conventions of both ends of the MQTT link: URI of a broker, and the topics. Specification: proto/README.md.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include <lightwell/result.hpp>

namespace lightwell {

inline constexpr int kMqttPort = 1883;
inline constexpr int kMqttTlsPort = 8883;

/// Payload of the status topic of a probe that has left, published by itself or as its last will. It cannot be confused
/// with a protobuf message: 'g' would be a field of wire type 7, which does not exist.
inline constexpr std::string_view kMqttGone = "gone";

/// Limit of a status and of a clock response; a longer message is rejected without decoding.
inline constexpr std::size_t kMaxMqttStatusBytes = 4096;
/// Limit of a clock request's correlation data, which the probe returns.
inline constexpr std::size_t kMaxMqttCorrelationBytes = 64;

enum class MqttTransport : std::uint8_t { plain, tls };
/// Whether user name and password may be sent to a broker without TLS. For a broker on this machine they always may.
enum class PlainLogin : std::uint8_t { refused, allowed };

struct MqttAddress {
  MqttTransport transport = MqttTransport::plain;
  std::string host;  ///< A name or an address; IPv6 without brackets.
  int port = kMqttPort;
  /// Base topic, "venue/probe"; no wildcard, no slash at either end. May be empty for discovery.
  std::string base;

  PlainLogin plain_login = PlainLogin::refused;

  /// "mqtts://broker:8883/venue/probe", always with the port; without `?security=`, because that is the decision of
  /// each machine.
  [[nodiscard]] std::string uri() const;
};

enum class MqttBase : std::uint8_t { needed, optional };

/// `mqtt://host[:port]/base/topic`, `mqtts://...` with TLS; `?security=plain` at the end allows a plain-text login.
/// invalid_argument, with what is allowed, for a wildcard, an empty level, a control character, a first level that
/// begins with '$', a user name or a password.
[[nodiscard]] Result<MqttAddress> parse_mqtt_address(std::string_view uri, MqttBase base = MqttBase::needed);

/// invalid_argument, with the remedy, if a login would be sent over a network in plain text without permission.
[[nodiscard]] Status check_plain_login(const MqttAddress& address);
/// The first two lines of a login file: user name and password.
[[nodiscard]] std::pair<std::string, std::string> mqtt_login_of(std::string_view text);
/// 127.0.0.0/8, ::1 and localhost.
[[nodiscard]] bool is_loopback_host(std::string_view host);

/// Topics below a probe's base.
struct MqttTopics {
  explicit MqttTopics(const std::string& base)
      : descriptor(base + "/descriptor"),
        plane(base + "/plane"),
        status(base + "/status"),
        clock(base + "/clock"),
        replies(base + "/clock/reply/") {}

  std::string descriptor;  ///< Retained: the newest descriptor, encoded as on every link.
  std::string plane;       ///< Not retained: the messages of captured planes.
  std::string status;      ///< Retained: an InfoResponse without clock, or kMqttGone.
  std::string clock;       ///< Requests: empty, with a response topic below `replies` and correlation data.
  std::string replies;     ///< Prefix of one topic per client, for an InfoResponse that holds only the clock.
};

/// Whether a probe may respond on this topic: one level below `topics.replies`, without wildcards, spaces and control
/// characters, 256 bytes at most. A client that could choose any topic could make the probe overwrite its own status.
[[nodiscard]] bool is_reply_topic(const MqttTopics& topics, std::string_view topic);

}  // namespace lightwell
