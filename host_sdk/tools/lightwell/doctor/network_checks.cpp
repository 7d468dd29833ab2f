// From a probe's address to a TCP connection.
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <netdb.h>
#include <poll.h>
#include <string_view>

#include <sys/socket.h>

#include <lightwell/deleter.hpp>
#include <lightwell/files.hpp>
#include <lightwell/host_names.hpp>
#include <lightwell/text.hpp>

#include "core/discovery_backends.hpp"
#include "core/uri.hpp"
#include "doctor/probe_checks.hpp"

namespace lightwell::tool {
namespace {

using NetworkPart = std::optional<NetworkAddress>;

/// "host:port" or "[v6]:port".
NetworkAddress parts_of(std::string_view host_port, core::Transport transport) {
  const std::size_t colon = host_port.rfind(':');
  std::string_view host = host_port.substr(0, colon);
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  return {std::string(host), parse_number<int>(host_port.substr(colon + 1)).value_or(0),
          transport == core::Transport::tls ? Encryption::tls : Encryption::none};
}

NetworkPart network_part(const core::GrpcAddress& a) { return parts_of(a.host_port, a.transport); }
NetworkPart network_part(const core::WebAddress& a) { return parts_of(a.host_port, a.transport); }
NetworkPart network_part(const MqttAddress& a) {
  return NetworkAddress{a.host, a.port, a.transport == MqttTransport::tls ? Encryption::tls : Encryption::none,
                        Peer::broker};
}
NetworkPart network_part(const core::UsbAddress&) { return std::nullopt; }
NetworkPart network_part(const core::ReplayPath&) { return std::nullopt; }

/// 0 after a TCP connection, ETIMEDOUT without an answer in time, otherwise the system's error.
int connect_error(const addrinfo& to, Duration timeout) {
  const FileDescriptor tcp(socket(to.ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!tcp) return errno;
  if (::connect(tcp.get(), to.ai_addr, to.ai_addrlen) == 0) return 0;
  if (errno != EINPROGRESS) return errno;
  pollfd ready{tcp.get(), POLLOUT, 0};
  if (poll(&ready, 1, static_cast<int>(timeout.ns / 1'000'000)) != 1) return ETIMEDOUT;
  int error = 0;
  socklen_t size = sizeof error;
  return getsockopt(tcp.get(), SOL_SOCKET, SO_ERROR, &error, &size) == 0 ? error : errno;
}

int connect_error(const std::string& numeric, int port, Duration timeout) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV;
  addrinfo* raw = nullptr;
  if (getaddrinfo(numeric.c_str(), std::to_string(port).c_str(), &hints, &raw) != 0) return EADDRNOTAVAIL;
  const std::unique_ptr<addrinfo, Deleter<freeaddrinfo>> to(raw);
  return connect_error(*to, timeout);
}

std::string remedy_for(int error, const NetworkAddress& address) {
  const bool broker = address.peer == Peer::broker;
  if (error == ECONNREFUSED)
    return broker
               ? "nothing listens at this port: does the broker run there (mosquitto: port 1883, with TLS 8883)?"
               : "the machine answers, and nothing listens at this port: does lightwelld run there, with this link "
                 "(gRPC 7420; --web 7443), and at an address that other machines can reach (--listen '[::]:7420', not "
                 "127.0.0.1)?";
  if (error == ETIMEDOUT)
    return "no answer: is the machine on, and in this network? A firewall there may drop the port, and a guest network "
           "keeps its devices apart";
  return "there is no way to this address from here: is this machine connected to that network (`ip route`)?";
}

}  // namespace

Result<std::optional<NetworkAddress>> network_address_of(const std::string& uri) {
  const Result<core::ProbeUri> address = core::parse_probe_uri(uri);
  if (!address.ok()) return address.status();
  return std::visit([](const auto& a) { return network_part(a); }, *address);
}

ResolvedName check_name(const NetworkAddress& address) {
  if (std::vector<std::string> numeric = numeric_addresses(address.host, HostForm::numeric); !numeric.empty())
    return {not_checked("not needed: " + address.host + " is an address"), std::move(numeric)};
  const std::string host_port = address.host + ":" + std::to_string(address.port);
  const bool mdns = core::is_mdns_name(host_port);
  std::vector<std::string> addresses;
  if (mdns)
    if (const auto found = core::mdns_address(host_port, nullptr))
      addresses.push_back(parts_of(*found, core::Transport::plain).host);
  if (addresses.empty()) addresses = numeric_addresses(address.host, HostForm::any);
  if (!addresses.empty()) {
    // The resolver lists an address once for each kind of socket.
    addresses.erase(std::unique(addresses.begin(), addresses.end()), addresses.end());
    const std::string found = address.host + " is " + joined(addresses);
    return {ok(found), std::move(addresses)};
  }
  return {fault("the name " + address.host + " has no address",
                mdns ? "names in .local are those of multicast DNS: is the probe on and in this network, and does "
                       "avahi-daemon run on both machines? Otherwise use the probe's IP address"
                     : "is it spelt right? Names of probes usually end in .local; `lightwell discover` lists them"),
          {}};
}

Finding check_reachable(const NetworkAddress& address, const std::vector<std::string>& addresses, Duration timeout) {
  std::vector<std::string> failures;
  int last = ENETUNREACH;
  for (const std::string& numeric : addresses) {
    const std::int64_t begin_ns = monotonic_now_ns();
    last = connect_error(numeric, address.port, timeout);
    if (last == 0)
      return ok(formatted("%s port %d answers in %.1f ms", numeric.c_str(), address.port,
                          Duration{monotonic_now_ns() - begin_ns}.milliseconds()));
    failures.push_back(formatted("%s port %d: %s", numeric.c_str(), address.port, std::strerror(last)));
  }
  return fault(joined(failures), remedy_for(last, address));
}

}  // namespace lightwell::tool
