#include <algorithm>

#include <lightwell/mqtt.hpp>
#include <lightwell/text.hpp>

namespace lightwell {
namespace {

constexpr std::string_view kPlain = "mqtt://";
constexpr std::string_view kTls = "mqtts://";
constexpr std::string_view kPlainLogin = "?security=plain";
constexpr std::size_t kMaxBase = 200;
constexpr std::size_t kMaxReplyTopic = 256;

Status refused(std::string_view uri, std::string_view why) {
  return {StatusCode::invalid_argument, "'" + std::string(uri) +
                                            "' is not a valid MQTT address of a probe: " + std::string(why) +
                                            "; write mqtt://BROKER:1883/venue/probe, or mqtts:// for TLS"};
}

/// Why it is not a valid base topic; empty if it is one.
std::string_view base_problem(std::string_view base) {
  if (base.size() > kMaxBase) return "the topic is longer than 200 bytes";
  if (base.find_first_of("+#") != std::string_view::npos) return "the topic has a wildcard (+, #)";
  if (base.starts_with('$')) return "the topic begins with $, which is reserved for the broker";
  for (const char c : base)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) return "the topic has a control character";
  if (base.starts_with('/') || base.find("//") != std::string_view::npos) return "a level of the topic is empty";
  return {};
}

}  // namespace

std::string MqttAddress::uri() const {
  const std::string where = host.find(':') == std::string::npos ? host : "[" + host + "]";
  return std::string(transport == MqttTransport::tls ? kTls : kPlain) + where + ":" + std::to_string(port) + "/" + base;
}

Result<MqttAddress> parse_mqtt_address(std::string_view uri, MqttBase base) {
  MqttAddress out;
  std::string_view rest;
  if (uri.starts_with(kTls)) {
    out.transport = MqttTransport::tls;
    out.port = kMqttTlsPort;
    rest = uri.substr(kTls.size());
  } else if (uri.starts_with(kPlain)) {
    rest = uri.substr(kPlain.size());
  } else {
    return refused(uri, "the scheme is neither mqtt:// nor mqtts://");
  }
  if (rest.ends_with(kPlainLogin)) {
    if (out.transport == MqttTransport::tls)
      return refused(uri, "?security=plain contradicts mqtts://, which is TLS; leave one of them out");
    out.plain_login = PlainLogin::allowed;
    rest.remove_suffix(kPlainLogin.size());
  }
  const std::size_t slash = rest.find('/');
  std::string_view authority = rest.substr(0, slash);
  std::string_view topic = slash == std::string_view::npos ? std::string_view() : rest.substr(slash + 1);
  if (topic.ends_with('/')) topic.remove_suffix(1);
  if (authority.find('@') != std::string_view::npos)
    return refused(uri, "it contains a user name or password, which would be shown and logged; use their own fields");
  if (authority.starts_with('[')) {
    const std::size_t bracket = authority.find(']');
    if (bracket == std::string_view::npos) return refused(uri, "the bracket of the IPv6 address is not closed");
    out.host = authority.substr(1, bracket - 1);
    authority.remove_prefix(bracket + 1);
    if (!authority.empty() && !authority.starts_with(':'))
      return refused(uri, "] must be followed by :PORT or nothing");
  } else {
    const std::size_t colon = authority.find(':');
    out.host = authority.substr(0, colon);
    authority = colon == std::string_view::npos ? std::string_view() : authority.substr(colon);
    if (authority.find(':', 1) != std::string_view::npos)
      return refused(uri, "an IPv6 address needs brackets, mqtt://[::1]/...");
  }
  if (out.host.empty()) return refused(uri, "the broker is missing");
  for (const char c : out.host)
    if (static_cast<unsigned char>(c) <= 0x20 || c == 0x7F || c == '?' || c == '#')
      return refused(uri, "the broker's name has a character that is not allowed in host names");
  if (!authority.empty()) {
    const auto port = parse_number<int>(authority.substr(1));
    if (!port || *port < 1 || *port > 65535) return refused(uri, "the port must be a number from 1 to 65535");
    out.port = *port;
  }
  if (const std::string_view problem = base_problem(topic); !problem.empty()) return refused(uri, problem);
  if (topic.empty() && base == MqttBase::needed) return refused(uri, "no topic");
  out.base = topic;
  return out;
}

bool is_loopback_host(std::string_view host) {
  // Only digits and dots: excludes host names that begin with "127.".
  const bool four = host.starts_with("127.") && host.find_first_not_of("0123456789.") == std::string_view::npos;
  return four || host == "::1" || host == "localhost";
}

Status check_plain_login(const MqttAddress& address) {
  if (address.transport == MqttTransport::tls || address.plain_login == PlainLogin::allowed ||
      is_loopback_host(address.host))
    return {};
  return {StatusCode::invalid_argument,
          "user name and password would be sent to '" + address.host +
              "' in plain text, readable by everyone on the network: use TLS (mqtts://), or, on a network that you "
              "trust, allow plain text: in a probe's configuration mqtt.security: LINK_SECURITY_PLAIN, in a client's "
              "address " +
              address.uri() + std::string(kPlainLogin)};
}

std::pair<std::string, std::string> mqtt_login_of(std::string_view text) {
  const auto take_line = [&] {
    std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), line.size() + 1));
    if (line.ends_with('\r')) line.remove_suffix(1);
    return std::string(line);
  };
  std::string user = take_line();
  return {std::move(user), take_line()};
}

bool is_reply_topic(const MqttTopics& topics, std::string_view topic) {
  if (topic.size() > kMaxReplyTopic || !topic.starts_with(topics.replies)) return false;
  const std::string_view level = topic.substr(topics.replies.size());
  if (level.empty()) return false;
  for (const char c : level)
    if (static_cast<unsigned char>(c) <= 0x20 || c == 0x7F || c == '/' || c == '+' || c == '#') return false;
  return true;
}

}  // namespace lightwell
