// URIs of probes.
#pragma once

#include <string>
#include <string_view>
#include <variant>

#include <lightwell/mqtt.hpp>
#include <lightwell/result.hpp>

namespace lightwell::core {

enum class Transport { plain, tls };

/// `grpc://host:port`, over TLS `grpcs://host:port`.
struct GrpcAddress {
  std::string host_port;  ///< "host:port" or "[v6]:port", always with the port.
  Transport transport = Transport::plain;
};

/// `ws://host:port`, over TLS `wss://host:port`: the probe's link by WebSocket.
struct WebAddress {
  std::string host_port;  ///< As that of GrpcAddress.
  Transport transport = Transport::plain;
};

/// `replay:PATH?speed=S`.
struct ReplayPath {
  std::string path;
  double speed = 1;  ///< Relative to the original speed; 0: as fast as it can be read.
};

/// `usb:` or `usb:SERIAL`.
struct UsbAddress {
  std::string serial;  ///< Empty: the only probe on USB.
};

using ProbeUri = std::variant<GrpcAddress, ReplayPath, UsbAddress, MqttAddress, WebAddress>;

/// invalid_argument says what is allowed.
[[nodiscard]] Result<ProbeUri> parse_probe_uri(std::string_view uri);
/// Address of a probe's pairing service: only grpcs://, with the default port kDefaultPairingPort.
[[nodiscard]] Result<GrpcAddress> parse_pairing_uri(std::string_view uri);

}  // namespace lightwell::core
