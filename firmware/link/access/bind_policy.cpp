#include "link/access/bind_policy.hpp"

#include <string>

#include <lightwell/mqtt.hpp>
#include <lightwell/text.hpp>

namespace lightwell {
namespace {

std::string_view host_of(std::string_view listen) {
  std::string_view host = listen.substr(0, listen.rfind(':'));
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  return host;
}

}  // namespace

bool is_host_and_port(std::string_view listen) {
  const std::size_t colon = listen.rfind(':');
  if (colon == std::string_view::npos || colon == 0) return false;
  const auto port = parse_number<unsigned>(listen.substr(colon + 1));
  return port && *port <= 65535;
}

bool is_loopback(std::string_view listen) { return is_loopback_host(host_of(listen)); }

Status check_bind_policy(const GrpcConfig& config) {
  if (config.security != LinkSecurity::unspecified || is_loopback(config.listen_address)) return {};
  return {StatusCode::failed_precondition,
          "listening on '" + config.listen_address +
              "' in plain text would let everyone on the network watch and command this probe: set grpc.security to "
              "LINK_SECURITY_TLS or LINK_SECURITY_MUTUAL_TLS (--security tls) and pair the clients with `lightwelld "
              "--pair`; "
              "or, on a network that you trust, to LINK_SECURITY_PLAIN (--security plain); or listen on 127.0.0.1"};
}

}  // namespace lightwell
