#include "core/mdns_host.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <memory>
#include <string_view>

#ifdef LIGHTWELL_HAVE_MDNS
#include <avahi-client/client.h>
#include <avahi-client/lookup.h>
#include <avahi-common/address.h>
#include <avahi-common/simple-watch.h>
#include <net/if.h>

#include <lightwell/deleter.hpp>
#include <lightwell/time.hpp>
#endif

namespace lightwell::core {
namespace {

std::string_view host_of(std::string_view host_port) {
  std::string_view host = host_port.substr(0, host_port.rfind(':'));
  if (host.ends_with('.')) host.remove_suffix(1);
  return host;
}

}  // namespace

bool is_mdns_name(const std::string& host_port) {
  constexpr std::string_view kDomain = ".local";
  const std::string_view host = host_of(host_port);
  return host.size() > kDomain.size() &&
         std::ranges::equal(host.substr(host.size() - kDomain.size()), kDomain,
                            [](char a, char b) { return std::tolower(static_cast<unsigned char>(a)) == b; });
}

#ifdef LIGHTWELL_HAVE_MDNS
namespace {

/// A reachable host answers within a tenth of this.
constexpr Duration kTimeout{1'000'000'000};
/// How long to wait for an IPv4 address after an IPv6 address was received.
constexpr Duration kIpv4Grace{300'000'000};

/// Results of resolving one name in both address families.
struct Answers {
  std::string v4, v6;
  int open = 0;  ///< Number of pending resolvers.
  bool gone = false;

  static void state(AvahiClient*, AvahiClientState state, void* data) {
    static_cast<Answers*>(data)->gone = state == AVAHI_CLIENT_FAILURE;
  }

  static void take(AvahiHostNameResolver*, AvahiIfIndex interface, AvahiProtocol, AvahiResolverEvent event, const char*,
                   const AvahiAddress* address, AvahiLookupResultFlags, void* data) {
    auto& self = *static_cast<Answers*>(data);
    --self.open;
    if (event != AVAHI_RESOLVER_FOUND) return;
    std::array<char, AVAHI_ADDRESS_STR_MAX> text{};
    avahi_address_snprint(text.data(), text.size(), address);
    if (address->proto == AVAHI_PROTO_INET) {
      self.v4 = text.data();
      return;
    }
    self.v6 = text.data();
    // A link-local address needs a zone index, the interface (RFC 4007, 11).
    std::array<char, IF_NAMESIZE> name{};
    if (self.v6.starts_with("fe80:") && if_indextoname(static_cast<unsigned>(interface), name.data()) != nullptr)
      self.v6 += std::string("%") + name.data();
  }
};

}  // namespace

std::optional<std::string> mdns_address(const std::string& host_port, const std::atomic<bool>* stopping) {
  const std::string host(host_of(host_port)), port = host_port.substr(host_port.rfind(':'));
  Answers answers;
  const std::unique_ptr<AvahiSimplePoll, Deleter<avahi_simple_poll_free>> poll(avahi_simple_poll_new());
  if (!poll) return std::nullopt;
  // Freeing the client also frees its resolvers.
  const std::unique_ptr<AvahiClient, Deleter<avahi_client_free>> client(
      avahi_client_new(avahi_simple_poll_get(poll.get()), AvahiClientFlags{}, Answers::state, &answers, nullptr));
  if (!client) return std::nullopt;
  for (const AvahiProtocol family : {AVAHI_PROTO_INET, AVAHI_PROTO_INET6})
    if (avahi_host_name_resolver_new(client.get(), AVAHI_IF_UNSPEC, AVAHI_PROTO_UNSPEC, host.c_str(), family,
                                     AvahiLookupFlags{}, Answers::take, &answers) != nullptr)
      ++answers.open;
  const std::int64_t begin = monotonic_now_ns();
  std::int64_t end = begin + kTimeout.ns;
  const auto stopped = [stopping] { return stopping != nullptr && *stopping; };
  while (!stopped() && !answers.gone && answers.v4.empty() && answers.open > 0 && monotonic_now_ns() < end) {
    if (avahi_simple_poll_iterate(poll.get(), 20) != 0) break;
    if (!answers.v6.empty()) end = std::min(end, begin + kIpv4Grace.ns);
  }
  if (!answers.v4.empty()) return answers.v4 + port;
  if (!answers.v6.empty()) return "[" + answers.v6 + "]" + port;
  return std::nullopt;
}
#else
std::optional<std::string> mdns_address(const std::string&, const std::atomic<bool>*) { return std::nullopt; }
#endif

}  // namespace lightwell::core
