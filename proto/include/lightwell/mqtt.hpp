// What both ends of the MQTT link must agree on: how a broker is named, and which topic holds what. proto/README.md.
//   MqttAddress          a broker and the base topic of one probe (or of many, to look for them)
//   parse_mqtt_address   from a URI
//   MqttTopics           the topics of one probe
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

/// The payload of a probe's status topic when it has gone, by itself or by its last will. No protobuf message begins
/// like that: 'g' would be a field of wire type 7, which there is not.
inline constexpr std::string_view kMqttGone = "gone";

/// A status or a clock's answer is shorter; a longer message is refused unread.
inline constexpr std::size_t kMaxMqttStatusBytes = 4096;
/// Of a clock request: what a probe hands back.
inline constexpr std::size_t kMaxMqttCorrelationBytes = 64;

enum class MqttTransport : std::uint8_t { plain, tls };
/// Whether user name and password may go to a broker without TLS. One on this machine gets them in any case.
enum class PlainLogin : std::uint8_t { refused, allowed };

struct MqttAddress {
  MqttTransport transport = MqttTransport::plain;
  std::string host;  ///< A name or an address, an IPv6 one without its brackets.
  int port = kMqttPort;
  std::string
      base;  ///< "venue/probe"; never a wildcard, no slash at either end. May be empty for who looks for probes.

  PlainLogin plain_login = PlainLogin::refused;

  /// "mqtts://broker:8883/venue/probe", the port always there, without an option: who reads it elsewhere decides anew.
  [[nodiscard]] std::string uri() const;
};

enum class MqttBase : std::uint8_t { needed, optional };

/// `mqtt://host[:port]/base/topic`, `mqtts://...` with TLS; `?security=plain` at the end allows a plain login.
/// invalid_argument tells what would be right: a wildcard, an
/// empty level, a control character, a level that begins with '$' at the front, a user name or a password are refused.
[[nodiscard]] Result<MqttAddress> parse_mqtt_address(std::string_view uri, MqttBase base = MqttBase::needed);

/// invalid_argument, with the remedy, where a login would go over a network in plain text and nobody said that it may.
[[nodiscard]] Status check_plain_login(const MqttAddress& address);
/// The first two lines of a login's file: user name and password.
[[nodiscard]] std::pair<std::string, std::string> mqtt_login_of(std::string_view text);
/// 127.0.0.0/8, ::1 and localhost: reached from this machine alone.
[[nodiscard]] bool is_loopback_host(std::string_view host);

/// Topics below a probe's base.
struct MqttTopics {
  explicit MqttTopics(const std::string& base)
      : descriptor(base + "/descriptor"),
        status(base + "/status"),
        clock(base + "/clock"),
        replies(base + "/clock/reply/") {}

  std::string descriptor;  ///< Retained: the newest descriptor, the very bytes of the wire.
  std::string status;      ///< Retained: an InfoResponse without clock, or kMqttGone.
  std::string clock;       ///< Requests: empty, with a response topic below `replies` and correlation data.
  std::string replies;     ///< One topic for each client below it: an InfoResponse that holds the clock alone.
};

/// Whether a probe may answer there: a topic of one more level below `topics.replies`, without wildcards, 256 bytes at
/// most. Who could choose any topic would make the probe write its own status.
[[nodiscard]] bool is_reply_topic(const MqttTopics& topics, std::string_view topic);

}  // namespace lightwell
