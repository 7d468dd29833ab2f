// Where a probe is, as text.
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
  std::string host_port;  ///< "host:port" or "[v6]:port", the port always there.
  Transport transport = Transport::plain;
};

/// `replay:PATH?speed=S`.
struct ReplayPath {
  std::string path;
  double speed = 1;  ///< Times its own pace; 0: as fast as it is read.
};

/// `usb:` or `usb:SERIAL`.
struct UsbAddress {
  std::string serial;  ///< Empty: the only probe that is plugged in.
};

using ProbeUri = std::variant<GrpcAddress, ReplayPath, UsbAddress, MqttAddress>;

/// invalid_argument tells what would be right.
[[nodiscard]] Result<ProbeUri> parse_probe_uri(std::string_view uri);
/// Where a probe waits to be paired: grpcs:// alone, with a port of its own where none is named.
[[nodiscard]] Result<GrpcAddress> parse_pairing_uri(std::string_view uri);

}  // namespace lightwell::core
