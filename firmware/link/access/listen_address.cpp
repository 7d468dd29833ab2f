#include "link/access/listen_address.hpp"

#include <memory>
#include <netdb.h>

#include <sys/socket.h>

#include <lightwell/deleter.hpp>
#include <lightwell/text.hpp>

namespace lightwell {

bool is_host_and_port(std::string_view listen) {
  const std::size_t colon = listen.rfind(':');
  if (colon == std::string_view::npos || colon == 0) return false;
  const auto port = parse_number<unsigned>(listen.substr(colon + 1));
  return port && *port <= 65535;
}

Status listen_error(const std::string& listen, const std::string& options) {
  return {StatusCode::resource_exhausted,
          "cannot listen on '" + listen +
              "': the address is malformed (HOST:PORT), not of this machine, or its port is in use by another "
              "program (find it with `ss -ltnp`); choose another with " +
              options + ", port 0 takes any"};
}

std::optional<ListenTarget> resolve_listen_address(const std::string& listen) {
  const std::size_t colon = listen.rfind(':');
  std::string host = listen.substr(0, colon);
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  addrinfo* first = nullptr;
  if (getaddrinfo(host.c_str(), nullptr, &hints, &first) != 0) return std::nullopt;
  const std::unique_ptr<addrinfo, Deleter<freeaddrinfo>> found(first);
  char numeric[NI_MAXHOST] = {};
  if (getnameinfo(found->ai_addr, found->ai_addrlen, numeric, sizeof numeric, nullptr, 0, NI_NUMERICHOST) != 0)
    return std::nullopt;
  ListenTarget out;
  out.port = parse_number<int>(std::string_view(listen).substr(colon + 1)).value_or(0);
  out.ipv6 = found->ai_family == AF_INET6;
  if (const std::string_view name = numeric; name != "0.0.0.0" && name != "::") out.address = name;
  return out;
}

}  // namespace lightwell
