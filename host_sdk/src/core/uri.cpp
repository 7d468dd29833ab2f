#include "core/uri.hpp"

#include <optional>
#include <utility>

#include <lightwell/pairing.hpp>
#include <lightwell/probe.hpp>
#include <lightwell/text.hpp>

namespace lightwell::core {
namespace {

constexpr std::string_view kGrpc = "grpc://";
constexpr std::string_view kGrpcs = "grpcs://";
constexpr std::string_view kWs = "ws://";
constexpr std::string_view kWss = "wss://";
constexpr std::string_view kReplay = "replay:";
constexpr std::string_view kUsb = "usb:";
constexpr std::string_view kSpeed = "?speed=";

Status refused(std::string_view uri, std::string_view why) {
  return {StatusCode::invalid_argument,
          "'" + std::string(uri) + "' is not a valid address of a probe: " + std::string(why)};
}

/// "host:port" of an address that begins with `scheme`.
Result<std::string> parse_host_port(std::string_view uri, std::string_view scheme, int default_port) {
  const std::string example = std::string(scheme) + "HOST:PORT";
  std::string_view rest = uri.substr(scheme.size());
  if (rest.ends_with('/')) rest.remove_suffix(1);
  // The colon before a port follows the brackets of an IPv6 address.
  const std::size_t bracket = rest.rfind(']');
  const std::size_t from = bracket == std::string_view::npos ? 0 : bracket;
  const std::size_t colon = rest.find(':', from);
  const std::string_view host = rest.substr(0, colon);
  if (host.empty() || host == "[]") return refused(uri, "the host is missing; write " + example);
  if (host.find_first_of("/?#@ ") != std::string_view::npos)
    return refused(uri, "only a host and a port are allowed; write " + example);
  if (bracket == std::string_view::npos && colon != std::string_view::npos &&
      rest.find(':', colon + 1) != std::string_view::npos)
    return refused(uri,
                   "an IPv6 address needs brackets, " + std::string(scheme) + "[::1]:" + std::to_string(default_port));
  if (colon == std::string_view::npos) return std::string(host) + ":" + std::to_string(default_port);
  const std::optional<int> port = parse_number<int>(rest.substr(colon + 1));
  if (!port || *port < 1 || *port > 65535) return refused(uri, "the port must be a number from 1 to 65535");
  return std::string(host) + ":" + std::to_string(*port);
}

/// The address that begins with `scheme`.
template <class Address>
Result<Address> parse_network(std::string_view uri, std::string_view scheme, Transport transport, int default_port) {
  Result<std::string> host_port = parse_host_port(uri, scheme, default_port);
  if (!host_port.ok()) return host_port.status();
  return Address{std::move(*host_port), transport};
}

Result<ProbeUri> parse_replay(std::string_view uri) {
  std::string_view rest = uri.substr(kReplay.size());
  ReplayPath replay;
  if (const std::size_t mark = rest.rfind(kSpeed); mark != std::string_view::npos) {
    const std::optional<double> speed = parse_number<double>(rest.substr(mark + kSpeed.size()));
    if (!speed || *speed < 0) return refused(uri, "the speed must be a number, at least 0; 1 is the original speed");
    replay.speed = *speed;
    rest = rest.substr(0, mark);
  }
  if (rest.empty()) return refused(uri, "the path is missing; write replay:PATH");
  replay.path = std::string(rest);
  return ProbeUri(std::move(replay));
}

/// A serial number: at most the 126 characters of a USB string descriptor, without characters of paths and options.
Result<ProbeUri> parse_usb(std::string_view uri) {
  const std::string_view serial = uri.substr(kUsb.size());
  if (serial.size() > 126) return refused(uri, "a serial number has at most 126 characters");
  for (const char c : serial)
    if (c <= ' ' || c > '~' || c == '/' || c == '?' || c == '#')
      return refused(
          uri, "write usb: for the only probe that is plugged in, or usb:SERIAL for the one with this serial number");
  return ProbeUri(UsbAddress{std::string(serial)});
}

}  // namespace

Result<ProbeUri> parse_probe_uri(std::string_view uri) {
  if (uri.starts_with(kReplay)) return parse_replay(uri);
  if (uri.starts_with(kUsb)) return parse_usb(uri);
  if (uri.starts_with("mqtt://") || uri.starts_with("mqtts://")) {
    Result<MqttAddress> address = parse_mqtt_address(uri);
    if (!address.ok()) return address.status();
    return ProbeUri(std::move(*address));
  }
  const auto as_uri = [](auto address) {
    return address.ok() ? Result<ProbeUri>(ProbeUri(std::move(*address))) : address.status();
  };
  if (uri.starts_with(kGrpc)) return as_uri(parse_network<GrpcAddress>(uri, kGrpc, Transport::plain, kDefaultPort));
  if (uri.starts_with(kGrpcs)) return as_uri(parse_network<GrpcAddress>(uri, kGrpcs, Transport::tls, kDefaultPort));
  if (uri.starts_with(kWs)) return as_uri(parse_network<WebAddress>(uri, kWs, Transport::plain, kDefaultWebPort));
  if (uri.starts_with(kWss)) return as_uri(parse_network<WebAddress>(uri, kWss, Transport::tls, kDefaultWebPort));
  return refused(uri,
                 "known are grpc://HOST:PORT, grpcs://HOST:PORT, ws://HOST:PORT, wss://HOST:PORT, usb:SERIAL, "
                 "mqtt://BROKER:PORT/TOPIC (mqtts:// with TLS) and replay:PATH");
}

Result<GrpcAddress> parse_pairing_uri(std::string_view uri) {
  if (!uri.starts_with(kGrpcs)) return refused(uri, "pairing needs TLS; write grpcs://HOST or grpcs://HOST:PORT");
  return parse_network<GrpcAddress>(uri, kGrpcs, Transport::tls, kDefaultPairingPort);
}

}  // namespace lightwell::core
