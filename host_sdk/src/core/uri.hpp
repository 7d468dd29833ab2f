// Where a probe is, as text.
#pragma once

#include <string>
#include <string_view>
#include <variant>

#include <lightwell/result.hpp>

namespace lightwell::core {

/// `grpc://host:port`.
struct GrpcAddress {
  std::string host_port;  ///< "host:port" or "[v6]:port", the port always there.
};

/// `replay:PATH?speed=S`.
struct ReplayPath {
  std::string path;
  double speed = 1;  ///< Times its own pace; 0: as fast as it is read.
};

using ProbeUri = std::variant<GrpcAddress, ReplayPath>;

/// invalid_argument tells what would be right.
[[nodiscard]] Result<ProbeUri> parse_probe_uri(std::string_view uri);

}  // namespace lightwell::core
