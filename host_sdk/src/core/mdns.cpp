// Multicast DNS through this machine's avahi-daemon: addresses of names in .local, and discovery by DNS-SD.
#include <algorithm>
#include <array>
#include <cctype>
#include <memory>
#include <string_view>
#include <vector>

#include <lightwell/advertisement.hpp>
#include <lightwell/host_names.hpp>
#include <lightwell/text.hpp>
#include <lightwell/time.hpp>

#ifdef LIGHTWELL_HAVE_MDNS
#include "core/avahi_library.hpp"
#endif
#include "core/discovery_backends.hpp"

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

/// Only after AvahiLibrary::loaded() was found to be ok.
const AvahiLibrary& avahi() { return *AvahiLibrary::loaded(); }

struct Free {
  void operator()(AvahiSimplePoll* poll) const { avahi().simple_poll_free(poll); }
  /// Also frees the client's browsers and resolvers.
  void operator()(AvahiClient* client) const { avahi().client_free(client); }
};
using Poll = std::unique_ptr<AvahiSimplePoll, Free>;
using Client = std::unique_ptr<AvahiClient, Free>;

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
    avahi().address_snprint(text.data(), text.size(), address);
    if (address->proto == AVAHI_PROTO_INET) {
      self.v4 = text.data();
      return;
    }
    self.v6 = text.data();
    // A link-local address needs a zone index, the interface (RFC 4007, 11).
    const std::string name = interface_name(static_cast<unsigned>(interface));
    if (self.v6.starts_with("fe80:") && !name.empty()) self.v6 += "%" + name;
  }
};

/// Limit of concurrent resolvers, against floods of services; the others are only counted.
constexpr std::size_t kMaxResolvers = 4 * DiscoveryResults::kMaxProbes;

class Browser {
 public:
  explicit Browser(DiscoveryResults& results) : results_(results), poll_(avahi().simple_poll_new()) {}

  void run(Duration timeout) {
    int error = 0;
    if (poll_)
      client_.reset(
          avahi().client_new(avahi().simple_poll_get(poll_.get()), AvahiClientFlags{}, on_client, this, &error));
    if (!client_) return say(error);
    if (avahi().service_browser_new(client_.get(), AVAHI_IF_UNSPEC, AVAHI_PROTO_UNSPEC, kServiceType.data(), nullptr,
                                    AvahiLookupFlags{}, on_service, this) == nullptr)
      return say(avahi().client_errno(client_.get()));
    const std::int64_t end = monotonic_now_ns() + timeout.ns;
    while (!failed_) {
      const std::int64_t left = end - monotonic_now_ns();
      if (left <= 0) return;
      constexpr std::int64_t kSlice = 200'000'000;
      if (avahi().simple_poll_iterate(poll_.get(), static_cast<int>(std::min(left, kSlice) / 1'000'000 + 1)) != 0)
        return say(AVAHI_ERR_DISCONNECTED);
    }
  }

 private:
  void say(int error) {
    results_.problem("mDNS: " + std::string(avahi().strerror(error)) + "; is avahi-daemon running on this machine?");
  }

  static void on_client(AvahiClient* client, AvahiClientState state, void* data) {
    auto& self = *static_cast<Browser*>(data);
    if (state != AVAHI_CLIENT_FAILURE) return;
    self.say(avahi().client_errno(client));
    self.failed_ = true;
  }

  static void on_service(AvahiServiceBrowser* browser, AvahiIfIndex interface, AvahiProtocol protocol,
                         AvahiBrowserEvent event, const char* name, const char* type, const char* domain,
                         AvahiLookupResultFlags, void* data) {
    auto& self = *static_cast<Browser*>(data);
    if (event == AVAHI_BROWSER_FAILURE) {
      self.say(avahi().client_errno(avahi().service_browser_get_client(browser)));
      self.failed_ = true;
    } else if (event == AVAHI_BROWSER_REMOVE) {
      self.results_.remove(key(name, domain));
    } else if (event == AVAHI_BROWSER_NEW) {
      // A service is announced on every interface and protocol with the same content; the first is used.
      if (++self.resolvers_ > kMaxResolvers ||
          avahi().service_resolver_new(self.client_.get(), interface, protocol, name, type, domain, AVAHI_PROTO_UNSPEC,
                                       AvahiLookupFlags{}, on_resolved, data) == nullptr)
        self.results_.refuse();
    }
  }

  static void on_resolved(AvahiServiceResolver* resolver, AvahiIfIndex, AvahiProtocol, AvahiResolverEvent event,
                          const char* name, const char*, const char* domain, const char* host, const AvahiAddress*,
                          std::uint16_t, AvahiStringList* txt, AvahiLookupResultFlags, void* data) {
    auto& self = *static_cast<Browser*>(data);
    if (event == AVAHI_RESOLVER_FOUND) self.found(name, domain, host, txt);
    avahi().service_resolver_free(resolver);
  }

  void found(const char* name, const char* domain, const char* host, AvahiStringList* txt) {
    std::vector<std::string> entries;
    for (AvahiStringList* at = txt; at != nullptr; at = avahi().string_list_get_next(at))
      entries.emplace_back(reinterpret_cast<const char*>(avahi().string_list_get_text(at)),
                           avahi().string_list_get_size(at));
    const Result<Advertisement> advertisement = advertisement_from_txt(entries);
    const std::string machine = host;
    if (!advertisement.ok() || !is_machine(machine)) return results_.refuse();
    FoundProbe probe{.by = FoundBy::mdns,
                     .name = advertisement->name,
                     .id = advertisement->probe_id,
                     .calibration_id = advertisement->calibration_id,
                     .version = advertisement->version,
                     .wire_version = advertisement->wire_version,
                     .instance = printable(name),
                     .host = machine,
                     .links = {}};
    for (const AdvertisedLink& link : advertisement->links) {
      std::string uri = link.uri;
      if (const std::size_t at = uri.find("://:"); at != std::string::npos) uri.insert(at + 3, machine);
      probe.links.push_back({uri, link.security});
    }
    results_.put(key(name, domain), std::move(probe));
  }

  /// The host as part of a URI.
  static bool is_machine(const std::string& host) {
    return !host.empty() && host.size() <= 255 && std::ranges::all_of(host, [](unsigned char c) {
      return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' || c == '.' ||
             c == '_';
    });
  }

  static std::string key(const char* name, const char* domain) { return std::string("mdns ") + domain + " " + name; }

  DiscoveryResults& results_;
  const Poll poll_;
  Client client_;
  std::size_t resolvers_ = 0;
  bool failed_ = false;
};

}  // namespace

std::optional<std::string> mdns_address(const std::string& host_port, const std::atomic<bool>* stopping) {
  const std::string host(host_of(host_port)), port = host_port.substr(host_port.rfind(':'));
  if (!AvahiLibrary::loaded().ok()) return std::nullopt;
  Answers answers;
  const Poll poll(avahi().simple_poll_new());
  if (!poll) return std::nullopt;
  const Client client(
      avahi().client_new(avahi().simple_poll_get(poll.get()), AvahiClientFlags{}, Answers::state, &answers, nullptr));
  if (!client) return std::nullopt;
  for (const AvahiProtocol family : {AVAHI_PROTO_INET, AVAHI_PROTO_INET6})
    if (avahi().host_name_resolver_new(client.get(), AVAHI_IF_UNSPEC, AVAHI_PROTO_UNSPEC, host.c_str(), family,
                                       AvahiLookupFlags{}, Answers::take, &answers) != nullptr)
      ++answers.open;
  const std::int64_t begin = monotonic_now_ns();
  std::int64_t end = begin + kTimeout.ns;
  const auto stopped = [stopping] { return stopping != nullptr && *stopping; };
  while (!stopped() && !answers.gone && answers.v4.empty() && answers.open > 0 && monotonic_now_ns() < end) {
    if (avahi().simple_poll_iterate(poll.get(), 20) != 0) break;
    if (!answers.v6.empty()) end = std::min(end, begin + kIpv4Grace.ns);
  }
  if (!answers.v4.empty()) return answers.v4 + port;
  if (!answers.v6.empty()) return "[" + answers.v6 + "]" + port;
  return std::nullopt;
}

void discover_by_mdns(Duration timeout, DiscoveryResults& results) {
  if (const Result<AvahiLibrary>& library = AvahiLibrary::loaded(); !library.ok())
    return results.problem("mDNS: " + library.status().message() + "; install libavahi-client3 and avahi-daemon");
  Browser(results).run(timeout);
}
#else
std::optional<std::string> mdns_address(const std::string&, const std::atomic<bool>*) { return std::nullopt; }

void discover_by_mdns(Duration, DiscoveryResults& results) {
  results.problem("mDNS: this SDK was built without Avahi; install libavahi-client-dev and build it again");
}
#endif

}  // namespace lightwell::core
